// SPDX-License-Identifier: Apache-2.0
#include "shared/posix/stop_signals.hpp"

#include <csignal>

namespace kerf {
namespace {

std::atomic<bool> stop_asked{false};  // a signal handler can reach nothing but globals
static_assert(std::atomic<bool>::is_always_lock_free);

void ask_to_stop(int) {
  stop_asked.store(true);
}

void on(int signal, void (*handler)(int)) noexcept {
  struct sigaction action {};
  action.sa_flags = SA_RESTART;
  action.sa_handler = handler;
  sigaction(signal, &action, nullptr);
}

}  // namespace

std::atomic<bool>& catch_stop_signals() noexcept {
  for (const int signal : {SIGINT, SIGTERM}) on(signal, ask_to_stop);
  struct sigaction hang_up {};
  sigaction(SIGHUP, nullptr, &hang_up);
  if (hang_up.sa_handler != SIG_IGN) on(SIGHUP, ask_to_stop);
  make_signals_of_writes_errors();
  return stop_asked;
}

std::atomic<bool>& catch_stop_and_pause_signals() noexcept {
  for (const int signal : {SIGTSTP, SIGTTIN, SIGTTOU}) on(signal, ask_to_stop);
  return catch_stop_signals();
}

void make_signals_of_writes_errors() noexcept {
  for (const int signal : {SIGPIPE, SIGXFSZ}) on(signal, SIG_IGN);
}

bool stop_requested() noexcept {
  return stop_asked.load();
}

}  // namespace kerf
