// SPDX-License-Identifier: Apache-2.0
#include "controller/shell/stop_signals.hpp"

#include <csignal>

namespace kerf {
namespace {

std::atomic<bool> stop_asked{false};  // a signal handler can reach nothing but globals
static_assert(std::atomic<bool>::is_always_lock_free);

void ask_to_stop(int) {
  stop_asked.store(true);
}

}  // namespace

std::atomic<bool>& catch_stop_signals() noexcept {
  struct sigaction action {};
  action.sa_flags = SA_RESTART;
  action.sa_handler = ask_to_stop;
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGTSTP, SIGTTIN, SIGTTOU}) {
    sigaction(signal, &action, nullptr);
  }
  action.sa_handler = SIG_IGN;
  for (const int signal : {SIGPIPE, SIGXFSZ}) sigaction(signal, &action, nullptr);
  return stop_asked;
}

}  // namespace kerf
