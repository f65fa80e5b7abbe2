// SPDX-License-Identifier: Apache-2.0
#include "controller/shell/explain.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <utility>

#include <nlohmann/json.hpp>

#include "controller/scene/scene_words.hpp"
#include "controller/scene/work_budget.hpp"

namespace kerf {
namespace {

struct Sums {
  std::uint64_t operations = 0;
  std::optional<double> predicted_us = 0.0;
  double measured_us = 0;
};

Sums sums_of(const ExplainedTick& tick) {
  Sums sums;
  for (const ExplainedStage& stage : tick.stages) {
    sums.operations += stage.cost.operations;
    sums.measured_us += stage.measured_us;
    if (stage.predicted_us && sums.predicted_us) {
      *sums.predicted_us += *stage.predicted_us;
    } else {
      sums.predicted_us.reset();
    }
  }
  return sums;
}

std::uint64_t total_bytes(const Explanation& explanation) {
  std::uint64_t sum = 0;
  for (const ArrayBytes& array : explanation.arrays) sum += array.bytes;
  return sum;
}

template <class... Values>
std::string format(const char* pattern, Values... values) {
  char text[256];
  std::snprintf(text, sizeof text, pattern, values...);
  return text;
}

std::string us_text(std::optional<double> us) {
  return us ? format("%14.2f", *us) : format("%14s", "-");
}

std::string figures(std::uint64_t operations, std::optional<double> predicted_us,
                    double measured_us) {
  return format("%12llu", static_cast<unsigned long long>(operations)) + us_text(predicted_us) +
         us_text(measured_us);
}

/// Bytes, KiB or MiB, whichever reads best.
std::string memory_line(const std::string& name, std::uint64_t bytes) {
  const auto size = static_cast<double>(bytes);
  const bool mega = bytes >= 1 << 20, kilo = bytes >= 1 << 10;
  return format("  %-36s%*.*f %s\n", name.c_str(), 12, mega || kilo ? 1 : 0,
                mega ? size / (1 << 20) : (kilo ? size / (1 << 10) : size),
                mega ? "MiB" : (kilo ? "KiB" : "B"));
}

std::string tick_text(const ExplainedTick& tick, double budget_us) {
  const Sums sums = sums_of(tick);
  std::string text =
      "\n" + tick.tool + " in " + tick.volume + ": " + tick.way + " (" + tick.why + ")\n";
  for (const ExplainedStage& stage : tick.stages) {
    text += format("  %-14s", stage.cost.stage) +
            figures(stage.cost.operations, stage.predicted_us, stage.measured_us) + "\n";
  }
  text += format("  %-14s", "tick") +
          figures(sums.operations, sums.predicted_us, sums.measured_us) +
          format("%7.1f %%\n", 100 * tick.work_us / budget_us);
  return text;
}

}  // namespace

std::vector<ArrayBytes> segment_arrays(const SegmentPlan& plan, const Scene& scene) {
  const SegmentHeader& header = plan.header;
  std::vector<std::pair<std::uint64_t, std::string>> parts{
      {0, "header"},
      {header.off_volume_table, "volume table"},
      {header.off_scene, "scene"},
      {header.off_state, "ring of ticks"},
      {header.off_dirty, header.dirty_slots > 1 ? "ring of changes" : "ring of changes (unused)"}};
  for (std::size_t v = 0; v < plan.volumes.size(); ++v) {
    const VolumeDescriptor& volume = plan.volumes[v];
    const std::string& name = scene.volumes[v].name;
    parts.emplace_back(volume.off_versions, "brick versions of " + name);
    parts.emplace_back(volume.off_bricks, "bricks of " + name);
    if (volume.off_labels != 0) parts.emplace_back(volume.off_labels, "labels of " + name);
  }
  std::sort(parts.begin(), parts.end());
  std::vector<ArrayBytes> arrays;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const std::uint64_t end = i + 1 < parts.size() ? parts[i + 1].first : header.total_bytes;
    arrays.push_back({"segment: " + parts[i].second, end - parts[i].first, false});
  }
  return arrays;
}

