// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <thread>

#include "arm/exchange.hpp"
#include "shared/arm/arm_page.hpp"

namespace kerf {

/// Watches, from a thread of its own, over a vendor's library that may hang or crash.
///
/// Time is counted in looks of this thread, kLookMs apart: a machine that stands still has no
/// library that hangs. A call that opens or closes the device and does not return ends the program
/// (after kMostClosingMs if a signal has asked for the end). So does a crash in any thread, and a
/// library that calls exit() or quick_exit(): one line on standard error, exit code 2, and the page
/// says `failed`. Frames that stop fail the exchange, and the program goes on to close the device.
/// Out of reach: _exit() in the library, and a stack overflow in a thread without
/// `give_crash_stack`, which end the program without a line.
///
/// At most one per process. The page and the exchange outlive it.
class Overseer {
 public:
  static constexpr int kLookMs = 10;
  static constexpr int kMostClosingMs = 2000;

  struct Limits {
    int opening_ms = 10'000;
    int stall_ms = 100;
  };

  /// `program`: what each line begins with.
  Overseer(const char* program, ArmPageAdapter& page, ArmExchange& exchange, Limits limits);
  ~Overseer();
  Overseer(const Overseer&) = delete;
  Overseer& operator=(const Overseer&) = delete;

  /// Gives the calling thread a stack for the handler of a crash, so that it runs after a stack
  /// overflow too, unless the thread has one. The constructor's thread has it; any other calls this
  /// once or in each frame: only the first call of a thread does anything. Of kMostCrashStacks
  /// threads in all. Neither allocates nor throws.
  static void give_crash_stack() noexcept;
  static constexpr int kMostCrashStacks = 8;

  /// What the main thread is about to do. `frames`: the vendor's thread runs; `over`: the library
  /// is not called any more.
  enum class Phase : std::uint8_t { opening, frames, closing, over };
  void enter(Phase phase) noexcept;
  /// What the line about a hang while closing says first: the failure that led there.
  void set_reason(const std::string& reason);

 private:
  void watch();
  void look_at_frames();
  [[noreturn]] void end(const char* text);

  const char* program_;
  ArmPageAdapter& page_;
  ArmExchange& exchange_;
  Limits limits_;
  std::string reason_;  ///< before the phase `closing`
  std::atomic<Phase> phase_{Phase::opening};
  std::atomic<int> looks_{0};  ///< in this phase
  std::uint64_t last_frames_ = 0;
  int still_looks_ = 0;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace kerf
