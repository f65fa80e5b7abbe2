// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tests/studies/bridge/two_machines.hpp"
#include "tests/studies/bridge/volume_source.hpp"

namespace kerf::two_machines {

/// One row of the table: a link, a load, and the goals of the bridge for them.
struct Case {
  std::string name;
  LinkSettings link;
  Load load = Load::slow;
  std::int32_t layers = 21;  ///< of 1024 bricks
  bool dedicated_link = false;
  double join_goal_s = 0;  ///< 0: none
  double age_goal_ms = 0;  ///< of p99; 0: none
};

struct CaseResult {
  bool equal = false;  ///< in the end both segments had the same content
  double join_s = 0;   ///< from the start of the program to the first whole picture
  double age_p50_ms = 0, age_p99_ms = 0, age_max_ms = 0;
  double near_p99_ms = 0;  ///< of the near segment itself, by the same look: this machine's share
  double link_mbit = 0;    ///< that came out at the far end while ages were taken
  double serve_cpu_percent = 0, join_cpu_percent = 0;
  double serve_mib = 0, join_mib = 0;
};

/// The table, or two rows of it in a small volume.
[[nodiscard]] std::vector<Case> table_cases();
[[nodiscard]] std::vector<Case> quick_cases();

/// Joins over the case's link, measures for `seconds`, then stops milling and compares.
[[nodiscard]] CaseResult run_case(const Case& what, const BridgeFiles& files, double seconds);

/// Sudden ends of either side while the volume is milled, one after the other.
struct KillResult {
  int kills = 0;
  int equal = 0;         ///< times that the far volume was the near one's within 2 s
  double slowest_s = 0;  ///< of them
};
enum class Killed { serve, join, cable, interface };
/// `cable`: pulled for 3 s instead; `interface`: down for 3 s, of each machine by turns.
[[nodiscard]] KillResult run_kills(const BridgeFiles& files, Killed side, int times,
                                   std::int32_t layers, std::uint64_t seed);

/// Two viewers, one of them stopped for `seconds`.
struct StoppedResult {
  double other_p99_ms = 0, other_max_ms = 0;  ///< age at the other one meanwhile
  bool equal = false;                         ///< the stopped one within 2 s of going on
};
[[nodiscard]] StoppedResult run_stopped(const BridgeFiles& files, double seconds,
                                        std::int32_t layers);

/// What publishing a tick costs the servo, in pairs of runs without and with a bridge and a viewer.
struct PublishResult {
  /// Of one figure over the runs, us.
  struct Spread {
    double least = 0, median = 0, most = 0;
  };
  int pairs = 0;   ///< of runs; fewer than requested if a viewer did not join
  int slower = 0;  ///< of them, in which p99 was larger with the bridge
  Spread alone_p50, alone_p99, bridged_p50, bridged_p99;
};
[[nodiscard]] PublishResult run_publish(const BridgeFiles& files, double seconds, int pairs,
                                        std::int32_t layers);

/// Many viewers at once.
struct CrowdResult {
  int viewers = 0, equal = 0;
  double worst_p99_ms = 0;
  double serve_cpu_percent = 0, serve_mib = 0;  ///< all viewers together
};
[[nodiscard]] CrowdResult run_crowd(const BridgeFiles& files, int viewers, double seconds,
                                    std::int32_t layers);

}  // namespace kerf::two_machines
