// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include <sys/types.h>

#include "shared/segment/layout.hpp"

namespace kerf {

/// What a tool does, as far as it is heard.
struct ToolSound {
  float turns_per_s = 0;  ///< of the spindle, 0 or more
  float load = 0;         ///< its torque over the stall torque, 0 to 1
  float contact = 0;      ///< how hard the tool rubs, over what the device can press, 0 to 1
};

/// The sound of a spindle and its bur, from numbers to samples (docs/window.md).
///
/// Two tones and a noise. The spindle hums once a turn; its blades strike `kBlades` times a turn,
/// the harder the more it is loaded; what rubs hisses. All three glide to a new `ToolSound` within
/// `kGlideS`, so a step of it is no click. The samples are a function of all inputs since the
/// start, and of nothing else. Nothing is heard of what rests.
class SpindleVoice {
 public:
  static constexpr double kSamplesPerS = 48'000;
  /// Chosen: carbide burs have 6 to 8 blades as a rule, and a scene does not name the number.
  static constexpr int kBlades = 8;
  static constexpr double kGlideS = 0.01;  ///< a frame of the window, rounded down
  /// A tone fades between these, so that none comes near to half of `kSamplesPerS`, beyond which
  /// it would be heard as a lower one.
  static constexpr double kFadesFromHz = 12'000, kSilentFromHz = 16'000;

  // Chosen: amplitudes of 1 as the loudest. Together they stay below it, so nothing is clipped.
  static constexpr double kHum = 0.05;        ///< of a spindle that turns freely, at full speed
  static constexpr double kHumOfLoad = 0.10;  ///< more, at full load
  static constexpr double kBladesOfLoad = 0.25;
  static constexpr double kHiss = 0.30;  ///< at full contact

  /// The next samples, each within -1 to 1; no number in `now` is NaN, and what is out of its range
  /// counts as the end of it.
  void render(const ToolSound& now, std::span<float> samples) noexcept;

 private:
  double turn_ = 0;  ///< of the spindle, 0 to 1
  double turns_per_s_ = 0, load_ = 0, contact_ = 0;
  double hiss_ = 0;
  std::uint32_t dice_ = 1;
};

/// What is heard of a tick. A spindle that turns, or a tool that is drawn over a surface, rubs; a
/// tool that rests on one makes no sound, however hard it presses. What a record does not know
/// (NaN) is not heard.
[[nodiscard]] ToolSound tool_sound(const TickRecord& record);

/// A window's end of what plays its sound: a process of its own, so that an audio library that
/// hangs or falls takes no picture with it. Never waits but in the destructor, 0.2 s at most. One
/// thread.
class SoundLink {
 public:
  /// Before any other thread exists: the process is a copy of this one. Where the system has none
  /// left, `heard` reports it.
  SoundLink();
  SoundLink(const SoundLink&) = delete;
  SoundLink& operator=(const SoundLink&) = delete;
  ~SoundLink();

  /// What is to be heard from now on. What a player that is late has not taken is dropped.
  void send(const ToolSound& sound, bool mute) noexcept;
  /// Why nothing can be heard, once.
  [[nodiscard]] std::optional<std::string> heard();

 private:
  void end() noexcept;

  int socket_ = -1;
  pid_t player_ = -1;
  bool told_ = false;
};

}  // namespace kerf
