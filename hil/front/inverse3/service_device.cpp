// SPDX-License-Identifier: Apache-2.0
#include "hil/front/inverse3/service_device.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "shared/text/json.hpp"
#include "shared/wire/inverse3.hpp"

namespace kerf {
namespace {

constexpr const char* kDeviceId = "0A1C";
constexpr const char* kOtherId = "0B2D";
constexpr const char* kWiredId = "51877";
constexpr const char* kWirelessId = "40213";
constexpr const char* kThirdId = "40999";
constexpr double kForceStepN = 0.014;
constexpr std::array<std::int32_t, 3> kElsewhereUm{50'000, -20'000, 30'000};  ///< another arm's tip
constexpr double kSecondClientN = 1.0;

Json vec(double x, double y, double z) {
  return {{"x", x}, {"y", y}, {"z", z}};
}
Json identity() {
  return {{"w", 1}, {"x", 0}, {"y", 0}, {"z", 0}};
}

double rounded(double value, double step) {
  return std::round(value / step) * step;
}

/// Kerf's frame into that of the service: X to the right, Y away from the user, Z up.
/// In metres times `scale`.
Json position(const std::array<std::int32_t, 3>& um, double scale) {
  constexpr double kStepsPerM = 1e5;  // of 10 um
  const auto metres = [scale](double um_of_axis, double origin_m) {
    return scale * (std::round((um_of_axis * 1e-6 + origin_m) * kStepsPerM) / kStepsPerM);
  };
  return vec(metres(um[0], inverse3::kOriginM[0]), metres(-um[2], inverse3::kOriginM[1]),
             metres(um[1], inverse3::kOriginM[2]));
}
Json force(const std::array<std::int16_t, 3>& mn) {
  return vec(mn[0] / 1000.0, -mn[2] / 1000.0, mn[1] / 1000.0);
}
Json velocity(const std::array<double, 3>& mm_s) {
  const auto stepped = [](double mm) { return rounded(mm, 0.5) / 1000.0; };
  return vec(stepped(mm_s[0]), stepped(-mm_s[2]), stepped(mm_s[1]));
}
Json orientation(const std::array<std::int16_t, 4>& xyzw) {
  constexpr double kOne = cartesian::kQuaternionOne;
  return {
      {"w", xyzw[3] / kOne}, {"x", xyzw[0] / kOne}, {"y", -xyzw[2] / kOne}, {"z", xyzw[1] / kOne}};
}

/// The message of the event port that the brake has engaged.
std::string brake_event() {
  const Json event = {{"name", "device-safety-triggered"},
                      {"category", "device"},
                      {"level", "error"},
                      {"data", Json{{"device_id", kDeviceId}, {"safety_type", "ebrake_triggered"}}},
                      {"message", "brake engaged"}};
  return event.canonical();
}

/// A member of a member of an object; nothing if there is none.
const Json* find(const Json* from, std::initializer_list<std::string_view> path) {
  for (const std::string_view name : path) {
    if (!from || !from->contains(name)) return nullptr;
    from = &from->at(name);
  }
  return from;
}

/// A force of the service's frame in mN of kerf's, stepped and without what is no number.
std::optional<std::array<std::int16_t, 3>> kerf_mn(const Json& vector) {
  try {
    const double x = vector.at("x").get<double>();
    const double y = vector.at("y").get<double>();
    const double z = vector.at("z").get<double>();
    std::array<std::int16_t, 3> mn{};
    const std::array<double, 3> kerf{x, z, -y};
    for (std::size_t i = 0; i < 3; ++i) mn[i] = cartesian::packed_n(rounded(kerf[i], kForceStepN));
    return mn;
  } catch (const JsonError&) {
    return std::nullopt;
  }
}

}  // namespace

ServiceDevice::ServiceDevice(const ServiceSettings& settings, PacketDevice& device)
    : settings_(settings),
      device_(device),
      profile_(settings.profile),
      malformed_way_(settings.first_way) {
  std::ranges::stable_sort(settings_.script, {}, &ScriptedServiceFault::cycle);
}

std::string ServiceDevice::greet() {
  ++session_;
  replies_.clear();
  wants_full_state_ = false;
  link_fault_.reset();
  // The device answers commands alone, and the list has a state, too. Its force stays.
  device_.receive(encode(command_));
  advance(settings_.lockstep ? kCyclesPerSecond / settings_.rate_hz : 1);
  take_packets();
  replies_.clear();
  return state_text(true);
}

void ServiceDevice::receive(std::string_view text) {
  take_command(text);
  device_.receive(encode(command_));
  advance(settings_.lockstep ? kCyclesPerSecond / settings_.rate_hz : 1);
  take_packets();
}

void ServiceDevice::advance(int cycles) {
  device_.advance(cycles);
  cycle_ += cycles;
  begin_faults();
}

/// Each packet is a reply: what a fault keeps back has none.
void ServiceDevice::take_packets() {
  for (auto packet = device_.next_packet(); !packet.empty(); packet = device_.next_packet()) {
    const auto report = decode_cartesian_report(packet);
    if (report) follow(*report);
    std::string text = state_text(std::exchange(wants_full_state_, false));
    // A fault script may have broken the packet: so is the message.
    if (!report) text.resize(text.size() / 2);
    const bool is_broken = is_unreadable_ || malformed_left_ > 0;
    replies_.push_back(is_broken ? broken(text) : ServiceMessage{std::move(text)});
    replies_.back().is_broken = is_broken || !report;
  }
}

std::optional<ServiceMessage> ServiceDevice::next_reply() {
  take_packets();
  if (replies_.empty()) return std::nullopt;
  ServiceMessage reply = std::move(replies_.front());
  replies_.pop_front();
  return reply;
}

/// The velocity of the real device comes at 200 Hz: a low pass of that corner.
void ServiceDevice::follow(const CartesianReport& report) noexcept {
  const double seconds =
      static_cast<double>(std::max<std::int64_t>(cycle_ - report_cycle_, 1)) * kCycleS;
  const double part = 1 - std::exp(-2 * std::numbers::pi * 200 * seconds);
  for (std::size_t i = 0; i < 3; ++i) {
    const double mm = (report.position_um[i] - report_.position_um[i]) / 1000.0;
    velocity_mm_s_[i] += part * (mm / seconds - velocity_mm_s_[i]);
  }
  if (report_.number == 0) velocity_mm_s_ = {};
  report_ = report;
  report_cycle_ = cycle_;
}

void ServiceDevice::take_command(std::string_view text) {
  CartesianCommand command;
  bool is_forced = false;
  try {
    const Json message = Json::parse(text);
    wants_full_state_ =
        wants_full_state_ || find(&message, {"session", "force_render_full_state"}) != nullptr;
    const Json* const arms = find(&message, {"inverse3"});
    // NOLINTNEXTLINE(clang-analyzer-core.NullDereference): it takes the next element for null
    for (const Json& arm : arms ? *arms : Json(Json::List{})) {
      const Json* const id = find(&arm, {"device_id"});
      if (!id || !id->is_text() || id->get<std::string>() != (has_other_id_ ? kOtherId : kDeviceId))
        continue;
      // The name of another version is as unknown as any other word.
      const Json* const vector =
          find(&arm, {"commands", "set_cursor_force", is_3_5() ? "vector" : "values"});
      const auto mn = vector ? kerf_mn(*vector) : std::nullopt;
      if (!mn) continue;
      is_forced = true;
      command.force_mn = *mn;
    }
  } catch (const JsonError&) {
    return;  // what the service does on bad JSON is not known: the force stays, its state goes out
  }
  is_forced_ = is_forced;
  if (has_second_client_) command.force_mn[0] += static_cast<std::int16_t>(1000 * kSecondClientN);
  // A force of zero shows no host: the hand would take it for one that is ready.
  command.force_on = is_powered_ && is_listed_ && command.force_mn != std::array<std::int16_t, 3>{};
  command_ = command;
}

Json ServiceDevice::arm_config(const std::string& name) const {
  Json config = {{"type", "inverse3"}, {"handedness", "right"}};
  config["device_info"] = {{"major_version", 7}, {"minor_version", 2}, {"id", name}};
  config["gravity_compensation"] = {{"enabled", true}, {"scaling_factor", 1.0}};
  if (is_3_5()) {
    config["preset"] = "defaults";
    config["basis"] = {{"permutation", is_reconfigured_ ? "XZ-Y" : "XYZ"}};
    config["mount"] = {
        {"position", vec(0, 0, 0)}, {"rotation", identity()}, {"scale", vec(1, 1, 1)}};
    config["filters"] = {{"force_gate", Json{{"gain", 0.3}}},
                         {"damping", Json{{"scalar", is_reconfigured_ ? 1.0 : 0.0}}}};
  }
  return config;
}

std::string ServiceDevice::state_text(bool with_config, double position_scale) const {
  const std::string id = has_other_id_ ? kOtherId : kDeviceId;
  const auto entry = [&](const std::string& name, bool is_ours) {
    Json arm = {{"device_id", name}};
    if (with_config) arm["config"] = arm_config(name);
    const auto at_um = is_ours ? report_.position_um : kElsewhereUm;
    Json state = {{"cursor_position", position(at_um, position_scale * settings_.position_scale)},
                  {"cursor_velocity", velocity(velocity_mm_s_)}};
    const bool is_driven = is_ours && (is_forced_ || is_driven_);
    // The word for a running force is a guess: the pages show "idle" alone.
    if (is_3_5()) {
      state["current_cursor_force"] =
          force(is_ours ? report_.force_mn : std::array<std::int16_t, 3>{});
      state["control_domain"] = is_driven ? "cartesian" : "undefined";
      state["control_mode"] = is_driven ? "force" : "idle";
    } else {
      state["mode"] = is_driven ? "force" : "idle";
    }
    arm["state"] = state;
    const bool is_powered = is_ours && is_powered_ && report_.powered;
    arm["status"] = {{"calibrated", report_.homed},
                     {"in_use", is_driven},
                     {"power_supply", is_powered},
                     {"ready", true},
                     {"started", true}};
    return arm;
  };
  Json arms = Json::List{};
  if (has_second_arm_) arms.push_back(entry(kOtherId, false));
  if (is_listed_) arms.push_back(entry(id, true));
  const Json turned = orientation(is_awake_ ? report_.orientation : held_orientation_);
  Json wired = Json::List{}, wireless = Json::List{};
  if (profile_ != ServiceProfile::v3_5_wireless) {
    wired.push_back(
        {{"device_id", kWiredId},
         {"state",
          Json{{"button", is_awake_ && report_.parked}, {"hall", 9}, {"orientation", turned}}},
         {"status", Json{{"error", 0}, {"awake", is_awake_}}}});
  }
  if (has_third_handle_) {
    wireless.push_back(
        {{"device_id", kThirdId},
         {"state", Json{{"orientation", identity()},
                        {"buttons", Json{{"a", false}, {"b", false}, {"c", false}}}}},
         {"status", Json{{"connected", true}, {"awake", true}, {"ready", true}}}});
  }
  if (is_3_5()) {
    wireless.push_back(
        {{"device_id", kWirelessId},
         {"state", Json{{"orientation", turned},
                        {"hall", 4},
                        {"buttons", Json{{"a", is_awake_ && report_.button1},
                                         {"b", is_awake_ && report_.button2},
                                         {"c", is_awake_ && report_.parked}}},
                        {"battery_level", 0.81}}},
         {"status", Json{{"connected", true}, {"awake", is_awake_}, {"ready", is_awake_}}}});
  }
  Json message = {{"inverse3", arms}, {"verse_grip", wired}, {"wireless_verse_grip", wireless}};
  if (with_config && is_3_5()) message["session_id"] = session_;
  return message.canonical();
}

ServiceMessage ServiceDevice::broken(const std::string& text) {
  malformed_left_ = std::max(malformed_left_ - 1, 0);
  const auto replaced = [&](std::string_view what, const std::string& by) {
    std::string out = text;
    if (const std::size_t at = out.find(what); at != std::string::npos) {
      out.replace(at, what.size(), by);
    }
    return out;
  };
  constexpr const char* kPosition = "\"cursor_position\":{";
  switch (malformed_way_++ % kMalformedWays) {
    case 0:
      return {text.substr(0, text.size() / 2)};
    case 1:
      return {replaced(kPosition, std::string(kPosition) + "\"x\":NaN,")};
    case 2:
      return {replaced("\"cursor_position\"", "\"cursor_place\"")};
    case 3:
      return {replaced(kPosition, R"("cursor_position":"here","was":{)")};
    case 4:
      return {replaced("\"inverse3\":", "\"deep\":" + std::string(1000, '[') +
                                            std::string(1000, ']') + ",\"inverse3\":")};
    case 5:
      return {text, true};
    case 6:
      return {state_text(false, 1000)};  // millimetres
    case 7:
      return {replaced(kPosition, R"("cursor_position":{"x":null,"y":0,"z":0},"was":{)")};
    case 8:
      return {replaced(kPosition, R"("cursor_position":{"x":1e300,"y":0,"z":0},"was":{)")};
    case 9:  // a WebSocket's client ends the connection at this and the next
      return {replaced("\"inverse3\":", "\"name\":\"\xff\",\"inverse3\":")};
    default:
      return {replaced("{\"inverse3\"",
                       "{\"pad\":\"" + std::string(std::size_t{1} << 20, 'x') + "\",\"inverse3\"")};
  }
}

void ServiceDevice::begin_faults() {
  while (faults_begun_ < settings_.script.size() &&
         settings_.script[faults_begun_].cycle <= cycle_) {
    begin(settings_.script[faults_begun_++].fault);
  }
}

void ServiceDevice::begin(ServiceFault fault) {
  switch (fault) {
    case ServiceFault::malformed:
      ++malformed_left_;
      break;
    case ServiceFault::unreadable:
    case ServiceFault::readable:
      is_unreadable_ = fault == ServiceFault::unreadable;
      break;
    case ServiceFault::restart:
    case ServiceFault::close:
    case ServiceFault::going_away:
    case ServiceFault::half_close:
    case ServiceFault::fin:
    case ServiceFault::reset:
    case ServiceFault::half_open:
      link_fault_ = fault;
      break;
    case ServiceFault::vanish:
    case ServiceFault::back:
      is_listed_ = fault == ServiceFault::back;
      break;
    case ServiceFault::other_id:
      has_other_id_ = true;
      break;
    case ServiceFault::second_arm:
      has_second_arm_ = true;
      break;
    case ServiceFault::third_handle:
      has_third_handle_ = true;
      break;
    case ServiceFault::driven:
      is_driven_ = true;
      break;
    case ServiceFault::power_off:
    case ServiceFault::power_on:
      is_powered_ = fault == ServiceFault::power_on;
      break;
    case ServiceFault::grip_sleep:
      held_orientation_ = report_.orientation;
      is_awake_ = false;
      break;
    case ServiceFault::grip_wake:
      is_awake_ = true;
      break;
    case ServiceFault::second_client:
      has_second_client_ = true;
      break;
    case ServiceFault::reconfigure:
      is_reconfigured_ = true;
      break;
    case ServiceFault::event:
      events_.push_back(brake_event());
      break;
  }
}

std::optional<ServiceFault> ServiceDevice::take_link_fault() {
  if (link_fault_ == ServiceFault::restart) {
    profile_ = is_3_5() ? ServiceProfile::v3_4 : ServiceProfile::v3_5;
  }
  return std::exchange(link_fault_, std::nullopt);
}

std::optional<std::string> ServiceDevice::take_event() {
  if (events_.empty()) return std::nullopt;
  std::string event = std::move(events_.front());
  events_.pop_front();
  return event;
}

std::optional<std::string> ServiceDevice::get(std::string_view path) const {
  if (path == "/version") {
    const ServiceProfile claimed = settings_.claims.value_or(profile_);
    const char* version = claimed == ServiceProfile::v3_0   ? "3.0.7.0"
                          : claimed == ServiceProfile::v3_4 ? "3.4.8.0"
                                                            : "3.5.0.0";
    const Json answer = {
        {"project_name", "haply-inverse-service"},
        {"project_version", version},
        {"git_tag", "emulated"},
        // Not of the service: by it kerf's driver knows how this emulator runs.
        {"kerf_emulator", Json{{"lockstep", settings_.lockstep}, {"rate_hz", settings_.rate_hz}}}};
    return answer.canonical();
  }
  if (path == "/devices" && has_web_socket()) return state_text(true);
  if (path == "/settings/devices/force_scale" && is_3_5() && has_web_socket()) {
    // The envelope is a guess.
    const Json answer = {{"ok", true}, {"value", is_reconfigured_ ? 0.5 : 1.0}};
    return answer.canonical();
  }
  return std::nullopt;
}

}  // namespace kerf
