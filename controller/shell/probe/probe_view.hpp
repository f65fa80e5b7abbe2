// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "controller/scene/scene.hpp"
#include "controller/servo/device_pose.hpp"
#include "controller/servo/device_report.hpp"
#include "controller/servo/supervisor.hpp"
#include "shared/numeric/numbers.hpp"

namespace kerf {

/// What a device has said so far: the servo's own following of encoders, pots and pose, in double,
/// without a servo. Steps and gaps are measured from one `take` to the next.
class ProbeView {
 public:
  /// `rate_hz`: how often `take` will be called.
  ProbeView(const DeviceSettings& device, int rate_hz);

  /// Once per tick; `now_ns` is the host's clock.
  void take(const DeviceReport& report, std::int64_t now_ns) noexcept;

  struct Seen {
    std::uint64_t ticks = 0;                          ///< since the first report
    std::uint64_t reports = 0;                        ///< ticks with a fresh one
    double longest_gap_ms = 0;                        ///< between fresh ones
    std::array<std::int32_t, 3> lowest{}, highest{};  ///< counts since the first report
    std::array<bool, 2> pressed{};                    ///< buttons, ever
    bool parked = false, homed = false;               ///< ever
    bool calibrated = false;                          ///< parked at rest, homed: the pose holds
  };
  [[nodiscard]] const Seen& seen() const noexcept { return seen_; }
  [[nodiscard]] const DeviceReport& last() const noexcept { return last_; }
  /// Frame of the device; without meaning until `calibrated`.
  [[nodiscard]] std::array<double, 3> tip_mm() const noexcept;

  /// The last report on one line of at most 100 characters.
  [[nodiscard]] std::string line() const;

 private:
  DevicePlan<DoubleNumbers> plan_;
  SafetyTiming timing_;
  EncoderState encoders_;
  std::array<std::int32_t, 3> travelled_{};  ///< counts since the first report, over the wrap
  DeviceReport last_;
  std::int64_t last_ns_ = 0;
  Seen seen_;
};

}  // namespace kerf
