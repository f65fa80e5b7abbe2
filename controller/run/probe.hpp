// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "controller/run/controller_options.hpp"
#include "controller/scene/scene.hpp"
#include "controller/servo/sense.hpp"
#include "controller/servo/servo.hpp"
#include "controller/servo/supervisor.hpp"
#include "shared/numeric/numbers.hpp"

// `--probe`: shows a device with its motors off.

namespace kerf {

/// Summary of the reports of a device so far: the servo's own processing of encoders, pots and
/// pose, in double, without a servo. Steps and gaps are measured from one `take` to the next.
class ProbeView {
 public:
  /// `rate_hz`: rate of the calls of `take`.
  ProbeView(const DeviceSettings& device, int rate_hz);

  /// Call once per tick; `now_ns` is the clock of the host.
  void take(const DeviceReport& report, std::int64_t now_ns) noexcept;

  struct Seen {
    std::uint64_t ticks = 0;                          ///< since the first report
    std::uint64_t reports = 0;                        ///< ticks with a fresh one
    double longest_gap_ms = 0;                        ///< between fresh ones
    std::array<std::int32_t, 3> lowest{}, highest{};  ///< counts since the first report
    std::array<bool, 2> pressed{};                    ///< buttons, ever
    bool parked = false, homed = false;               ///< ever
    bool calibrated = false;                          ///< parked at rest, homed: the pose is valid
  };
  [[nodiscard]] const Seen& seen() const noexcept { return seen_; }
  [[nodiscard]] const DeviceReport& last() const noexcept { return last_; }
  /// In the frame of the device; invalid until `calibrated`.
  [[nodiscard]] std::array<double, 3> tip_mm() const noexcept;

  /// The last report on one line of at most 100 characters.
  [[nodiscard]] std::string line() const;

 private:
  DevicePlan<DoubleNumbers> plan_;
  SafetyTiming timing_;
  EncoderState encoders_;
  std::array<std::int32_t, 3> travelled_{};  ///< counts since the first report, beyond the wrap
  DeviceReport last_;
  std::int64_t last_ns_ = 0;
  Seen seen_;
};

/// `kerf-controller --probe`: shows the reports of a device, with its motors always off.
///
/// With a port: opens it, prints the reports of the device once a second (on a terminal: one line,
/// ten times a second), until `seconds` or a signal; then lists what is missing and writes the
/// report. Without one: lists the connected devices, and what this user and machine lack.
///
/// Exit code: 0 success; 1 if a port was opened and no report came, or, without one, if the device
/// of --device is not connected. Throws std::exception with one line if the port cannot be opened.
[[nodiscard]] int run_probe(const ControllerOptions& options);

}  // namespace kerf
