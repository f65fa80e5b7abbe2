// SPDX-License-Identifier: Apache-2.0
#include "record/run/flight_recorder.hpp"
#include "record/run/recorder_options.hpp"
#include "record/run/recorder_run.hpp"
#include "shared/posix/program.hpp"
#include "shared/posix/stop_signals.hpp"

int main(int argc, char** argv) {
  return kerf::run_program("kerf-recorder", [&] {
    kerf::RecorderOptions options;
    if (!kerf::parse_options(argc, argv, options)) return 0;
    const std::atomic<bool>& stop = kerf::catch_stop_signals();
    return options.flight_s > 0 ? kerf::run_flight_recorder(options, stop)
                                : kerf::run_recorder(options, stop);
  });
}
