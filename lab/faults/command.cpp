// SPDX-License-Identifier: Apache-2.0
#include "lab/faults/command.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <future>
#include <optional>
#include <ostream>
#include <thread>

#include "controller/load/scene_load.hpp"
#include "hil/devmodel/falcon_model.hpp"
#include "hil/devmodel/omni_model.hpp"
#include "hil/devmodel/wooden_model.hpp"
#include "hil/hil_error.hpp"
#include "hil/script/fault_script.hpp"
#include "hil/script/hand_script_file.hpp"
#include "lab/faults/fault_run.hpp"
#include "lab/rig/lab_run.hpp"
#include "shared/text/json.hpp"

namespace kerf::faults {
namespace {

/// A script under the name of its file; none: faults at random, other ones for each seed.
struct NamedScript {
  std::string name;
  std::optional<FaultScript> script;
};

/// A device, a script, all seeds.
struct Row {
  std::string device;
  std::string script;
  unsigned runs = 0;
  unsigned without_push = 0;  ///< runs in which nothing could go wrong
  unsigned pushed_again = 0;  ///< runs with force after the last fault
  unsigned latched = 0;       ///< runs in which the servo latched a fault
  Outcome worst;
};

/// Of the emulated unit.
std::array<double, 3> torque_scale_of(Personality personality) {
  switch (personality) {
    case Personality::falcon:
      return FalconParams().torque_scale();
    case Personality::woodenhaptics:
      return WoodenParams().torque_scale();
    case Personality::omni:
      break;
  }
  return OmniParams().torque_scale();
}

std::vector<NamedScript> scripts_in(const std::string& place) {
  std::vector<NamedScript> scripts;
  std::error_code error;
  if (std::filesystem::is_regular_file(place, error)) {
    scripts.push_back({std::filesystem::path(place).stem().string(), read_fault_script(place)});
    return scripts;
  }
  for (const auto& entry : std::filesystem::directory_iterator(place, error)) {
    if (entry.path().extension() != ".toml") continue;
    scripts.push_back({entry.path().stem().string(), read_fault_script(entry.path())});
  }
  if (scripts.empty()) {
    throw HilError("--scripts: " + place + ": no fault scripts there; name hil/faults or a file");
  }
  std::ranges::sort(scripts, {}, &NamedScript::name);
  return scripts;
}

void add(const Outcome& outcome, Row& row) {
  Outcome& worst = row.worst;
  ++row.runs;
  row.without_push += outcome.pushed ? 0 : 1;
  row.pushed_again += outcome.pushed_again ? 1 : 0;
  row.latched += outcome.latched != worst.latched ? 1 : 0;
  worst.latch_ms = std::max(worst.latch_ms, outcome.latch_ms);
  worst.violation_count += outcome.violation_count;
  if (worst.violations.empty()) worst.violations = outcome.violations;
  worst.faults_begun += outcome.faults_begun;
  worst.peak_n = std::max(worst.peak_n, outcome.peak_n);
  worst.device_peak_n = std::max(worst.device_peak_n, outcome.device_peak_n);
  worst.steepest_n_per_ms = std::max(worst.steepest_n_per_ms, outcome.steepest_n_per_ms);
  worst.slowest_off_ms = std::max(worst.slowest_off_ms, outcome.slowest_off_ms);
}

Row run_row(const Subject& subject, const std::string& device, const NamedScript& named,
            unsigned seeds) {
  Row row;
  row.device = device;
  row.script = named.name;
  for (unsigned seed = 1; seed <= seeds; ++seed) {
    FaultScript script = named.script ? *named.script : random_faults(seed);
    script.seed = seed;
    add(run_faults(subject, script), row);
  }
  return row;
}

std::string line_of(const Row& row) {
  char text[160];
  std::snprintf(
      text, sizeof text, "%-14s %-18s %5u %7llu %7u %8.2f %8u %7.2f %7.2f %7.3f %6.2f %6llu",
      row.device.c_str(), row.script.c_str(), row.runs,
      static_cast<unsigned long long>(row.worst.faults_begun), row.latched, row.worst.latch_ms,
      row.pushed_again, row.worst.peak_n, row.worst.device_peak_n, row.worst.steepest_n_per_ms,
      row.worst.slowest_off_ms, static_cast<unsigned long long>(row.worst.violation_count));
  return text;
}

Json json_of(const Row& row) {
  return {{"device", row.device},
          {"script", row.script},
          {"runs", row.runs},
          {"faults", row.worst.faults_begun},
          {"runs_without_push", row.without_push},
          {"runs_latched", row.latched},
          {"slowest_latch_ms", row.worst.latch_ms},
          {"runs_pushed_again", row.pushed_again},
          {"peak_n", row.worst.peak_n},
          {"device_peak_n", row.worst.device_peak_n},
          {"steepest_n_per_ms", row.worst.steepest_n_per_ms},
          {"slowest_off_ms", row.worst.slowest_off_ms},
          {"violations", row.worst.violation_count},
          {"first_violations", row.worst.violations}};
}

}  // namespace

Command::Command(Arguments& program)
    : LabCommand(program, "faults", "every device and fault against the safety contract") {
  for (const std::string_view word : kPersonalityWords) devices_.emplace_back(word);
  app_.option("--device", devices_, "only these")
      .one_of(devices_)
      .split_at_commas()
      .shown_as("NAME,...");
  app_.option("--scripts", scripts_, "fault script, or folder of them").shows_default();
  app_.option("--seeds", seeds_, "runs of each script, each with its own random numbers")
      .within(1, 100000)
      .shows_default();
  app_.option("--random", random_, "1: faults at random as well, another set for each seed")
      .within(0, 1)
      .shows_default();
  app_.option("--scene", scene_, "what is touched").shows_default();
  app_.option("--hand", hand_, "how").shows_default();
  app_.option("--rate", rate_hz_, "of the servo, Hz; must divide 8000").shows_default();
  app_.option("--report", report_, "write the figures as JSON").shown_as("FILE");
  app_.footer("Exit codes: 0 the contract holds, 1 it was broken, 2 bad input or set-up.");
}

int Command::run(std::ostream& out) const {
  if (rate_hz_ < 1 || kCyclesPerSecond % rate_hz_ != 0) {
    throw HilError("--rate: " + std::to_string(rate_hz_) +
                   " does not divide 8000, the rate of the devices' mechanics; use such as 4000");
  }
  const LabOutput report("--report", report_);
  auto scripts = scripts_in(scripts_);
  if (random_ != 0) scripts.push_back({"at random", std::nullopt});
  HandScript hand = read_hand_script(hand_);

  out << "device         script              runs  faults latched latch ms on again  peak N   tip N"
         "    N/ms off ms broken\n";
  Json rows = Json::List{};
  std::uint64_t broken = 0;
  for (const std::string& device : devices_) {
    SceneOverrides overrides;
    overrides.personality = static_cast<Personality>(std::ranges::find(kPersonalityWords, device) -
                                                     kPersonalityWords.begin());
    overrides.torque_scale = torque_scale_of(*overrides.personality);
    overrides.phantom_size = VoxelGrid{64, 64, 40};
    overrides.rate_hz = rate_hz_;
    const LoadedScene scene = load_scene(scene_, overrides);
    hand.unit_mm = hand_unit_mm(scene);
    const Subject subject{.scene = scene, .hand = hand};

    // As many rows at once as there are cores; told in order.
    std::vector<std::future<Row>> running;
    std::size_t next = 0;
    const std::size_t cores = std::max(1U, std::thread::hardware_concurrency());
    for (std::size_t i = 0; i < scripts.size(); ++i) {
      for (; next < scripts.size() && next < i + cores; ++next) {
        running.push_back(std::async(std::launch::async, [&, next] {
          return run_row(subject, device, scripts[next], seeds_);
        }));
      }
      const Row row = running[i].get();
      out << line_of(row) << std::endl;
      for (const std::string& violation : row.worst.violations) out << "  " << violation << '\n';
      broken += row.worst.violation_count;
      rows.push_back(json_of(row));
    }
  }
  report.write(Json{{"rows", rows}, {"violations", broken}}.document());
  return broken == 0 ? 0 : 1;
}

}  // namespace kerf::faults
