// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include <glm/glm.hpp>

#include "shared/wire/emulator_link.hpp"
#include "visualizer/gl/window.hpp"
#include "visualizer/panels/overlay.hpp"
#include "visualizer/scene/camera.hpp"
#include "visualizer/scene/scene_view.hpp"

namespace kerf {

/// The pose that the pointer asks the hand to take.
///
/// The goal is a point of the world. It moves with the pointer in the plane through it that faces
/// the eye, and along the ray from the eye with wheel, keys and sticks; while the left button is
/// down it lies `kPressMm` deeper. It stands under the pointer, at the tool's own depth, when the
/// pointer, its wheel or its button is first used (not by a pointer that lay where the window
/// opened), when the pointer comes from outside or from a panel, and again on `come`. From then on
/// it keeps its distance in the picture from the pointer, which only sticks, keys and another view
/// change: a camera that turns or moves leaves it where it is.
///
/// The pedal is down while the left button, the space bar, or a pad's or SpaceMouse's button is. A
/// press of button or bar ends when the pointer is no longer over the window or comes over a panel,
/// when the view moves or a button that moves it is down, when the goal jumps, and on `end_press`;
/// it does not go on when the pointer comes back: it is to be pressed anew. Lengths below are mm of
/// the hand: of the world, times the scene's scale.
class PointerHand {
 public:
  static constexpr double kWheelMm = 0.25;   ///< a notch
  static constexpr double kPressMm = 3.0;    ///< at the emulated grip, 0.5 N/mm, up to 1.5 N
  static constexpr double kHeldMmPerS = 20;  ///< keys and sticks
  static constexpr double kHeldRadPerS = 0.8;
  static constexpr double kMostAheadMm =
      15;  ///< deeper than the tool: more would be tedious to wind back

  /// One frame that lasts `frame_s`. `over_panel`: the pointer is a panel's. `tool_mm`: where the
  /// tool is seen.
  void step(const WindowInput& input, bool over_panel, const View& view, PictureSize size,
            const glm::dvec3& tool_mm, const DeviceFrame& device, double frame_s);
  /// The goal goes back under the pointer.
  void come() noexcept {
    under_pointer_ = false;
    end_press();
  }
  /// Whether the pedal was down in the last frame.
  [[nodiscard]] bool presses() const noexcept { return pedal_; }
  /// Button and bar count as up until they are pressed anew.
  void end_press() noexcept { spent_ = true; }

  /// Whether the user holds the hand: the pointer is over the window, or a gamepad came after it.
  [[nodiscard]] bool leads() const noexcept { return leads_ && goal_mm_.has_value(); }
  /// With what the left button adds; none before the pointer came.
  [[nodiscard]] std::optional<glm::dvec3> goal_mm() const;
  [[nodiscard]] HandTarget target(const DeviceFrame& device) const;

 private:
  std::optional<glm::dvec3> goal_mm_;
  glm::dvec3 press_mm_{0.0};
  glm::dvec2 tilt_rad_{0.0};
  bool under_pointer_ = false;  ///< since the pointer came
  glm::dvec2 beside_{0.0};  ///< from the pointer to the goal, in pixels; sticks and views do that
  View view_;               ///< of the last frame
  bool leads_ = false, by_pad_ = false;
  bool pedal_ = false;
  bool spent_ = false;  ///< the press that is held has ended
};

/// State of a SpaceMouse of 3Dconnexion: six axes and the first button.
///
/// x points right, y to the user, z down; the rotations are right-handed about them. An axis gives
/// how far the cap is pushed, -1 to 1; the cap springs back, and then gives 0.
struct SpaceMouseState {
  std::array<double, 3> push{}, turn{};
  bool button = false;
};

/// Parses a hidraw input report that starts with its report ID. If it is not one of the reports
/// below, returns false and leaves `state` unchanged. There are two layouts, of 16-bit
/// little-endian numbers:
///
///     1 x y z, 2 rx ry rz      7 bytes each
///     1 x y z rx ry rz         13 bytes
///     3 buttons                2 to 8 bytes, a bit for each
///
/// A number is clamped to +-350, the end of the cap's travel.
bool take_report(std::span<const std::uint8_t> report, SpaceMouseState& state) noexcept;

/// Adds the state of a SpaceMouse, if one is connected, to that of keys and gamepad: the cap moves
/// and tilts the hand, its first button presses. Never waits. One thread.
class SpaceMouse {
 public:
  /// Writes the next report into the bytes. Returns its size, 0 if there is none, or a negative
  /// number once the device is gone.
  using Read = std::function<int(std::span<std::uint8_t>)>;

  /// The first one that is connected now; it is not looked for again.
  SpaceMouse();
  explicit SpaceMouse(Read read) : read_(std::move(read)) {}

  /// Once a frame. Returns each problem that the user has to know once: the device cannot be
  /// opened, or was unplugged.
  [[nodiscard]] std::optional<std::string> step(HeldControls& held);

 private:
  Read read_;  ///< none: no SpaceMouse
  SpaceMouseState state_;
  std::optional<std::string> problem_;
};

/// A window's end of the socket at which kerf-emulator lets its hand be led (`--hand-socket`).
///
/// It asks for the hand twice a second until it has it: an emulator may start later, start again,
/// or have another window first. Never waits. One thread.
class HandLink {
 public:
  using Clock = Notices::Clock;

  /// Throws VisualizerError for a path that no socket can have.
  explicit HandLink(std::string path);
  HandLink(const HandLink&) = delete;
  HandLink& operator=(const HandLink&) = delete;
  ~HandLink();

  /// Connects and listens; what the user has to know of it, each thing once.
  [[nodiscard]] std::optional<Notice> step(Clock::time_point now);
  [[nodiscard]] bool leads() const noexcept { return state_ == State::leads; }
  /// The target of this frame; nothing happens while the hand is not this window's.
  void send(const HandTarget& target) noexcept;

 private:
  enum class State : std::uint8_t { absent, asked, leads, taken, stranger };

  void connect() noexcept;
  void leave() noexcept;
  [[nodiscard]] State heard() noexcept;
  [[nodiscard]] std::optional<Notice> turned(State state);

  std::string path_;
  int fd_ = -1;
  State state_ = State::absent, told_ = State::asked;
  std::optional<Clock::time_point> began_;
  Clock::time_point next_try_{};
};

}  // namespace kerf
