// SPDX-License-Identifier: Apache-2.0
#include <iostream>

#include "record/recorder_run.hpp"
#include "shared/posix/failure.hpp"
#include "shared/posix/private_files.hpp"
#include "shared/posix/stop_signals.hpp"

int main(int argc, char** argv) {
  kerf::keep_files_private();
  try {
    kerf::RecorderOptions options;
    if (!kerf::parse_options(argc, argv, options)) return 0;
    return kerf::run_recorder(options, kerf::catch_stop_signals());
  } catch (...) {
    std::cerr << "kerf-recorder: " << kerf::failure_text() << '\n';
    return 2;
  }
}
