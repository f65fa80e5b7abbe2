// SPDX-License-Identifier: Apache-2.0
#include "arm/inverse3/session.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <span>
#include <string_view>

#include "shared/text/text.hpp"
#include "shared/wire/inverse3.hpp"
#include "shared/wire/personality.hpp"

namespace kerf::inverse3 {

std::string text_of(Bar bar) {
  switch (bar) {
    case Bar::none:
      return "the device may push";
    case Bar::parking:
      return "the device waits for the handle's parking button";
    case Bar::gone:
      return "the device is gone from the service's list; connect it again";
    case Bar::replaced:
      return "the service lists another device in place of this one; connect this one again, or "
             "start kerf again for the other";
    case Bar::unpowered:
      return "the device has no 24 V supply; plug it in";
    case Bar::uncalibrated:
      return "the device is not calibrated; hold the grip on the inkwell until its light is solid";
    case Bar::not_ready:
      return "the device is not ready by its service; see the vendor's Hub";
    case Bar::driven:
      return "the device is not idle since the connection was lost, and kerf takes its own force "
             "back first; if that lasts, end the other program that drives it";
    case Bar::proving:
      return "the device is asked whether it obeys the force command";
    case Bar::no_handle:
      return "no handle is there, or not the one of handle=ID, and it has the parking button; "
             "connect it and wake it";
    case Bar::several_handles:
      return "several handles are there, and one of them has the parking button; name it with "
             "handle=ID";
    case Bar::handle_asleep:
      return "the handle sleeps or is out of reach; wake it, then hold the parking button";
    case Bar::no_button:
      return "the handle has no such parking button; name one with park=NAME";
    case Bar::echo:
      return "the device gives another force than was sent, so another program pushes too or the "
             "service "
             "changes it; end that program, then hold the parking button";
    case Bar::idle:
      return "the device fell idle while forces were sent; end other programs that use it, then "
             "hold the "
             "parking button";
    case Bar::event:
      return "the service reports a fault; see the vendor's Hub, then hold the parking button";
    case Bar::stalled:
      return "the service stood still; see what else this machine does, then hold the parking "
             "button";
    case Bar::unproven:
      return "the device stays idle under the force command, so the service does not obey it; "
             "report the service's version (docs/first-hour.md)";
    case Bar::moved_frame:
      return "the session's basis or mount is not the identity, so forces would point elsewhere; "
             "set basis "
             "XYZ and no mount in the vendor's Hub";
    case Bar::damped:
      return "the service adds damping; set it to 0 in the vendor's Hub";
  }
  return "";
}

namespace {

const ArmState* arm_of(const ServiceState& state, const ShortText& id) noexcept {
  const auto all = state.all_arms();
  const auto found =
      std::ranges::find_if(all, [&](const ArmState& a) { return a.id == id.view(); });
  return found == all.end() ? nullptr : &*found;
}

/// Adds a name to a message: what is not plain is not printed.
void add_name(std::string& list, const ShortText& id) {
  if (!list.empty()) list += ", ";
  list += id.is_plain() ? id.view() : "?";
}

std::string listed(std::span<const ArmState> arms) {
  std::string list;
  for (const ArmState& arm : arms) add_name(list, arm.id);
  return list;
}

/// What is not said counts as connected, as of a wired handle.
bool is_connected(const HandleState& handle) noexcept {
  return handle.connected.value_or(true);
}

void refuse_several_handles(const ServiceState& first) {
  std::string list;
  const auto all = first.all_handles();
  for (const HandleState& handle : all) {
    if (is_connected(handle)) add_name(list, handle.id);
  }
  if (std::ranges::count_if(all, is_connected) < 2) return;
  throw std::runtime_error("several handles are there: " + list +
                           "; name the one of this device with handle=ID");
}

ShortText chosen(const ShortText& wanted, bool is_again, const ServiceState& first) {
  const auto all = first.all_arms();
  if (wanted.view().empty() && all.size() > 1) {
    throw std::runtime_error("several devices are there: " + listed(all) +
                             "; name one with device=ID");
  }
  const ArmState* const arm =
      wanted.view().empty() ? (all.empty() ? nullptr : &all.front()) : arm_of(first, wanted);
  if (!arm && all.empty()) {
    throw std::runtime_error("the service has no Inverse3; connect one and power it");
  }
  if (!arm) {
    throw std::runtime_error("the service has no device " + std::string(wanted.view()) + " but " +
                             listed(all) +
                             (is_again ? "; connect that one again, or start kerf again for another"
                                       : "; name one of these with device=ID"));
  }
  if (!arm->id.is_plain()) {
    throw std::runtime_error(
        "the service's device has no usable device_id; is this an Inverse "
        "Service of 3.1 or newer?");
  }
  return arm->id;
}

template <std::size_t N>
std::optional<std::array<double, N>> whole(
    const std::array<std::optional<double>, N>& parts) noexcept {
  std::array<double, N> all{};
  for (std::size_t i = 0; i < N; ++i) {
    if (!parts[i]) return std::nullopt;
    all[i] = *parts[i];
  }
  return all;
}

std::optional<std::array<std::int32_t, 3>> position_um(const ArmState& arm) noexcept {
  const auto metres = whole(arm.position_m);
  if (!metres) return std::nullopt;
  std::array<double, 3> from_origin{};
  for (std::size_t i = 0; i < 3; ++i) from_origin[i] = (*metres)[i] - kOriginM[i];
  const auto kerf_m = kerf_from_service(from_origin);
  std::array<std::int32_t, 3> um{};
  for (std::size_t i = 0; i < 3; ++i) {
    constexpr double kMmPerM = 1000;
    const auto packed = cartesian::packed_mm(kerf_m[i] * kMmPerM);
    if (!packed) return std::nullopt;
    um[i] = *packed;
  }
  return um;
}

/// Empty unless its length is 1 within 1 %.
std::optional<std::array<std::int16_t, 4>> orientation_of(const HandleState& handle) noexcept {
  const auto xyzw = whole(handle.orientation_xyzw);
  if (!xyzw) return std::nullopt;
  double square = 0;
  for (const double part : *xyzw) square += part * part;
  if (!(std::abs(std::sqrt(square) - 1) <= 0.01)) return std::nullopt;
  // R q R^-1: the axis turns like a vector, the angle stays.
  const auto axis = kerf_from_service({(*xyzw)[0], (*xyzw)[1], (*xyzw)[2]});
  return cartesian::packed_orientation({axis[0], axis[1], axis[2], (*xyzw)[3]});
}

bool is_idle(const ArmState& arm) noexcept {
  return arm.mode == "idle" || arm.domain == "undefined" ||
         (arm.mode.view().empty() && arm.domain.view().empty());
}

/// The words of its state, which may be anything.
std::string mode_of(const ArmState& arm) {
  const ShortText& word = arm.mode.view().empty() ? arm.domain : arm.mode;
  return word.is_plain() ? std::string(word.view()) : "?";
}

void refuse_driven(const ArmState& arm) {
  if (is_idle(arm)) return;
  throw std::runtime_error("device " + std::string(arm.id.view()) + " is not idle (" +
                           mode_of(arm) +
                           ") before kerf's first force, so another program drives it and it could "
                           "not be proven that kerf's command is obeyed; end that program");
}

}  // namespace

Session::Session(const Wanted& wanted, ForceKey key, const ServiceState& first, std::int64_t now_ns)
    : device_id_(chosen(wanted.device_id, wanted.is_again, first)),
      park_(wanted.park),
      wanted_handle_(wanted.handle_id),
      key_(key),
      barred_until_ns_(now_ns + kBarNs) {
  was_idle_ = is_idle(*arm_of(first, device_id_));
  if (!wanted.is_again) refuse_driven(*arm_of(first, device_id_));
  if (wanted_handle_.view().empty()) refuse_several_handles(first);
  if (const Bar bar = bar_of_config(*arm_of(first, device_id_)); bar != Bar::none) bar_ = bar;
}

std::array<double, 3> Session::force_n(const CartesianCommand& command, std::int64_t came_ns,
                                       std::int64_t now_ns) noexcept {
  std::array<double, 3> force{};
  if (bar_ == Bar::none && command.force_on && now_ns - came_ns < kCommandNs) {
    double square = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      force[i] = command.force_mn[i] * cartesian::kNewtonsPerCount;
      square += force[i] * force[i];
    }
    constexpr double kPeakN = force_figures(Personality::inverse3).peak_n;
    const double scale = square > kPeakN * kPeakN ? kPeakN / std::sqrt(square) : 1;
    for (double& axis : force) axis *= scale;
    force = service_from_kerf(force);
  }
  sent_[sent_count_++ % sent_.size()] = {now_ns, force};
  return force;
}

