// SPDX-License-Identifier: Apache-2.0

#include "visualizer/app/hand_control.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstddef>
#include <memory>
#include <utility>

#include <hidapi/hidapi.h>
#include <sys/socket.h>
#include <unistd.h>

#include "shared/posix/sockets.hpp"
#include "visualizer/scene/visualizer_error.hpp"

namespace kerf {

namespace {

/// The point moved away from the eye by so many mm along the view axis, on its ray.
SeenPoint deeper(const SeenPoint& seen, double by_mm, double least_mm, double most_mm) {
  return {seen.pixel, std::clamp(seen.depth_mm + by_mm, least_mm, std::max(least_mm, most_mm))};
}

bool moves_view(const WindowInput& input) {
  return input.of_view || input.zoom != 0.0 || input.turn_right != 0.0 || input.turn_up != 0.0 ||
         input.move_right != 0.0 || input.move_up != 0.0;
}

}  // namespace

void PointerHand::step(const WindowInput& input, bool over_panel, const View& view,
                       PictureSize size, const glm::dvec3& tool_mm, const DeviceFrame& device,
                       double frame_s) {
  const bool points = input.hovers && !over_panel;
  const HeldControls& held = input.held;
  by_pad_ = held.by_pad || (by_pad_ && !input.hovers);
  leads_ = input.hovers || by_pad_;
  const bool down = input.pointer.down || held.pedal;
  spent_ = down && (spent_ || input.left || !points || moves_view(input));
  const bool by_pointer = down && !spent_;
  pedal_ = by_pointer || held.press;
  press_mm_ = glm::dvec3(0.0);
  const SeenPoint tool = seen_at(view, size, tool_mm);
  const bool same_view = std::exchange(view_, view) == view;
  if (tool.depth_mm <= 0.0 || input.left) under_pointer_ = false;
  if (tool.depth_mm <= 0.0) return;  // a tool behind the eye is not led
  const bool acts = input.came || input.free_right != 0.0 || input.free_up != 0.0 ||
                    input.wheel != 0.0 || input.pointer.down || held.deeper != 0.0;
  if (!goal_mm_ && ((points && acts) || held.by_pad)) goal_mm_ = tool_mm;
  if (!goal_mm_) return;
  SeenPoint seen = seen_at(view, size, *goal_mm_);
  if (seen.depth_mm <= 0.0) seen = tool;
  const double scale = device.scale;
  const double held_mm = kHeldMmPerS * scale * frame_s;
  const double mm_per_pixel = 2.0 * view.tan_half_height * seen.depth_mm / size.height;
  const glm::dvec2 by_keys = glm::dvec2(held.right, -held.up) * (held_mm / mm_per_pixel);
  seen.pixel += by_keys;
  const glm::dvec2 pointer(input.pointer.x, input.pointer.y);
  if (points && !under_pointer_) {
    seen.pixel = pointer;
  } else if (points && same_view && !moves_view(input)) {
    seen.pixel = pointer + beside_ + by_keys;
  } else if (points) {
    seen.pixel += glm::dvec2(input.free_right + input.drag_right, -input.free_up - input.drag_up) *
                  static_cast<double>(size.height);
  }
  under_pointer_ = points;
  beside_ = seen.pixel - pointer;
  const double by_mm = (points ? input.wheel * kWheelMm * scale : 0.0) + held.deeper * held_mm;
  const double least_mm = 2.0 * view.near_mm;
  const double most_mm = std::max(seen.depth_mm, tool.depth_mm + kMostAheadMm * scale);
  seen = deeper(seen, by_mm, least_mm, most_mm);
  goal_mm_ = world_at(view, size, seen);
  const bool presses = (by_pointer && input.pointer.down) || held.press;
  const glm::dvec3 eye_mm(glm::inverse(view.eye_from_world)[3]);
  if (presses) press_mm_ = glm::normalize(*goal_mm_ - eye_mm) * (kPressMm * scale);
  const glm::dvec2 turned = glm::dvec2(held.tilt_right, held.tilt_up) * (kHeldRadPerS * frame_s);
  tilt_rad_ = glm::clamp(tilt_rad_ + turned, -kMaxTargetRad, kMaxTargetRad);
}

std::optional<glm::dvec3> PointerHand::goal_mm() const {
  if (!goal_mm_) return std::nullopt;
  return *goal_mm_ + press_mm_;
}

HandTarget PointerHand::target(const DeviceFrame& device) const {
  const glm::dvec3 at = (goal_mm().value_or(device.offset_mm) - device.offset_mm) / device.scale;
  return {.tip_mm = {at.x, at.y, at.z},
          .orientation_rad = {tilt_rad_.x, tilt_rad_.y, 0.0},
          .button1 = pedal_};
}

namespace {

constexpr std::size_t kThreeAxes = 1 + 3 * 2, kSixAxes = 1 + 6 * 2;  // bytes

/// Three axes from byte `at` on.
std::array<double, 3> axes(std::span<const std::uint8_t> report, std::size_t at) {
  constexpr double kMost = 350;
  std::array<double, 3> all{};
  for (double& axis : all) {
    const auto bits = static_cast<std::uint16_t>(report[at] | report[at + 1] << 8U);
    axis = std::clamp(static_cast<std::int16_t>(bits) / kMost, -1.0, 1.0);
    at += 2;
  }
  return all;
}

}  // namespace

bool take_report(std::span<const std::uint8_t> report, SpaceMouseState& state) noexcept {
  if (report.empty()) return false;
  const std::size_t size = report.size();
  switch (report[0]) {
    case 1:
      if (size != kThreeAxes && size != kSixAxes) return false;
      state.push = axes(report, 1);
      if (size == kSixAxes) state.turn = axes(report, kThreeAxes);
      return true;
    case 2:
      if (size != kThreeAxes) return false;
      state.turn = axes(report, 1);
      return true;
    case 3:
      if (size < 2 || size > 8) return false;
      state.button = (report[1] & 1U) != 0;
      return true;
    default:
      return false;
  }
}

namespace {

/// 3Dconnexion's own identity, and that of Logitech, under which it sold until 2013.
bool is_space_mouse(const hid_device_info& about) {
  constexpr unsigned short kOwn = 0x256f, kLogitech = 0x046d;
  constexpr unsigned short kDesktopPage = 1, kMultiAxis = 8;
  const bool logitech =
      about.vendor_id == kLogitech && about.product_id >= 0xc603 && about.product_id <= 0xc62b;
  return (about.vendor_id == kOwn || logitech) && about.usage_page == kDesktopPage &&
         about.usage == kMultiAxis;
}

/// A cap that rests is seldom quite in its middle.
double beyond_rest(double axis) {
  constexpr double kRests = 0.05;
  const double beyond = std::max(std::abs(axis) - kRests, 0.0) / (1 - kRests);
  return std::copysign(beyond, axis);
}

bool any(const std::array<double, 3>& axes) {
  return std::any_of(axes.begin(), axes.end(), [](double a) { return beyond_rest(a) != 0.0; });
}

}  // namespace

SpaceMouse::SpaceMouse() {
  constexpr unsigned short kAny = 0;
  const std::unique_ptr<hid_device_info, void (*)(hid_device_info*)> list(hid_enumerate(kAny, kAny),
                                                                          hid_free_enumeration);
  const hid_device_info* about = list.get();
  while (about != nullptr && !is_space_mouse(*about)) about = about->next;
  if (about == nullptr) return;
  const std::shared_ptr<hid_device> device(hid_open_path(about->path), [](hid_device* opened) {
    if (opened != nullptr) hid_close(opened);
  });
  if (!device) {
    problem_ = std::string("SpaceMouse: ") + about->path +
               " cannot be opened; give your user the right (docs/window.md)";
    return;
  }
  hid_set_nonblocking(device.get(), 1);
  read_ = [device](std::span<std::uint8_t> bytes) {
    return hid_read(device.get(), bytes.data(), bytes.size());
  };
}

std::optional<std::string> SpaceMouse::step(HeldControls& held) {
  constexpr int kMostReports = 64;  // a frame's worth, and no more however fast they come
  std::array<std::uint8_t, 64> bytes{};
  for (int i = 0; read_ && i < kMostReports; ++i) {
    const int size = read_(bytes);
    if (size == 0) break;
    if (size > 0) {
      take_report(std::span(bytes).first(static_cast<std::size_t>(size)), state_);
    } else {
      read_ = nullptr;
      state_ = {};
      problem_ = "SpaceMouse: it is gone; pointer and keys go on leading the hand";
    }
  }
  held.right += beyond_rest(state_.push[0]);
  held.deeper -= beyond_rest(state_.push[1]);
  held.up -= beyond_rest(state_.push[2]);
  held.tilt_right -= beyond_rest(state_.turn[1]);
  held.tilt_up -= beyond_rest(state_.turn[0]);
  held.press = held.press || state_.button;
  held.by_pad = held.by_pad || state_.button || any(state_.push) || any(state_.turn);
  return std::exchange(problem_, std::nullopt);
}

namespace {

constexpr auto kTryPause = std::chrono::milliseconds(500);
constexpr auto kPatience = std::chrono::seconds(3);  // an emulator that starts beside the window

}  // namespace

HandLink::HandLink(std::string path) : path_(std::move(path)) {
  constexpr std::size_t kLongest = sizeof(sockaddr_un::sun_path) - 1;
  if (path_.empty() || path_.size() > kLongest) {
    throw VisualizerError("--hand-socket: " + path_ + " has " + std::to_string(path_.size()) +
                          " bytes; use 1 to " + std::to_string(kLongest));
  }
}

HandLink::~HandLink() {
  leave();
}

void HandLink::leave() noexcept {
  if (fd_ >= 0) close(fd_);
  fd_ = -1;
}

void HandLink::connect() noexcept {
  fd_ = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd_ < 0) return;
  const sockaddr_un address = unix_address(path_);
  if (::connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) leave();
}

