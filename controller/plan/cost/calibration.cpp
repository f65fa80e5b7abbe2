// SPDX-License-Identifier: Apache-2.0
#include "controller/plan/cost/calibration.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <iterator>
#include <stdexcept>
#include <system_error>
#include <utility>
#include <vector>

#include "controller/plan/compile.hpp"
#include "controller/plan/plan_cost.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "shared/posix/new_file.hpp"
#include "shared/posix/provenance.hpp"
#include "shared/text/json.hpp"

namespace kerf {
namespace {

std::string key_of(const std::string& variant, const StageCost& stage) {
  return variant + "/" + stage.stage;
}

/// A solid block and tools of several sizes, of every plan that `numeric` has with these models.
LoadedScene block_scene(NumericKind numeric, ForceModel force, CutModel cut) {
  constexpr double kPitchMm = 0.125;
  constexpr std::int32_t kEdge = 96;
  LoadedScene scene;
  scene.path = "calibration";
  scene.servo.numeric = numeric;
  scene.force.model = force;
  scene.cut.model = cut;
  SceneVolume& block = scene.volumes.emplace_back();
  block.name = "block";
  block.image.grid = {kEdge, kEdge, kEdge};
  block.image.spacing_mm = {kPitchMm, kPitchMm, kPitchMm};
  block.image.density.assign(block.image.grid.voxel_count(), 65535);
  const auto add = [&](const char* shape, ToolSize size) {
    size.pitch_mm = kPitchMm;
    scene.tools.push_back(make_tool(shape, shape, size));
  };
  if (numeric == NumericKind::fixed) {
    for (const std::int32_t size : {10, 16, 24}) add("ball", {.size_vox = size});
  }
  add("cylinder", {.size_vox = 16});
  add("cylinder", {.radius_mm = 0.5, .length_mm = 4.0});
  add("cone", {.radius_mm = 0.6, .length_mm = 4.0});
  add("flame", {.radius_mm = 0.6, .length_mm = 3.0});
  add("wheel", {.radius_mm = 1.5, .length_mm = 0.8});
  return scene;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Throws what is wrong with it.
Calibration stored_calibration(const std::filesystem::path& path, const SceneCosts& costs) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored)) throw std::runtime_error("is no file");
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error("may not be read");
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  Calibration calibration = parse_calibration(text);
  if (calibration.machine != processor_name()) {
    throw std::runtime_error("is of another machine, " + calibration.machine);
  }
  for (const TickCost& tick : costs.ticks) {
    for (const StageCost& stage : tick.cost.stages) {
      if (calibration.stage_us(tick.cost.variant, stage)) continue;
      throw std::runtime_error("has no price for " + key_of(tick.cost.variant, stage));
    }
  }
  return calibration;
}

/// Keeps it for the next time, or warns.
void store_calibration(const std::filesystem::path& path, const Calibration& calibration) {
  const auto warn = [](const std::string& reason) {
    std::cerr << "kerf-controller: warning: " << reason
              << "; the calibration is not kept: set XDG_CACHE_HOME to a folder for it\n";
  };
  const std::filesystem::path folder = path.parent_path();
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    warn(folder.string() + ": " + error.message());
    return;
  }
  try {
    write_new_file(path, calibration_json(calibration));
  } catch (const FileError& failure) {
    warn(failure.what());
  }
}

}  // namespace

std::optional<double> Calibration::stage_us(const std::string& variant,
                                            const StageCost& stage) const {
  const auto price = price_ns.find(key_of(variant, stage));
  if (price == price_ns.end()) return std::nullopt;
  return static_cast<double>(stage.operations) * price->second / 1000;
}