void Session::raise(Bar bar, std::int64_t now_ns) noexcept {
  if (is_final(bar_)) return;
  bar_ = bar;
  barred_until_ns_ = now_ns + kBarNs;
}

void Session::settle(Bar present, bool parked, std::int64_t now_ns) noexcept {
  if (present != Bar::none) {
    // While it is set up, or lasts, it counts from its end.
    if (present != Bar::parking) raise(present, now_ns);
    return;
  }
  if (bar_ == Bar::none || is_final(bar_)) return;
  if (now_ns < barred_until_ns_) return;
  bar_ = parked ? Bar::none : bar_;
}

Bar Session::bar_of_config(const ArmState& arm) noexcept {
  if (!arm.has_config) return Bar::none;
  force_gate_ = arm.force_gate;
  if (arm.mount_moves || !(arm.basis.view().empty() || arm.basis == "XYZ")) return Bar::moved_frame;
  return arm.damping.value_or(0) != 0 ? Bar::damped : Bar::none;
}

bool Session::is_echo_near(const ArmState& arm, std::int64_t now_ns) const noexcept {
  const auto echoed = whole(arm.echoed_n);
  if (!echoed) return key_ == ForceKey::values;  // before 3.5 no state has it
  const std::size_t kept = std::min(sent_count_, sent_.size());
  for (std::size_t axis = 0; axis < 3; ++axis) {
    double low = 0, high = 0;
    for (std::size_t i = 0; i < kept; ++i) {
      const Sent& sent = sent_[(sent_count_ - 1 - i) % sent_.size()];
      if (i > 1 && now_ns - sent.at_ns > kEchoWindowNs) break;
      low = i == 0 ? sent.force_n[axis] : std::min(low, sent.force_n[axis]);
      high = i == 0 ? sent.force_n[axis] : std::max(high, sent.force_n[axis]);
    }
    if (!((*echoed)[axis] >= low - kEchoToleranceN && (*echoed)[axis] <= high + kEchoToleranceN)) {
      return false;
    }
  }
  return true;
}