HandLink::State HandLink::heard() noexcept {
  std::array<std::uint8_t, 64> bytes;
  const ssize_t size = recv(fd_, bytes.data(), bytes.size(), MSG_DONTWAIT);
  if (size < 0 && (errno == EAGAIN || errno == EINTR)) return state_;
  if (size <= 0) return State::absent;
  const auto greeting = decode_hand_greeting({bytes.data(), static_cast<std::size_t>(size)});
  if (!greeting) return State::stranger;
  return *greeting == HandGreeting::yours ? State::leads : State::taken;
}

std::optional<Notice> HandLink::turned(State state) {
  const bool had_it = told_ == State::leads;
  told_ = state;
  switch (state) {
    case State::leads:
      return Notice{"the hand is yours: move the pointer; left button: press; h: all keys"};
    case State::taken:
      return Notice{"hand: another window leads it; close that one, or only watch here", true};
    case State::stranger:
      return Notice{"hand: " + path_ + " is no kerf-emulator of this version; build both anew",
                    true};
    case State::absent:
      return Notice{had_it ? "hand: the emulator has gone; waiting for it at " + path_
                           : "hand: no emulator at " + path_ +
                                 "; start kerf-emulator with --hand-socket " + path_,
                    true};
    case State::asked:
      break;
  }
  return std::nullopt;
}

std::optional<Notice> HandLink::step(Clock::time_point now) {
  if (!began_) began_ = now;
  if (fd_ < 0 && now >= next_try_) {
    next_try_ = now + kTryPause;
    connect();
    if (fd_ >= 0) {
      state_ = State::asked;
    } else if (state_ != State::taken || errno == ENOENT || errno == ECONNREFUSED) {
      state_ = State::absent;
    }
  }
  if (fd_ >= 0) {
    state_ = heard();
    if (state_ != State::asked && state_ != State::leads) leave();
  }
  const bool in_vain =
      state_ == State::absent && (told_ == State::leads || now - *began_ >= kPatience);
  const bool news = state_ == State::absent ? in_vain : state_ != State::asked;
  return news && state_ != told_ ? turned(state_) : std::nullopt;
}

void HandLink::send(const HandTarget& target) noexcept {
  if (!leads()) return;
  const HandTargetBytes bytes = encode(target);
  // A full socket is one whose emulator stands still: it takes the newest target once it goes on.
  static_cast<void>(::send(fd_, bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL));
}

}  // namespace kerf
