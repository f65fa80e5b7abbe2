// SPDX-License-Identifier: Apache-2.0
#include "visualizer/view/stop_signal.hpp"

#include <csignal>

namespace kerf {

namespace {

volatile std::sig_atomic_t g_stop = 0;

void on_signal(int /*signal*/) {
  g_stop = 1;
}

}  // namespace

void catch_stop_signals() {
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
}

bool stop_requested() noexcept {
  return g_stop != 0;
}

}  // namespace kerf
