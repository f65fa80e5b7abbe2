// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <cstdio>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>

#include <unistd.h>

#include "controller/servo/servo.hpp"
#include "shared/text/text.hpp"
#include "shared/wire/personality.hpp"

// Log lines of the controller, and what the device waits for.

namespace kerf {

/// One line of kerf-controller on the standard error; its level has a colour on a terminal.
inline void log_line(const char* level, const char* colour, const std::string& text) {
  const bool terminal = isatty(STDERR_FILENO) == 1;
  std::fprintf(stderr, "kerf-controller: %s%s%s: %s\n", terminal ? colour : "", level,
               terminal ? "\033[m" : "", escaped(text).c_str());
}
/// A line without a level.
inline void log_note(const std::string& text) {
  std::fprintf(stderr, "kerf-controller: %s\n", escaped(text).c_str());
}
inline void log_warning(const std::string& text) {
  log_line("warning", "\033[33m\033[1m", text);
}
inline void log_error(const std::string& text) {
  log_line("error", "\033[31m\033[1m", text);
}

/// Logs once what a program waits for, if the object lives longer than a second. Not for the servo
/// thread: it starts a thread of its own.
class LateNote {
 public:
  static constexpr std::chrono::seconds kPatience{1};

  explicit LateNote(std::string note)
      : thread_([text = std::move(note)](const std::stop_token& over) {
          std::mutex mutex;
          std::unique_lock lock(mutex);
          std::condition_variable_any wake;
          wake.wait_for(lock, over, kPatience, [] { return false; });
          if (!over.stop_requested()) log_note(text);
        }) {}

 private:
  std::jthread thread_;
};

/// The next step of a device without force, in the order of a start.
enum class Waiting : std::uint8_t {
  nothing,  ///< its force is on
  report,   ///< its first report
  homing,   ///< its encoders have no meaning yet
  parked,   ///< not parked yet, or after a fault
  rest,     ///< parked, but it moves
  hand,     ///< calibrated and parked: the user has to take it
  gone      ///< it says nothing any more, and another arm goes on
};

/// The state after a tick. Bounded, no clock: for the servo thread.
[[nodiscard]] Waiting waiting_for(const DeviceReport& report, const ServoOutput& output) noexcept;

/// The action of the user, such as "rest the stylus in the inkwell"; empty for `nothing`.
[[nodiscard]] const char* action_for(Personality personality, Waiting waiting) noexcept;

/// Both on one line, such as "waiting until parked: rest the stylus in the inkwell".
[[nodiscard]] std::string text_of(Personality personality, Waiting waiting);

/// The text while the device at `port` has not answered yet.
[[nodiscard]] std::string text_before_device(const std::string& port);

/// Prints the line of a program that a signal ended during `work`, before there was a device.
void tell_stopped_early(const std::string& work);

/// Decides when a wait is worth a line: after a second, by the clock and in ticks, and each kind
/// once until the force comes on. In lock-step, ticks may wait for pictures or for a busy machine,
/// which no user can change. One thread.
class WaitNotice {
 public:
  /// Call several times a second. Returns whether to report `now`. `servo_ns`: ticks so far, as
  /// time.
  [[nodiscard]] bool look(Waiting now, std::int64_t now_ns, std::int64_t servo_ns) noexcept;

 private:
  Waiting last_ = Waiting::nothing;
  std::int64_t since_ns_ = 0;
  std::int64_t since_servo_ns_ = 0;
  std::uint32_t told_ = 0;  ///< one bit for each kind
};

}  // namespace kerf
