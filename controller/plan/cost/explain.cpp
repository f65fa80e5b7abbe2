// SPDX-License-Identifier: Apache-2.0
#include "controller/plan/cost/explain.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <utility>

#include "controller/plan/cost/work_budget.hpp"
#include "controller/scene/scene_words.hpp"
#include "shared/text/json.hpp"

namespace kerf {
namespace {

/// Both predictions, or none.
std::optional<double> sum_of(std::optional<double> a, std::optional<double> b) {
  return a && b ? std::optional(*a + *b) : std::nullopt;
}

/// The stages of a tick in one.
ExplainedStage sum_of(const ExplainedTick& tick) {
  ExplainedStage sum{{"tick", 0}, 0, 0, 0.0, 0};
  for (const ExplainedStage& stage : tick.stages) {
    sum.cost.operations += stage.cost.operations;
    sum.work_us += stage.work_us;
    sum.timed_operations += stage.timed_operations;
    sum.predicted_us = sum_of(sum.predicted_us, stage.predicted_us);
    sum.measured_us += stage.measured_us;
  }
  return sum;
}

struct ToolWork {
  std::string tool;
  double us = 0;  ///< over all volumes
};

std::vector<ToolWork> works_of(const Explanation& explanation) {
  std::vector<ToolWork> works;
  for (const ExplainedTick& tick : explanation.ticks) {
    if (works.empty() || works.back().tool != tick.tool) works.push_back({tick.tool, 0});
    works.back().us += sum_of(tick).work_us;
  }
  return works;
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

std::string stage_line(const ExplainedStage& stage) {
  const auto count = [](std::uint64_t n) { return static_cast<unsigned long long>(n); };
  return format("  %-14s%12llu%12.2f%12llu", stage.cost.stage, count(stage.cost.operations),
                stage.work_us, count(stage.timed_operations)) +
         (stage.predicted_us ? format("%14.2f", *stage.predicted_us) : format("%14s", "-")) +
         format("%14.2f\n", stage.measured_us);
}

/// Bytes, KiB or MiB, whichever reads best.
std::string memory_line(const std::string& name, std::uint64_t bytes) {
  const auto size = static_cast<double>(bytes);
  const bool mega = bytes >= 1 << 20, kilo = bytes >= 1 << 10;
  return format("  %-36s%*.*f %s\n", name.c_str(), 12, mega || kilo ? 1 : 0,
                mega ? size / (1 << 20) : (kilo ? size / (1 << 10) : size),
                mega ? "MiB" : (kilo ? "KiB" : "B"));
}

std::string tick_text(const ExplainedTick& tick) {
  std::string text =
      "\n" + tick.tool + " in " + tick.volume + ": " + tick.variant + " (" + tick.why + ")\n";
  for (const ExplainedStage& stage : tick.stages) text += stage_line(stage);
  return text + stage_line(sum_of(tick));
}

std::string budget_text(const Explanation& e) {
  std::string text = "\nbudget: work of one tool in all volumes, at most " +
                     format("%.1f us: half a tick at %d Hz\n", e.budget_us, e.rate_hz);
  for (const ToolWork& work : works_of(e)) {
    text += format("  %-36s%12.1f us%8.1f %%%8d Hz at most\n", work.tool.c_str(), work.us,
                   100 * work.us / e.budget_us, highest_rate_hz(work.us));
  }
  return text;
}

}  // namespace

std::vector<ArrayBytes> segment_arrays(const SegmentPlan& plan, const LoadedScene& scene) {
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

Explanation explain(const LoadedScene& scene, CompiledScene& servo, const SegmentPlan& segment,
                    const Calibration& calibration) {
  const SceneCosts& costs = servo.costs();
  Explanation explanation{.scene = scene.path,
                          .numeric = std::string(word_of(scene.servo.numeric)),
                          .cut = std::string(word_of(scene.cut.model)),
                          .machine = calibration.machine,
                          .rate_hz = scene.servo.rate_hz,
                          .budget_us = work_budget_us(scene),
                          .ticks = {},
                          .arrays = costs.arrays};
  for (ArrayBytes& array : segment_arrays(segment, scene))
    explanation.arrays.push_back(std::move(array));
  for (std::size_t i = 0; i < costs.ticks.size(); ++i) {
    const TickCost& tick = costs.ticks[i];
    ExplainedTick& out = explanation.ticks.emplace_back();
    out.tool = scene.tools[tick.tool].name;
    out.volume = scene.volumes[tick.volume].name;
    out.variant = tick.cost.variant;
    out.why = tick.choice.why;
    const std::vector<StageTime> timed = servo.time_stages(i);
    for (std::size_t s = 0; s < timed.size(); ++s) {
      const StageCost& stage = tick.cost.stages[s];
      out.stages.push_back(
          {stage, work_us(tick.cost, stage), timed[s].operations,
           calibration.stage_us(tick.cost.variant, {stage.stage, timed[s].operations}),
           timed[s].us});
    }
  }
  return explanation;
}

std::string explanation_text(const Explanation& e) {
  std::string text = e.scene + ": " + std::to_string(e.rate_hz) + " Hz, " + e.numeric +
                     " numbers, cut " + e.cut + "\n\n";
  text += format("  %-14s%12s%12s%12s%14s%14s\n", "", "at most", "work us", "timed", "predicted us",
                 "measured us");
  for (const ExplainedTick& tick : e.ticks) text += tick_text(tick);
  text +=
      "\nat most: operations of any tick; work: their price on the reference machine\n"
      "timed: operations inside the densest part; predicted, measured: of them on this machine\n";
  text += budget_text(e);
  text += "\nmemory\n";
  for (const ArrayBytes& array : e.arrays) text += memory_line(array.name, array.bytes);
  text += memory_line("total", total_bytes(e));
  return text;
}

std::string explanation_json(const Explanation& e) {
  Json ticks = Json::List{};
  for (const ExplainedTick& tick : e.ticks) {
    Json stages = Json::List{};
    for (const ExplainedStage& stage : tick.stages) {
      stages.push_back({{"stage", stage.cost.stage},
                        {"operations", stage.cost.operations},
                        {"work_us", stage.work_us},
                        {"timed_operations", stage.timed_operations},
                        {"predicted_us", stage.predicted_us},
                        {"measured_us", stage.measured_us}});
    }
    const ExplainedStage sum = sum_of(tick);
    ticks.push_back({{"tool", tick.tool},
                     {"volume", tick.volume},
                     {"plan", tick.variant},
                     {"why", tick.why},
                     {"operations", sum.cost.operations},
                     {"work_us", sum.work_us},
                     {"timed_operations", sum.timed_operations},
                     {"predicted_us", sum.predicted_us},
                     {"measured_us", sum.measured_us},
                     {"stages", stages}});
  }
  Json tools = Json::List{};
  for (const ToolWork& work : works_of(e)) {
    tools.push_back(
        {{"tool", work.tool}, {"work_us", work.us}, {"highest_rate_hz", highest_rate_hz(work.us)}});
  }
  Json arrays = Json::List{};
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
                  {"tools", tools},
                  {"ticks", ticks},
                  {"arrays", arrays},
                  {"total_bytes", total_bytes(e)}};
  return json.document();
}

}  // namespace kerf
