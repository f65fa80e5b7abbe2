// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <csignal>
#include <cstdint>
#include <string>
#include <thread>

#include "arm/arm_error.hpp"
#include "arm/exchange.hpp"
#include "shared/arm/arm_page.hpp"

namespace kerf {

/// How the lines of an `Overseer` name what it watches, and end.
struct WatchWords {
  const char* watched = "the vendor's library";
  const char* crashed = "the vendor's library, or kerf-arm in it,";
  const char* opening_cure = "; unplug it and plug it in again";
  const char* cure = kUnplug;
};

/// Watches a device's part of the program, which may hang or crash, from a separate thread: a
/// vendor's library, or the turns with a service.
///
/// Ends the program with one line on standard error, exit code 2 and the page's state `failed` if
///
///     the device does not open within `opening_ms`, or kMostClosingMs after a signal to end
///     the device does not close within kMostClosingMs
///     any thread crashes
///     the library calls exit() or quick_exit()
///
/// If frames stop for `stall_ms`, fails the exchange; the main thread then closes the device.
/// Time is counted in periods of this thread, kLookMs long, so that a machine that was
/// suspended is not taken for a library that hangs.
///
/// A library may set, ignore or block the signals by which a user ends the program
/// (`ends_of_user`). So they are blocked in the calling thread and in all that come later, and this
/// thread takes them by sigwait: no handler, SIG_IGN or mask of the library matters then. For a
/// thread that unblocks them the handlers are kerf's again in each period, those of a crash too.
/// No end here stops the device: no call of a library that has crashed or exits is safe, and the
/// last message to a service is said by the guard, when nothing of this process can follow it.
///
/// What no handler sees (_exit() in the library, a stack overflow in a thread without
/// `give_crash_stack`, a crash within a period of a handler that was reset) is left to
/// `run_guarded`.
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
  /// `program`: the first word of each line.
  Overseer(const char* program, ArmPageAdapter& page, ArmExchange& exchange, Limits limits,
           WatchWords words = {});
  ~Overseer();
  Overseer(const Overseer&) = delete;
  Overseer& operator=(const Overseer&) = delete;

  /// Gives the calling thread an alternate stack for the crash handler, which then runs after a
  /// stack overflow too. Does nothing if the thread has one, or after its first call, so it may be
  /// called in each frame. The constructor calls it for its own thread. At most kMostCrashStacks
  /// threads get one. Neither allocates nor throws.
  static void give_crash_stack() noexcept;
  static constexpr int kMostCrashStacks = 8;

  /// What the main thread does next. `frames`: the vendor's thread runs; `over`: the library is no
  /// longer called.
  enum class Phase : std::uint8_t { opening, frames, closing, over };
  void enter(Phase phase) noexcept;
  /// The failure that led to closing; the line about a hang while closing begins with it.
  void set_reason(const std::string& reason);

 private:
  void watch();
  void take_signals() noexcept;
  void look_at_frames();
  [[noreturn]] void end(const char* what);

  const char* program_;
  WatchWords words_;
  ArmPageAdapter& page_;
  ArmExchange& exchange_;
  Limits limits_;
  sigset_t ends_, before_{};  ///< signals; mask of the thread that made this
  std::string reason_;        ///< set before the phase `closing`
  std::atomic<Phase> phase_{Phase::opening};
  std::atomic<int> looks_{0};  ///< periods in this phase
  std::uint64_t last_frames_ = 0;
  int still_looks_ = 0;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace kerf
