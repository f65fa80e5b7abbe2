// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <ostream>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "controller/load/load_scene.hpp"
#include "controller/load/loaded_scene.hpp"
#include "controller/servo/servo.hpp"
#include "hil/device/emulator.hpp"
#include "hil/device/hand_script.hpp"
#include "hil/device/packet_device.hpp"
#include "hil/hil_error.hpp"
#include "hil/script/fault_script.hpp"
#include "hil/script/hand_script_file.hpp"
#include "lab/run/grid_run.hpp"
#include "lab/run/lab_command.hpp"
#include "lab/run/lab_run.hpp"
#include "lab/safety/fault_pairs.hpp"
#include "lab/safety/fault_run.hpp"
#include "shared/posix/program.hpp"
#include "shared/text/json.hpp"

namespace kerf::faults {
namespace {

/// One device in one scene.
struct Cell {
  LoadedScene scene;
  HandScript hand;
  std::string device, model, numeric;
  bool by_service = false;  ///< as in FaultCase
};

/// A cell, a script, all seeds.
struct FaultRow {
  std::string device, model, numeric, script;
  int rate_hz = 0;
  unsigned runs = 0;
  unsigned pushed_again = 0;              ///< runs with force after the last fault
  unsigned latched = 0;                   ///< runs whose reports amounted to a fault
  std::vector<std::string> inconclusive;  ///< a line for each run that shows nothing
  std::string latches;                    ///< of the script
  FaultOutcome worst;
};

/// The worst figures of a matrix.
class Summary {
 public:
  void add(const FaultRow& row);
  [[nodiscard]] bool held() const noexcept { return broken_ == 0 && inconclusive_ == 0; }
  [[nodiscard]] std::string text() const;
  [[nodiscard]] Json json() const;

