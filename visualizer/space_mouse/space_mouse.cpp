// SPDX-License-Identifier: Apache-2.0
#include "visualizer/space_mouse/space_mouse.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <utility>

#include <hidapi/hidapi.h>

namespace kerf {

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
               " cannot be opened; give your user the right (docs/mouse.md)";
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

}  // namespace kerf
