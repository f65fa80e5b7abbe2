// SPDX-License-Identifier: Apache-2.0
#include <csignal>
#include <iostream>

#include <unistd.h>

#include "arm/run_arm.hpp"
#include "shared/posix/program.hpp"
#include "shared/posix/stop_signals.hpp"

int main(int argc, char** argv) {
  const int code = kerf::run_program("kerf-arm", [&] {
    const std::atomic<bool>& stop = kerf::catch_stop_and_pause_signals();
    // A device that is not closed properly may have to be unplugged, so QUIT requests the end as
    // the other signals do. If the library then does not return, the overseer ends the program.
    std::signal(SIGQUIT, [](int) { static_cast<void>(std::raise(SIGTERM)); });
    return kerf::run_arm(argc, argv, stop, std::cout, std::cerr);
  });
  // The vendor's library is loaded and may have running threads, so its exit handlers could crash.
  std::cout.flush();
  _exit(code);
}
