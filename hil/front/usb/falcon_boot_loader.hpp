// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>

#include "shared/wire/falcon_usb.hpp"

namespace kerf {

/// The signal processor behind a Falcon's FTDI chip before its firmware runs: it answers a
/// greeting, then echoes every byte that it stores. It starts the firmware when the host turns to
/// the baud rate of packets. One thread.
class FalconBootLoader {
 public:
  /// `wrong_echo_at`: fault, the n-th byte of the firmware (from 0) comes back wrong; -1: none.
  explicit FalconBootLoader(bool firmware_runs, std::int64_t wrong_echo_at = -1)
      : state_(firmware_runs ? State::running : State::asleep), wrong_echo_at_(wrong_echo_at) {}

  [[nodiscard]] bool running() const noexcept { return state_ == State::running; }
  /// Bytes of firmware that were taken.
  [[nodiscard]] std::int64_t stored() const noexcept { return stored_; }

  void set_divisor(std::uint16_t divisor) noexcept;
  /// A rising edge begins the greeting anew; of a processor that runs its firmware, only at the
  /// boot loader's baud rate: hosts load firmware without asking whether it is there.
  void set_dtr(bool high) noexcept;
  /// A byte of the host; answers go to `line`.
  void take(std::uint8_t byte, std::deque<std::uint8_t>& line);

 private:
  enum class State : std::uint8_t { asleep, greeting, waiting, loading, running };

  void hear_greeting(std::uint8_t byte, std::deque<std::uint8_t>& line);

  State state_;
  std::int64_t wrong_echo_at_;
  std::int64_t stored_ = 0;
  std::size_t greeted_ = 0;  ///< bytes of the greeting that were right
  std::uint16_t divisor_ = 0;
  bool dtr_ = false;
};

}  // namespace kerf
