// SPDX-License-Identifier: Apache-2.0
#include "hil/program/run_report.hpp"

#include <array>
#include <cstddef>
#include <vector>

#include "shared/posix/hex64.hpp"
#include "shared/posix/new_file.hpp"
#include "shared/posix/run_files.hpp"
#include "shared/text/json.hpp"

namespace kerf {
namespace {

double seconds_of(std::int64_t cycles) {
  return static_cast<double>(cycles) / kCyclesPerSecond;
}

/// What the fault script did, one by one: a report of the run counts it, and its log is read by it.
Json injected_list(const std::vector<InjectedFault>& faults) {
  Json list = Json::List{};
  for (const InjectedFault& fault : faults) {
    list.push_back({{"kind", kFaultWords[static_cast<std::size_t>(fault.kind)]},
                    {"packets", fault.of_commands ? "commands" : "reports"},
                    {"at_s", seconds_of(fault.at_cycle)},
                    {"changed", fault.changed}});
  }
  return list;
}

}  // namespace

void check_report(const EmulatorOptions& options) {
  check_outputs({options.hand, options.fault}, {{"--report", options.report, ".json"}});
}

void write_run_report(const std::string& file, const EmulatedDevice& device,
                      const FrontStats& front) {
  const EmulatorStats stats = device.stats();
  const DeviceModel& model = device.model();
  const DeviceVec<double> tip = model.tip_mm();
  Json report;
  report["personality"] = model.name();
  report["seconds"] = seconds_of(stats.cycles);
  report["packets_sent"] = front.sent;
  report["packets_dropped"] = front.dropped;
  report["packets_withheld"] = device.withheld();
  report["injected"] = injected_list(device.injected());
  report["commands_received"] = stats.commands;
  report["commands_refused"] = stats.refused;
  report["resyncs"] = front.resyncs;
  report["wake_us"] = {{"p50", front.wake.percentile_us(0.5)},
                       {"p99", front.wake.percentile_us(0.99)},
                       {"max", front.wake.max_us()}};
  report["peak_motor_force_n"] = stats.peak_motor_force_n;
  report["calibrated"] = model.calibration() == Calibration::done;
  report["docked"] = model.docked();
  report["undocked_at_s"] = stats.undocked_at ? Json(seconds_of(*stats.undocked_at)) : nullptr;
  report["final_tip_mm"] = std::array{tip.x, tip.y, tip.z};
  if (device.leader()) {
    report["wishes"] = device.leader()->wishes();
    report["wishes_refused"] = device.leader()->refused();
  }
  report["report_hash"] = hex64(stats.report_hash);

  write_new_file(file, report.document());
}

}  // namespace kerf
