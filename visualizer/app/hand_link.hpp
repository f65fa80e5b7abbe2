// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "shared/wire/hand_wish.hpp"
#include "visualizer/app/window_figures.hpp"

namespace kerf {

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
  /// The wish of this frame; nothing happens while the hand is not this window's.
  void send(const HandWish& wish) noexcept;

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
