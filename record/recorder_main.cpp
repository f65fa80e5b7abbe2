// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <csignal>
#include <exception>
#include <iostream>

#include "record/session.hpp"

namespace {

std::atomic<bool> stop{false};
static_assert(std::atomic<bool>::is_always_lock_free);  // so a signal handler may store it

}  // namespace

int main(int argc, char** argv) {
  kerf::RecorderOptions options;
  if (const auto code = kerf::parse_options(argc, argv, options)) return *code;
  std::signal(SIGINT, [](int) { stop = true; });
  std::signal(SIGTERM, [](int) { stop = true; });
  std::signal(SIGXFSZ, SIG_IGN);  // a file size limit is an error of write, not a death
  try {
    return kerf::record_session(options, stop);
  } catch (const std::exception& error) {
    std::cerr << "kerf-recorder: " << error.what() << '\n';
    return 2;
  }
}
