// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include <sys/types.h>

#include "visualizer/sound/spindle_sound.hpp"

namespace kerf {

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