Bar Session::bar_of_echo(const ArmState& arm, std::int64_t now_ns) noexcept {
  const bool is_off = !is_echo_near(arm, now_ns);
  const bool has_stopped = is_idle(arm);
  if (!is_off && !has_stopped) {
    echo_off_since_ns_.reset();
    return Bar::none;
  }
  if (!echo_off_since_ns_) echo_off_since_ns_ = now_ns;
  if (now_ns - *echo_off_since_ns_ <= kEchoPatienceNs) return Bar::none;
  return is_off ? Bar::echo : Bar::idle;
}

Bar Session::bar_of_arm(const ArmState& arm, std::int64_t now_ns) noexcept {
  if (const Bar bar = bar_of_config(arm); bar != Bar::none) return bar;
  // What the service does not say does not count as well.
  if (!arm.power_supply.value_or(false)) return Bar::unpowered;
  if (!arm.calibrated.value_or(false)) return Bar::uncalibrated;
  if (!arm.ready.value_or(true)) return Bar::not_ready;
  if (!was_idle_) {
    was_idle_ = is_idle(arm);
    if (!was_idle_) return Bar::driven;
  }
  if (!is_proven()) {
    // Its device is well, so by now it had to take the force.
    if (++proof_turns_ < kProofTurns) return Bar::proving;
    if (is_idle(arm)) return Bar::unproven;
    proof_turns_ = kProofTurns + 1;
  }
  return bar_of_echo(arm, now_ns);
}

