// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "visualizer/gl/window.hpp"
#include "visualizer/space_mouse/space_mouse_report.hpp"

namespace kerf {

/// Adds what a SpaceMouse holds, where one is connected, to what keys and a gamepad hold: the cap
/// moves and tilts the hand, its first button presses. Never waits. One thread.
class SpaceMouse {
 public:
  /// Puts the next report into the bytes; its size, 0 where none has come, negative once the device
  /// is gone.
  using Read = std::function<int(std::span<std::uint8_t>)>;

  /// The first one that is connected now; it is not looked for again.
  SpaceMouse();
  explicit SpaceMouse(Read read) : read_(std::move(read)) {}

  /// Once a frame. What the user has to know, once: it cannot be opened, or was drawn out.
  [[nodiscard]] std::optional<std::string> step(HeldControls& held);

 private:
  Read read_;  ///< none: no SpaceMouse
  SpaceMouseState state_;
  std::optional<std::string> problem_;
};

}  // namespace kerf
