// SPDX-License-Identifier: Apache-2.0
#include "lab/faults/command.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstddef>
#include <filesystem>
#include <future>
#include <optional>
#include <ostream>
#include <string_view>
#include <thread>

#include "controller/load/scene_load.hpp"
#include "hil/devmodel/bus_cycle.hpp"
#include "hil/hil_error.hpp"
#include "hil/script/hand_script_file.hpp"
#include "lab/rig/lab_run.hpp"
#include "lab/rig/torque_scale.hpp"
#include "shared/posix/shipped_file.hpp"

namespace kerf::faults {
namespace {

constexpr std::array<int, 5> kAllRatesHz{250, 1000, 2000, 4000, 8000};
const std::vector<std::string> kModelWords{"paper", "proxy"};              // as in ForceModel
const std::vector<std::string> kNumericWords{"fixed", "float", "double"};  // as in NumericKind

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

template <class Enum, class Words>
Enum named(const std::string& word, const Words& words) {
  return static_cast<Enum>(std::ranges::find(words, word) - std::ranges::begin(words));
}

}  // namespace

Command::Command(Arguments& program)
    : LabCommand(program, "faults", "every device and fault against the safety contract") {
  for (const std::string_view word : kPersonalityWords) devices_.emplace_back(word);
  app_.option("--device", devices_, "only these")
      .one_of(devices_)
      .split_at_commas()
      .shown_as("NAME,...");
  app_.option("--rate", rates_, "of the servo, Hz, each a divisor of 8000; all: 250 to 8000")
      .split_at_commas()
      .shown_as("HZ,... [1000]");
  app_.option("--model", models_, "of the force: proxy, paper")
      .one_of(kModelWords)
      .split_at_commas()
      .shown_as("NAME,... [proxy]");
  app_.option("--numeric", numerics_, "numbers of the loop: fixed, float, double")
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
  app_.option("--scene", scene_, "what is touched").shows_default();
  app_.option("--hand", hand_, "how").shows_default();
  app_.option("--report", report_, "write the figures as JSON").shown_as("FILE");
  app_.footer(
      "The contract: docs/safety.md.\n\n"
      "Exit codes: 0 the contract holds, 1 it was broken or a run shows nothing, 2 bad input or\n"
      "set-up.");
}

std::vector<int> Command::rates() const {
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

std::vector<Cell> Command::cells() const {
  const std::string place = shipped_file(scene_);
  HandScript hand = read_hand_script(shipped_file(hand_));
  std::vector<Cell> cells;
  for (const std::string& device : devices_) {
    SceneOverrides overrides;
    overrides.personality = named<Personality>(device, kPersonalityWords);
    overrides.torque_scale = torque_scale_of(*overrides.personality);
    overrides.phantom_size = VoxelGrid{64, 64, 40};
    for (const int rate_hz : rates()) {
      overrides.rate_hz = rate_hz;
      for (const std::string& numeric : numerics_) {
        overrides.numeric = named<NumericKind>(numeric, kNumericWords);
        LoadedScene scene = load_scene(place, overrides);
        hand.unit_mm = hand_unit_mm(scene);
        for (const std::string& model : models_) {
          scene.force.model = named<ForceModel>(model, kModelWords);
          cells.push_back({scene, hand, device, model, numeric});
        }
      }
    }
  }
  return cells;
}

int Command::run(std::ostream& out) const {
  const LabOutput report("--report", report_, ".json");
  auto scripts = scripts_in(shipped_file(scripts_));
  if (random_ != 0) scripts.push_back({"at random", std::nullopt});
  const std::vector<Cell> all = cells();
  struct Job {
    const Cell* cell;
    const NamedScript* script;
  };
  std::vector<Job> jobs;
  for (const Cell& cell : all) {
    for (const NamedScript& script : scripts) {
      if (concerns(script, cell)) jobs.push_back({&cell, &script});
    }
  }
  if (jobs.empty()) {
    throw HilError("--scripts: " + scripts_ + ": no device has what they break; name others");
  }

  out << table_head() << std::endl;
  Json rows = Json::List{};
  Summary summary;
  // As many rows at once as there are cores; told in order.
  std::vector<std::future<Row>> running;
  const std::size_t cores = std::max(1U, std::thread::hardware_concurrency());
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    for (std::size_t next = running.size(); next < std::min(jobs.size(), i + cores); ++next) {
      running.push_back(std::async(std::launch::async, [&, next] {
        return run_row(*jobs[next].cell, *jobs[next].script, seed_base_, seeds_);
      }));
    }
    const Row row = running[i].get();
    out << line_of(row) << std::endl;
    for (const std::string& line : row.worst.violations) out << "  broken: " << line << '\n';
    if (!row.vacuous.empty()) out << "  shows nothing: " << row.vacuous.front() << '\n';
    summary.add(row);
    rows.push_back(json_of(row));
  }
  out << summary.text() << '\n';
  report.write(Json{{"rows", rows}, {"all", summary.json()}}.document());
  return summary.held() ? 0 : 1;
}

}  // namespace kerf::faults
