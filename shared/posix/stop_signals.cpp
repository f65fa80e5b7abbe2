// SPDX-License-Identifier: Apache-2.0
#include "shared/posix/stop_signals.hpp"

#include <array>
#include <cerrno>
#include <csignal>

namespace kerf {
namespace {

// A signal handler can reach nothing but globals.
std::atomic<bool> stop_asked{false};
std::atomic<void (*)() noexcept> first_act{nullptr};
static_assert(std::atomic<bool>::is_always_lock_free);
static_assert(std::atomic<void (*)() noexcept>::is_always_lock_free);

constexpr std::array kAsks{SIGINT,    SIGTERM, SIGHUP, SIGALRM, SIGUSR1,   SIGUSR2,
                           SIGVTALRM, SIGPROF, SIGIO,  SIGPWR,  SIGSTKFLT, SIGXCPU};
constexpr std::array kCrashes{SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGSYS, SIGTRAP, SIGQUIT};

void ask_to_stop(int) {
  const int error = errno;  // of the call that the signal met
  if (const auto act = first_act.load()) act();
  stop_asked.store(true);
  errno = error;
}

void on(int signal, void (*handler)(int)) noexcept {
  struct sigaction action {};
  action.sa_flags = SA_RESTART;
  action.sa_handler = handler;
  sigaction(signal, &action, nullptr);
}

void let_ask(int signal) noexcept {
  struct sigaction before {};
  sigaction(signal, nullptr, &before);
  const bool overrides = signal == SIGINT || signal == SIGTERM;
  if (overrides || before.sa_handler != SIG_IGN) on(signal, ask_to_stop);
}

}  // namespace

std::atomic<bool>& catch_stop_signals() noexcept {
  for (const int signal : kAsks) let_ask(signal);
  for (int signal = SIGRTMIN; signal <= SIGRTMAX; ++signal) let_ask(signal);
  make_signals_of_writes_errors();
  // Who started this program may have blocked them, and only SIGKILL would end it.
  const sigset_t asking = asking_signals();
  pthread_sigmask(SIG_UNBLOCK, &asking, nullptr);
  return stop_asked;
}

std::atomic<bool>& catch_stop_and_pause_signals() noexcept {
  for (const int signal : {SIGTSTP, SIGTTIN, SIGTTOU}) on(signal, ask_to_stop);
  return catch_stop_signals();
}

void make_signals_of_writes_errors() noexcept {
  for (const int signal : {SIGPIPE, SIGXFSZ}) on(signal, SIG_IGN);
}

void ask_by(int signal) noexcept {
  on(signal, ask_to_stop);
}

bool stop_requested() noexcept {
  return stop_asked.load();
}

void request_stop() noexcept {
  ask_to_stop(0);
}

sigset_t asking_signals() noexcept {
  sigset_t asking;
  sigemptyset(&asking);
  for (const int signal : kAsks) sigaddset(&asking, signal);
  for (int signal = SIGRTMIN; signal <= SIGRTMAX; ++signal) sigaddset(&asking, signal);
  return asking;
}

sigset_t ends_of_user() noexcept {
  sigset_t ends;
  sigemptyset(&ends);
  for (const int signal : {SIGINT, SIGTERM, SIGQUIT, SIGTSTP}) sigaddset(&ends, signal);
  struct sigaction hup {};
  sigaction(SIGHUP, nullptr, &hup);
  if (hup.sa_handler != SIG_IGN) sigaddset(&ends, SIGHUP);
  return ends;
}

void at_stop_signal(void (*act)() noexcept) noexcept {
  first_act.store(act);
}

BlockStopSignals::BlockStopSignals() noexcept {
  sigset_t asking = asking_signals();
  for (const int signal : {SIGQUIT, SIGABRT})
    sigaddset(&asking, signal);  // abort() unblocks its own
  pthread_sigmask(SIG_BLOCK, &asking, &before_);
}

BlockStopSignals::~BlockStopSignals() {
  pthread_sigmask(SIG_SETMASK, &before_, nullptr);
}

void block_signals() noexcept {
  sigset_t all;
  sigfillset(&all);
  for (const int crash : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGSYS, SIGTRAP}) sigdelset(&all, crash);
  pthread_sigmask(SIG_BLOCK, &all, nullptr);
}

std::span<const int> crash_signals() noexcept {
  return kCrashes;
}

}  // namespace kerf