 private:
  std::uint64_t runs_ = 0, broken_ = 0, inconclusive_ = 0;
  FaultOutcome worst_;
  std::map<std::string, double> latch_ms_;  ///< by fault, of scripts that name it
};

/// The larger figure of each kind; counts add up.
void take_worst(const FaultOutcome& from, FaultOutcome& worst) {
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

Json figures_of(const FaultOutcome& worst) {
  return {{"peak_n", worst.peak_n},
          {"device_peak_n", worst.device_peak_n},
          {"steepest_n_per_ms", worst.steepest_n_per_ms},
          {"rms_n", worst.rms_n},
          {"longest_alone_ms", worst.longest_alone_ms},
          {"slowest_off_ms", worst.slowest_off_ms}};
}

/// Returns true if this script breaks a part that the cell's device has, or has no faults; of a
/// pair each one. A program goes wrong only where one gives the force.
bool applies(const NamedScript& named, const Cell& cell) {
  const bool is_external = cell.scene.force.model == ForceModel::external;
  if (named.program != ProgramWay::steady) return is_external;
  if (!named.script || named.script->faults.empty()) return true;
  const auto concern = [&](const DeviceFault& fault) {
    return concerns(fault.kind, cell.scene.device.personality, cell.by_service);
  };
  const std::span all(named.script->faults);
  const std::size_t first = std::min(named.second_from, all.size());
  return std::ranges::any_of(all.first(first), concern) &&
         (first == all.size() || std::ranges::any_of(all.subspan(first), concern));
}

/// Seeds `seed_base` to `seed_base + seeds - 1`. The same arguments give the same row.
FaultRow run_row(const Cell& cell, const NamedScript& named, std::uint32_t seed_base,
                 unsigned seeds) {
  FaultRow row;
  row.device = cell.device + (cell.by_service ? ", ws" : "");
  row.model = cell.model;
  row.numeric = cell.numeric;
  row.script = named.name;
  row.rate_hz = cell.scene.servo.rate_hz;
  for (std::uint32_t seed = seed_base; seed - seed_base < seeds; ++seed) {
    FaultOutcome outcome = run_faults({.scene = cell.scene,
                                       .hand = cell.hand,
                                       .by_service = cell.by_service,
                                       .stop_s = named.stop_s,
                                       .program = named.program},
                                      played(named, seed));
    row.latches = outcome.demanded;
    const std::string name = "seed " + std::to_string(seed) + ": ";
    if (!outcome.inconclusive.empty()) row.inconclusive.push_back(name + outcome.inconclusive);
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

std::string line_of(const FaultRow& row) {
  char text[240];
  std::snprintf(text, sizeof text,
                "%-13s %7d %-5s %-7s %-18s %4u %7llu %7u %8.2f %8u %7.2f %7.2f %7.3f %6.3f %8.2f "
                "%6.2f %7zu %6llu",
                row.device.c_str(), row.rate_hz, row.model.c_str(), row.numeric.c_str(),
                row.script.c_str(), row.runs,
                static_cast<unsigned long long>(row.worst.faults_begun), row.latched,
                row.worst.latch_ms, row.pushed_again, row.worst.peak_n, row.worst.device_peak_n,
                row.worst.steepest_n_per_ms, row.worst.rms_n, row.worst.longest_alone_ms,
                row.worst.slowest_off_ms, row.inconclusive.size(),
                static_cast<unsigned long long>(row.worst.violation_count));
  return text;
}

Json json_of(const FaultRow& row) {
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
          {"vacuous", row.inconclusive},
          {"violations", row.worst.violation_count},
          {"first_violations", row.worst.violations}};
}

void Summary::add(const FaultRow& row) {
  runs_ += row.runs;
  inconclusive_ += row.inconclusive.size();
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
      static_cast<unsigned long long>(runs_), static_cast<unsigned long long>(inconclusive_),
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
          {"vacuous", inconclusive_},
          {"violations", broken_},
          {"worst", figures_of(worst_)},
          {"slowest_latches", latches}};
}

constexpr std::array<int, 5> kAllRatesHz{250, 1000, 2000, 4000, 8000};
const std::vector<std::string> kModelWords{"paper", "proxy"};     // as in ForceModel
const std::vector<std::string> kNumericWords{"fixed", "double"};  // as in NumericKind
const std::vector<std::string> kPortWords{"socket", "ws"};

std::vector<NamedScript> scripts_in(const std::string& location) {
  std::vector<NamedScript> scripts;
  std::error_code error;
  if (std::filesystem::is_regular_file(location, error)) {
    scripts.push_back({.name = std::filesystem::path(location).stem().string(),
                       .script = read_fault_script(location)});
    return scripts;
  }
  for (const auto& entry : std::filesystem::directory_iterator(location, error)) {
    if (entry.path().extension() != ".toml") continue;
    scripts.push_back(
        {.name = entry.path().stem().string(), .script = read_fault_script(entry.path())});
  }
  if (scripts.empty()) {
    throw HilError("--scripts: " + location +
                   ": no fault scripts there; name hil/faults or a file");
  }
  std::ranges::sort(scripts, {}, &NamedScript::name);
  return scripts;
}

int rate_of(const std::string& word) {
  int rate_hz = 0;
  const char* end = word.data() + word.size();
  const auto read = std::from_chars(word.data(), end, rate_hz);
  if (read.ptr != end || rate_hz < 1 || kCyclesPerSecond % rate_hz != 0) {
    throw HilError("--rate: " + word +
                   " does not divide 8000, the rate of the devices' mechanics; use such as 4000");
  }
  return rate_hz;
}

/// A program that goes wrong, in each of its ways; no fault of a device.
std::vector<NamedScript> wrong_programs() {
  std::vector<NamedScript> all;
  for (std::size_t way = 1; way < kProgramWords.size(); ++way) {
    all.push_back({.name = std::string(kProgramWords[way]),
                   .script = FaultScript{},
                   .program = static_cast<ProgramWay>(way)});
  }
  return all;
}

template <class Enum, class Words>
Enum named(const std::string& word, const Words& words) {
  return static_cast<Enum>(std::ranges::find(words, word) - std::ranges::begin(words));
}

/// `kerf-lab faults`: every device, rate, fault script and seed against the safety contract.
class FaultsCommand final : public LabCommand {
 public:
  explicit FaultsCommand(Arguments& program);
  [[nodiscard]] int run(std::ostream& out) const override;

 private:
  [[nodiscard]] std::vector<int> rates() const;
  [[nodiscard]] std::vector<Cell> cells() const;

  std::string scene_ = "scenes/low_limits.toml", hand_ = "scenes/hands/touch.toml";
  std::string scripts_ = "hil/faults", report_;
  std::vector<std::string> devices_, rates_{"1000"}, models_{"proxy"}, numerics_{"fixed"};
  std::string port_ = "socket";
  std::uint32_t seed_base_ = 1;
  unsigned seeds_ = 20;
  unsigned random_ = 1;
  std::string pairs_;
};

FaultsCommand::FaultsCommand(Arguments& program)
    : LabCommand(program, "faults", "every device and fault against the safety contract") {
  for (const std::string_view word : kPersonalityWords) devices_.emplace_back(word);
  app_.option("--device", devices_, "only these")
      .one_of(devices_)
      .split_at_commas()
      .shown_as("NAME,...");
  app_.option("--port", port_,
              "ws: an Inverse3 behind the emulated service of its vendor, turn by turn")
      .one_of(kPortWords)
      .shown_as("socket|ws [socket]");
  app_.option("--rate", rates_, "of the servo, Hz, each a divisor of 8000; all: 250 to 8000")
      .split_at_commas()
      .shown_as("HZ,... [1000]");
  app_.option("--model", models_, "of the force: proxy, paper; a scene of a program's has its own")
      .one_of(kModelWords)
      .split_at_commas()
      .shown_as("NAME,... [proxy]");
  app_.option("--numeric", numerics_, "numbers of the loop: fixed, double")
      .one_of(kNumericWords)
      .split_at_commas()
      .shown_as("NAME,... [fixed]");
  app_.option("--scripts", scripts_, "fault script, or folder of them").shows_default();
  app_.option("--seeds", seeds_, "runs of each script: other moments, other random numbers")
      .within(1, 100000)
      .shows_default();
  app_.option("--seed-base", seed_base_, "the first seed").within(0, 4e9).shows_default();
  app_.option("--random", random_, "1: faults at random as well, another set for each seed")
      .within(0, 1)
      .shows_default();
  app_.option("--pairs", pairs_,
              "two scripts at once, and each with a signal that asks the controller to end: of "
              "PARTS parts of all pairs this one; 1/1: all")
      .shown_as("PART/PARTS");
  app_.option(
          "--scene", scene_,
          "what is touched; scenes/external.toml: by a program, which also stops, dies, gives NaN "
          "and floods")
      .shows_default();
  app_.option("--hand", hand_, "how").shows_default();
  app_.option("--report", report_, "write the figures as JSON").shown_as("FILE");
  app_.footer(
      "The contract: docs/safety.md.\n\n"
      "Exit codes: 0 the contract holds, 1 it was broken or a run shows nothing, 2 bad input or\n"
      "set-up.");
}

std::vector<int> FaultsCommand::rates() const {
  std::vector<int> rates;
  for (const std::string& word : rates_) {
    if (word == "all") {
      rates.insert(rates.end(), kAllRatesHz.begin(), kAllRatesHz.end());
    } else {
      rates.push_back(rate_of(word));
    }
  }
  return rates;
}

std::vector<Cell> FaultsCommand::cells() const {
  const std::string location = find_scene_file(scene_);
  const HandScript script = read_hand_script(find_data_file(hand_));
  std::vector<Cell> cells;
  const bool by_service = port_ == "ws";
  if (by_service && !kHasService) {
    throw HilError("--port ws: left out of this build; install libboost-dev, then build again");
  }
  for (const std::string& device : devices_) {
    SceneOverrides overrides;
    overrides.personality = personality_of(device);
    if (by_service && !kind_of(*overrides.personality).has_service) continue;
    overrides.torque_scale = torque_scale_of(*overrides.personality);
    overrides.phantom_size = VoxelGrid{64, 64, 40};
    for (const int rate_hz : rates()) {
      overrides.rate_hz = rate_hz;
      for (const std::string& numeric : numerics_) {
        overrides.numeric = named<NumericKind>(numeric, kNumericWords);
        LoadedScene scene = load_scene(location, overrides);
        HandScript hand = script;
        if (!hand.unit_mm) hand.unit_mm = hand_unit_mm(scene);
        if (scene.force.model == ForceModel::external) {
          cells.push_back({scene, hand, device, "external", numeric, by_service});
          continue;
        }
        for (const std::string& model : models_) {
          scene.force.model = named<ForceModel>(model, kModelWords);
          cells.push_back({scene, hand, device, model, numeric, by_service});
        }
      }
    }
  }
  return cells;
}

int FaultsCommand::run(std::ostream& out) const {
  const LabOutput report("--report", report_, ".json");
  auto scripts = scripts_in(find_data_file(scripts_));
  if (!pairs_.empty()) {
    const auto share = pair_share_of(pairs_);
    if (!share) throw HilError("--pairs: " + pairs_ + ": not a part of parts; use such as 3/40");
    scripts = pairs_of(scripts, *share);
  } else {
    if (random_ != 0) scripts.push_back({.name = "at random"});
    for (NamedScript& program : wrong_programs()) scripts.push_back(std::move(program));
  }
  const std::vector<Cell> all = cells();
  struct Job {
    const Cell* cell;
    const NamedScript* script;
  };
  std::vector<Job> jobs;
  for (const Cell& cell : all) {
    for (const NamedScript& script : scripts) {
      if (applies(script, cell)) jobs.push_back({&cell, &script});
    }
  }
  if (jobs.empty()) {
    throw HilError("--scripts: " + scripts_ + ": no device has what they break; name others");
  }

  out << table_head() << std::endl;
  Json rows = Json::List{};
  Summary summary;
  const auto print = [&](const FaultRow& row) {
    out << line_of(row) << std::endl;
    for (const std::string& line : row.worst.violations) out << "  broken: " << line << '\n';
    if (!row.inconclusive.empty()) out << "  shows nothing: " << row.inconclusive.front() << '\n';
    summary.add(row);
    rows.push_back(json_of(row));
  };
  std::map<std::size_t, FaultRow> early;  // rows that end before one above them
  std::size_t printed = 0;
  grid::Run run(grid::threads_for(0));
  run.all(jobs.size(), [&](std::size_t job, std::size_t) {
    FaultRow row = run_row(*jobs[job].cell, *jobs[job].script, seed_base_, seeds_);
    const std::scoped_lock hold(run.results());
    early.emplace(job, std::move(row));
    for (auto next = early.begin(); next != early.end() && next->first == printed; ++printed) {
      print(next->second);
      next = early.erase(next);
    }
  });
  out << summary.text() << '\n';
  report.write(Json{{"rows", rows}, {"all", summary.json()}}.document());
  return summary.held() ? 0 : 1;
}

}  // namespace
}  // namespace kerf::faults

std::unique_ptr<kerf::LabCommand> kerf::make_faults_command(Arguments& program) {
  return std::make_unique<faults::FaultsCommand>(program);
}
