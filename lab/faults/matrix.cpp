// SPDX-License-Identifier: Apache-2.0
#include "lab/faults/matrix.hpp"

#include <algorithm>
#include <cstdio>

#include "controller/servo/servo_output.hpp"

namespace kerf::faults {
namespace {

/// The larger figure of each kind; counts add up.
void take_worst(const Outcome& from, Outcome& worst) {
  const auto larger = [](double value, double& into) { into = std::max(into, value); };
  larger(from.latch_ms, worst.latch_ms);
  larger(from.peak_n, worst.peak_n);
  larger(from.device_peak_n, worst.device_peak_n);
  larger(from.steepest_n_per_ms, worst.steepest_n_per_ms);
  larger(from.rms_n, worst.rms_n);
  larger(from.longest_alone_ms, worst.longest_alone_ms);
  larger(from.slowest_off_ms, worst.slowest_off_ms);
  worst.violation_count += from.violation_count;
  worst.faults_begun += from.faults_begun;
  if (worst.violations.empty()) worst.violations = from.violations;
}

Json figures_of(const Outcome& worst) {
  return {{"peak_n", worst.peak_n},
          {"device_peak_n", worst.device_peak_n},
          {"steepest_n_per_ms", worst.steepest_n_per_ms},
          {"rms_n", worst.rms_n},
          {"longest_alone_ms", worst.longest_alone_ms},
          {"slowest_off_ms", worst.slowest_off_ms}};
}

}  // namespace

bool concerns(const NamedScript& named, const Cell& cell) {
  if (!named.script || named.script->faults.empty()) return true;
  return std::ranges::any_of(named.script->faults, [&](const DeviceFault& fault) {
    return concerns(fault.kind, cell.scene.device.personality);
  });
}

Row run_row(const Cell& cell, const NamedScript& named, std::uint32_t seed_base, unsigned seeds) {
  Row row;
  row.device = cell.device;
  row.model = cell.model;
  row.numeric = cell.numeric;
  row.script = named.name;
  row.rate_hz = cell.scene.servo.rate_hz;
  for (std::uint32_t seed = seed_base; seed - seed_base < seeds; ++seed) {
    FaultScript script = named.script ? *named.script : random_faults(seed);
    script.seed = seed;
    row.latches = script.latches;
    Outcome outcome = run_faults({.scene = cell.scene, .hand = cell.hand}, script);
    const std::string name = "seed " + std::to_string(seed) + ": ";
    if (!outcome.vacuous.empty()) row.vacuous.push_back(name + outcome.vacuous);
    for (std::string& line : outcome.violations) line.insert(0, name);
    ++row.runs;
    row.pushed_again += outcome.pushed_again ? 1 : 0;
    row.latched += outcome.latched != fault_name(Fault::none) ? 1 : 0;
    take_worst(outcome, row.worst);
  }
  return row;
}

std::string table_head() {
  return "device        rate Hz model numbers script             runs  faults latched latch ms on "
         "again"
         "  peak N   tip N    N/ms  RMS N alone ms off ms vacuous broken";
}

std::string line_of(const Row& row) {
  char text[240];
  std::snprintf(text, sizeof text,
                "%-13s %7d %-5s %-7s %-18s %4u %7llu %7u %8.2f %8u %7.2f %7.2f %7.3f %6.3f %8.2f "
                "%6.2f %7zu %6llu",
                row.device.c_str(), row.rate_hz, row.model.c_str(), row.numeric.c_str(),
                row.script.c_str(), row.runs,
                static_cast<unsigned long long>(row.worst.faults_begun), row.latched,
                row.worst.latch_ms, row.pushed_again, row.worst.peak_n, row.worst.device_peak_n,
                row.worst.steepest_n_per_ms, row.worst.rms_n, row.worst.longest_alone_ms,
                row.worst.slowest_off_ms, row.vacuous.size(),
                static_cast<unsigned long long>(row.worst.violation_count));
  return text;
}

Json json_of(const Row& row) {
  return {{"device", row.device},
          {"rate_hz", row.rate_hz},
          {"model", row.model},
          {"numeric", row.numeric},
          {"script", row.script},
          {"runs", row.runs},
          {"faults", row.worst.faults_begun},
          {"runs_latched", row.latched},
          {"slowest_latch_ms", row.worst.latch_ms},
          {"runs_pushed_again", row.pushed_again},
          {"worst", figures_of(row.worst)},
          {"vacuous", row.vacuous},
          {"violations", row.worst.violation_count},
          {"first_violations", row.worst.violations}};
}

void Summary::add(const Row& row) {
  runs_ += row.runs;
  vacuous_ += row.vacuous.size();
  broken_ += row.worst.violation_count;
  take_worst(row.worst, worst_);
  if (row.latches.empty() || row.latches == fault_name(Fault::none)) return;
  double& latch_ms = latch_ms_[row.latches];
  latch_ms = std::max(latch_ms, row.worst.latch_ms);
}

std::string Summary::text() const {
  char text[200];
  std::snprintf(
      text, sizeof text,
      "%llu runs, %llu show nothing, %llu rules broken. Worst: %.3f N, %.3f N/ms, RMS %.3f "
      "N, alone %.2f ms, off %.2f ms",
      static_cast<unsigned long long>(runs_), static_cast<unsigned long long>(vacuous_),
      static_cast<unsigned long long>(broken_), worst_.peak_n, worst_.steepest_n_per_ms,
      worst_.rms_n, worst_.longest_alone_ms, worst_.slowest_off_ms);
  std::string all = text;
  for (const auto& [name, latch_ms] : latch_ms_) {
    std::snprintf(text, sizeof text, ", %s %.2f ms", name.c_str(), latch_ms);
    all += text;
  }
  return all;
}

Json Summary::json() const {
  Json latches = Json::List{};
  for (const auto& [name, ms] : latch_ms_) latches.push_back(Json{{"fault", name}, {"ms", ms}});
  return {{"runs", runs_},
          {"vacuous", vacuous_},
          {"violations", broken_},
          {"worst", figures_of(worst_)},
          {"slowest_latches", latches}};
}

}  // namespace kerf::faults