/// The wanted one, else the one so far, else the only one: as if the one before had been gone for a
/// moment.
const HandleState* Session::handle_of(const ServiceState& state, Bar& why) const noexcept {
  const auto all = state.all_handles();
  const std::string_view id =
      wanted_handle_.view().empty() ? handle_id_.view() : wanted_handle_.view();
  const auto same = std::ranges::find_if(all, [&](const HandleState& h) { return h.id == id; });
  if (!id.empty() && same != all.end()) return &*same;
  why = Bar::no_handle;
  if (!wanted_handle_.view().empty()) return nullptr;
  const auto only = std::ranges::find_if(all, is_connected);
  if (only == all.end()) return nullptr;
  if (std::find_if(std::next(only), all.end(), is_connected) == all.end()) return &*only;
  why = Bar::several_handles;
  return nullptr;
}

Bar Session::take_handle(const ServiceState& state, CartesianReport& report) noexcept {
  Bar why = Bar::none;
  const HandleState* const handle = handle_of(state, why);
  if (!handle) return why;
  const bool is_new = !(handle->id == handle_id_.view());
  const bool is_first = handle_id_.view().empty();
  handle_id_ = handle->id;
  if (const auto orientation = orientation_of(*handle)) report.orientation = *orientation;
  const auto buttons = std::span(handle->buttons).first(handle->button_count);
  const auto named = [&](std::string_view name) -> const Button* {
    const auto found =
        std::ranges::find_if(buttons, [&](const Button& b) { return b.name == name; });
    return found == buttons.end() ? nullptr : &*found;
  };
  const bool is_wired = kHandleGroups[handle->group] == "verse_grip";
  const Button* const park = !park_.view().empty()          ? named(park_.view())
                             : is_wired && !buttons.empty() ? &buttons.front()
                                                            : named("c");
  report.parked = park && park->pressed;
  // By name; a handle that names them otherwise has the first two beside the parking button.
  const Button* first = named("a");
  const Button* second = named("b");
  if (!first && !second) {
    for (const Button& button : buttons) {
      if (&button == park) continue;
      (first ? second : first) = &button;
      if (second) break;
    }
  }
  report.button1 = first && first != park && first->pressed;
  report.button2 = second && second != park && second->pressed;
  if (!handle->connected.value_or(true) || !handle->awake.value_or(true)) return Bar::handle_asleep;
  if (!park) return Bar::no_button;
  return is_new && !is_first ? Bar::handle_asleep : Bar::none;
}

std::string Session::why_unread() const {
  const auto metres = whole(unread_m_);
  if (!metres) return "its state has no position of the device; see the vendor's Hub";
  double farthest = 0;
  for (const double part : *metres) farthest = std::max(farthest, std::abs(part));
  return "its position of the device is " + number_text(farthest) +
         " m away, and no arm reaches 1 m: is it in millimetres? Report the service's version "
         "(docs/first-hour.md); see the vendor's Hub";
}

CartesianReport Session::farewell(std::uint32_t number) const noexcept {
  CartesianReport report = last_;
  report.number = number;
  report.homed = report.powered = report.parked = false;
  return report;
}

std::optional<CartesianReport> Session::take(const ServiceState& state, std::uint32_t number,
                                             std::int64_t now_ns) noexcept {
  const ArmState* const arm = arm_of(state, device_id_);
  if (!arm) {
    // One last report, so that the motors are off at once; then it is silent like its device.
    const bool is_first = !is_absent(bar_);
    raise(state.all_arms().empty() ? Bar::gone : Bar::replaced, now_ns);
    return is_first ? std::optional(farewell(number)) : std::nullopt;
  }
  CartesianReport report = last_;
  report.number = number;
  const auto position = position_um(*arm);
  if (!position) {
    unread_m_ = arm->position_m;
    return std::nullopt;
  }
  report.position_um = *position;
  const auto echoed = whole(arm->echoed_n).value_or(std::array<double, 3>{});
  const auto felt = kerf_from_service(echoed);
  for (std::size_t i = 0; i < 3; ++i) report.force_mn[i] = cartesian::packed_n(felt[i]);
  Bar present = bar_of_arm(*arm, now_ns);
  const Bar of_handle = take_handle(state, report);
  if (present == Bar::none) present = of_handle;
  settle(present, report.parked, now_ns);
  report.powered = arm->power_supply.value_or(false);
  report.homed = bar_ == Bar::none;
  last_ = report;
  return report;
}

}  // namespace kerf::inverse3