Calibration measure_calibration() {
  constexpr struct {  // together they have every stage
    NumericKind numeric;
    ForceModel force;
    CutModel cut;
  } kScenes[] = {{NumericKind::fixed, ForceModel::paper, CutModel::none},
                 {NumericKind::fixed, ForceModel::paper, CutModel::overlap_exact},
                 {NumericKind::fixed, ForceModel::proxy, CutModel::none},
                 {NumericKind::fixed, ForceModel::proxy, CutModel::preston},
                 {NumericKind::float32, ForceModel::paper, CutModel::overlap},
                 {NumericKind::float32, ForceModel::paper, CutModel::overlap_exact},
                 {NumericKind::float32, ForceModel::proxy, CutModel::none},
                 {NumericKind::float32, ForceModel::proxy, CutModel::preston},
                 {NumericKind::float64, ForceModel::paper, CutModel::overlap},
                 {NumericKind::float64, ForceModel::paper, CutModel::overlap_exact},
                 {NumericKind::float64, ForceModel::proxy, CutModel::none},
                 {NumericKind::float64, ForceModel::proxy, CutModel::preston}};
  std::map<std::string, std::vector<double>> prices;
  for (const auto& [numeric, force, cut] : kScenes) {
    LoadedScene scene = block_scene(numeric, force, cut);
    const auto servo = compile(scene);
    const std::vector<TickCost>& ticks = servo->costs().ticks;
    for (std::size_t i = 0; i < ticks.size(); ++i) {
      const std::vector<StageTime> timed = servo->time_stages(i);
      for (std::size_t s = 0; s < timed.size(); ++s) {
        // The clock may be coarser than a stage: a price is positive.
        prices[key_of(ticks[i].cost.variant, ticks[i].cost.stages[s])].push_back(
            std::max(timed[s].us * 1000 / static_cast<double>(timed[s].operations), 1e-6));
      }
    }
  }
  Calibration calibration{processor_name(), {}};
  for (auto& [key, values] : prices) calibration.price_ns[key] = median(std::move(values));
  return calibration;
}

std::filesystem::path calibration_path() {
  const auto folder = [](const char* variable) {
    const char* value = std::getenv(variable);
    return std::filesystem::path(value != nullptr ? value : "");
  };
  std::filesystem::path cache = folder("XDG_CACHE_HOME");
  if (!cache.is_absolute()) cache = folder("HOME") / ".cache";
  return cache.is_absolute() ? cache / "kerf" / "calibration.json" : std::filesystem::path();
}

std::string calibration_json(const Calibration& calibration) {
  Json prices = Json::Members{};
  for (const auto& [key, price] : calibration.price_ns) prices[key] = price;
  return Json{{"program", "kerf-controller"},
              {"version", KERF_VERSION},
              {"counts", kCountsRevision},
              {"machine", calibration.machine},
              {"ns_per_operation", std::move(prices)}}
      .document();
}

Calibration parse_calibration(const std::string& text) {
  Json json;
  Calibration calibration;
  try {
    json = Json::parse(text);
    calibration.machine = json.at("machine").get<std::string>();
    static_cast<void>(json.at("ns_per_operation").members());
  } catch (const JsonError&) {
    throw std::runtime_error("is no calibration");
  }
  if (json["version"].canonical() != Json(KERF_VERSION).canonical() ||
      json["counts"].canonical() != Json(kCountsRevision).canonical()) {
    throw std::runtime_error("is of another version");
  }
  for (const auto& [key, price] : json.at("ns_per_operation").members()) {
    constexpr double kMostNs = 1e6;
    double ns = 0;
    try {
      ns = price.get<double>();
    } catch (const JsonError&) {
    }
    if (!(ns > 0 && ns < kMostNs)) throw std::runtime_error("has no price for " + key);
    calibration.price_ns[key] = ns;
  }
  return calibration;
}

Calibration calibration_of_machine(const std::filesystem::path& path, bool renew,
                                   const SceneCosts& costs) {
  std::error_code ignored;
  if (!renew && std::filesystem::exists(path, ignored)) {
    try {
      return stored_calibration(path, costs);
    } catch (const std::exception& error) {
      std::cerr << "kerf-controller: warning: " << path.string() << ": " << error.what()
                << "; measured anew\n";
    }
  }
  Calibration calibration = measure_calibration();
  if (!path.empty()) store_calibration(path, calibration);
  return calibration;
}

}  // namespace kerf
