// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <string>
#include <vector>

#include "controller/device/driver/device_driver.hpp"
#include "controller/shell/controller_options.hpp"
#include "controller/shell/run_report.hpp"
#include "controller/shell/servo_loop.hpp"
#include "shared/segment/hand_over.hpp"
#include "shared/segment/writer.hpp"
#include "shared/wire/personality.hpp"

namespace kerf {

/// What the threads of a run share.
struct Run {
  const ControllerOptions& options;
  const std::string& port;  ///< as `--port` names it, `auto` resolved
  Personality personality;
  int rate_hz;
  SegmentWriter& segment;
  SegmentServer& server;
  Servo& servo;
  DeviceDriver& device;
  std::atomic<bool>& stop;
  RunReport& report;
};

/// Runs servo, watchdog and progress bar until the run is over; the motors are off afterwards. Main
/// thread. Throws what the servo thread threw, as where --strict misses a right.
[[nodiscard]] EndReason run_threads(const Run& run);

/// Warns of each missing right, or refuses under --strict.
void accept_rights(const std::vector<MissingRight>& missing, bool strict);

}  // namespace kerf