Explanation explain(const Scene& scene, CompiledScene& servo, const SegmentPlan& segment,
                    const Calibration& calibration) {
  const SceneCosts& costs = servo.costs();
  Explanation told{.scene = scene.path,
                   .numeric = std::string(word_of(scene.servo.numeric)),
                   .cut = std::string(word_of(scene.cut.model)),
                   .machine = calibration.machine,
                   .rate_hz = scene.servo.rate_hz,
                   .budget_us = work_budget_us(scene),
                   .ticks = {},
                   .arrays = costs.arrays};
  for (ArrayBytes& array : segment_arrays(segment, scene)) told.arrays.push_back(std::move(array));
  for (std::size_t i = 0; i < costs.ticks.size(); ++i) {
    const TickCost& tick = costs.ticks[i];
    ExplainedTick& out = told.ticks.emplace_back();
    out.tool = scene.tools[tick.tool].name;
    out.volume = scene.volumes[tick.volume].name;
    out.way = tick.cost.way;
    out.why = tick.choice.why;
    out.work_us = work_us(tick.cost);
    const std::vector<double> measured_us = servo.time_stages(i);
    for (std::size_t s = 0; s < measured_us.size(); ++s) {
      const StageCost& stage = tick.cost.stages[s];
      out.stages.push_back({stage, calibration.stage_us(tick.cost, stage), measured_us[s]});
    }
  }
  return told;
}

std::string explanation_text(const Explanation& e) {
  std::string text = e.scene + ": " + std::to_string(e.rate_hz) + " Hz, " + e.numeric +
                     " numbers, cut " + e.cut + "\n\n";
  text += format("  %-14s%12s%14s%14s%9s\n", "each tick", "operations", "predicted us",
                 "measured us", "budget");
  for (const ExplainedTick& tick : e.ticks) text += tick_text(tick, e.budget_us);
  text += "\nmemory\n";
  for (const ArrayBytes& array : e.arrays) text += memory_line(array.name, array.bytes);
  text += memory_line("total", total_bytes(e));
  return text;
}

std::string explanation_json(const Explanation& e) {
  using Json = nlohmann::ordered_json;
  const auto number_or_null = [](std::optional<double> us) { return us ? Json(*us) : Json(); };
  Json ticks = Json::array();
  for (const ExplainedTick& tick : e.ticks) {
    Json stages = Json::array();
    for (const ExplainedStage& stage : tick.stages) {
      stages.push_back({{"stage", stage.cost.stage},
                        {"operations", stage.cost.operations},
                        {"predicted_us", number_or_null(stage.predicted_us)},
                        {"measured_us", stage.measured_us}});
    }
    const Sums sums = sums_of(tick);
    ticks.push_back({{"tool", tick.tool},
                     {"volume", tick.volume},
                     {"plan", tick.way},
                     {"why", tick.why},
                     {"operations", sums.operations},
                     {"predicted_us", number_or_null(sums.predicted_us)},
                     {"measured_us", sums.measured_us},
                     {"work_us", tick.work_us},
                     {"stages", stages}});
  }
  Json arrays = Json::array();
  for (const ArrayBytes& array : e.arrays) {
    arrays.push_back({{"name", array.name}, {"bytes", array.bytes}});
  }
  const Json json{{"program", "kerf-controller"},
                  {"version", KERF_VERSION},
                  {"scene", e.scene},
                  {"rate_hz", e.rate_hz},
                  {"numeric", e.numeric},
                  {"cut", e.cut},
                  {"machine", e.machine},
                  {"budget_us", e.budget_us},
                  {"ticks", ticks},
                  {"arrays", arrays},
                  {"total_bytes", total_bytes(e)}};
  return json.dump(2) + "\n";
}

}  // namespace kerf
