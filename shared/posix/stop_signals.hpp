// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <csignal>
#include <span>

namespace kerf {

// The signals that end a process by default, and how every program of kerf handles them:
//
//   ask for an end in order   INT, TERM, HUP, ALRM, USR1, USR2, VTALRM, PROF, IO, PWR, STKFLT, XCPU
//                             and all real-time signals
//   crash                     SEGV, BUS, FPE, ILL, ABRT, SYS, TRAP, and QUIT, which ends a program
//                             that no longer reacts to the others
//   become errors of a write  PIPE, XFSZ
//   out of reach              KILL; and STOP, which ends nothing
//
// 32 and 33 belong to the C library.

/// From now on the signals that ask for an end only set the returned flag, and SIGPIPE and SIGXFSZ
/// become errors of the write. Signals that were ignored (nohup) stay ignored, except INT and TERM.
/// Unblocks these signals; interrupted calls restart.
///
/// Main thread, once per process; stays for the rest of it.
std::atomic<bool>& catch_stop_signals() noexcept;

/// Catches SIGTSTP, SIGTTIN and SIGTTOU, too, as requests to end: for a program that must not be
/// paused.
std::atomic<bool>& catch_stop_and_pause_signals() noexcept;

/// SIGPIPE and SIGXFSZ become errors of the write that met them: for a program that any other
/// signal may end at once.
void make_signals_of_writes_errors() noexcept;

/// `signal` asks for the end from now on, whatever its handler was. Any thread.
void ask_by(int signal) noexcept;

/// Whether a signal asked for the end.
[[nodiscard]] bool stop_requested() noexcept;
/// Asks for the end as such a signal does, for a thread that takes signals by sigwait. Any thread.
void request_stop() noexcept;

/// The signals of the first kind.
[[nodiscard]] sigset_t asking_signals() noexcept;
/// INT, TERM, HUP, QUIT and TSTP: those by which a user ends a program that must not be paused. HUP
/// only if it is not ignored now (nohup).
[[nodiscard]] sigset_t ends_of_user() noexcept;

/// Calls `act` first thing in the handler of every signal that asks for the end; nullptr: nothing.
/// It may do only what a signal handler may, and must not wait.
void at_stop_signal(void (*act)() noexcept) noexcept;

/// While one of these lives the calling thread leaves signals that ask for the end, and QUIT and
/// ABRT from outside, to the others, so that those with a right to real time hear of them on a busy
/// machine too. The other crashes belong to the thread that met them.
class BlockStopSignals {
 public:
  BlockStopSignals() noexcept;
  ~BlockStopSignals();
  BlockStopSignals(const BlockStopSignals&) = delete;
  BlockStopSignals& operator=(const BlockStopSignals&) = delete;

 private:
  sigset_t before_;
};

/// First thing in a thread whose system calls no signal may cut short: from now on it hears of
/// crashes alone.
void block_signals() noexcept;

/// The signals of the second kind, for code that must act before their default action.
[[nodiscard]] std::span<const int> crash_signals() noexcept;

}  // namespace kerf
