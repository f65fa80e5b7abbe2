// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "controller/device/port/packet_port.hpp"
#include "controller/loop/real_time.hpp"
#include "controller/loop/servo_loop.hpp"

namespace kerf {

/// Score of one material since the last reset of the volumes.
struct MaterialScore {
  std::string name;
  double removed_mm3 = 0;
  std::optional<double> forbidden_ms{};  ///< of touch; empty if it may be cut
};
using MaterialScores = std::vector<MaterialScore>;

/// What a report has of each arm, beside its record.
struct ArmReport {
  std::string device;
  std::string tool;    ///< at the start of the run
  double tool_mm = 0;  ///< its width
  std::uint64_t lost_packets = 0;
  std::uint64_t refused_packets = 0;
  std::vector<LinkCounter> link;  ///< of the port
};

/// The figures of a run. Inherits those of the first arm.
struct RunReport : ArmReport {
  RunRecord record;
  std::string end;      ///< why the run ended
  std::string waiting;  ///< the event that the run waited for at its end; may be empty
  std::string scene;
  std::string numeric;
  std::string velocity_estimator;
  int rate_hz = 1000;
  bool virtual_time = false;
  bool allocations_counted = true;
  bool guarded = false;         ///< --guard
  std::string unexpected_call;  ///< that it blocked; empty if none
  std::vector<MissingRight> missing_rights;
  double removed_mm3 = 0;          ///< solid that is gone (`solid_gone`)
  double removed_density_mm3 = 0;  ///< density that was taken away, over full density
  MaterialScores materials;        ///< in the scene's order
  double workspace_scale = 1;
  std::optional<ArmReport> second;
  std::uint64_t watchdog_trips = 0;
  std::uint64_t volume_hash = 0;
  std::uint64_t config_hash = 0;
  double load_s = 0;                        ///< from start to the first servo tick
  std::optional<double> start_to_force_ms;  ///< from start to the first sent force
};

/// All figures as JSON text; ends with a newline.
[[nodiscard]] std::string report_json(const RunReport& report);

/// The figures for a person, on one screen.
[[nodiscard]] std::string summary(const RunReport& report);

}  // namespace kerf
