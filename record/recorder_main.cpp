// SPDX-License-Identifier: Apache-2.0
#include <exception>
#include <iostream>

#include "record/recorder_run.hpp"
#include "shared/posix/stop_signals.hpp"

int main(int argc, char** argv) {
  try {
    kerf::RecorderOptions options;
    if (!kerf::parse_options(argc, argv, options)) return 0;
    return kerf::run_recorder(options, kerf::catch_stop_signals());
  } catch (const std::exception& error) {
    std::cerr << "kerf-recorder: " << error.what() << '\n';
    return 2;
  }
}
