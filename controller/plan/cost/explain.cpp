// SPDX-License-Identifier: Apache-2.0
#include "controller/plan/cost/explain.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "controller/plan/cost/work_budget.hpp"
#include "controller/scene/scene.hpp"
#include "shared/posix/provenance.hpp"
#include "shared/text/format.hpp"
#include "shared/text/json.hpp"

namespace kerf {
namespace {

std::uint64_t operations(const StageCost& stage) {
  return stage.operations;
}
std::uint64_t operations(const std::vector<StageCost>& stages) {
  std::uint64_t sum = 0;
  for (const StageCost& stage : stages) sum += stage.operations;
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
    works.back().us += work_us(tick.most);
  }
  return works;
}

/// Of a stage, or of a whole tick.
template <class Work>
std::string work_line(const char* name, const Work& most, const Work& timed, double factor) {
  const auto count = [](const Work& work) {
    return static_cast<unsigned long long>(operations(work));
  };
  return format("  %-14s%12llu%12.2f%12llu%14.2f", name, count(most), work_us(most), count(timed),
                factor * work_us(timed));
}

/// Bytes, KiB or MiB, whichever reads best.
std::string memory_line(const std::string& name, std::uint64_t bytes) {
  const auto size = static_cast<double>(bytes);
  const bool mega = bytes >= 1 << 20, kilo = bytes >= 1 << 10;
  return format("  %-36s%*.*f %s\n", name.c_str(), 12, mega || kilo ? 1 : 0,
                mega ? size / (1 << 20) : (kilo ? size / (1 << 10) : size),
                mega ? "MiB" : (kilo ? "KiB" : "B"));
}

std::string tick_text(const ExplainedTick& tick, double factor) {
  std::string text =
      "\n" + tick.tool + " in " + tick.volume + ": " + tick.variant + " (" + tick.why + ")\n";
  for (std::size_t s = 0; s < tick.most.size(); ++s) {
    text += work_line(tick.most[s].stage, tick.most[s], tick.time.stages[s], factor) + "\n";
  }
  return text + work_line("tick", tick.most, tick.time.stages, factor) +
         format("%14.2f%10.2f\n", tick.time.median_us, tick.time.p99_us);
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

Explanation explain(const LoadedScene& scene, CompiledScene& servo, const SegmentPlan& segment) {
  const SceneCosts& costs = servo.costs();
  Explanation explanation{.scene = scene.path,
                          .numeric = std::string(word_of(scene.servo.numeric)),
                          .cut = std::string(word_of(scene.cut.model)),
                          .machine = processor_name(),
                          .rate_hz = scene.servo.rate_hz,
                          .budget_us = work_budget_us(scene),
                          .ticks = {},
                          .arrays = costs.arrays,
                          .gain = gain_margin(scene),
                          .gain_lines = {}};
  explanation.gain_lines = gain_lines(scene, explanation.gain);
  for (ArrayBytes& array : segment_arrays(segment, scene))
    explanation.arrays.push_back(std::move(array));
  double measured_us = 0, timed_us = 0;
  for (std::size_t i = 0; i < costs.ticks.size(); ++i) {
    const TickCost& tick = costs.ticks[i];
    const TickTime time = servo.time_tick(i);
    measured_us += time.median_us;
    timed_us += work_us(time.stages);
    explanation.ticks.push_back({scene.tools[tick.tool].name, scene.volumes[tick.volume].name,
                                 tick.variant(), tick.choice.why, tick.stages, time});
  }
  explanation.machine_factor = measured_us / timed_us;
  return explanation;
}

std::string explanation_text(const Explanation& e) {
  std::string text = e.scene + ": " + std::to_string(e.rate_hz) + " Hz, " + e.numeric +
                     " numbers, cut " + e.cut + "\n\n";
  text += format("  %-14s%12s%12s%12s%14s%14s%10s\n", "", "at most", "work us", "timed",
                 "predicted us", "measured us", "p99");
  for (const ExplainedTick& tick : e.ticks) text += tick_text(tick, e.machine_factor);
  text +=
      "\nat most: operations of any tick; work: their price on the reference machine\n"
      "timed: operations of a tick at its worst; predicted: their price, times " +
      format("%.2f, which fits these ticks on this machine\n", e.machine_factor) +
      "measured: median and p99 of that tick, as the servo computes it\n";
  text += budget_text(e);
  text += "\nstability\n" + e.gain_lines + "\nmemory\n";
  for (const ArrayBytes& array : e.arrays) text += memory_line(array.name, array.bytes);
  text += memory_line("total", total_bytes(e.arrays));
  return text;
}

std::string explanation_json(const Explanation& e) {
  const auto figures = [&](Json json, const auto& most, const auto& timed) {
    json["operations"] = operations(most);
    json["work_us"] = work_us(most);
    json["timed_operations"] = operations(timed);
    json["predicted_us"] = e.machine_factor * work_us(timed);
    return json;
  };
  Json ticks = Json::List{};
  for (const ExplainedTick& tick : e.ticks) {
    const std::vector<StageCost>& timed = tick.time.stages;
    Json stages = Json::List{};
    for (std::size_t s = 0; s < tick.most.size(); ++s) {
      stages.push_back(figures({{"stage", tick.most[s].stage}}, tick.most[s], timed[s]));
    }
    ticks.push_back(figures({{"tool", tick.tool},
                             {"volume", tick.volume},
                             {"method", tick.variant},
                             {"why", tick.why},
                             {"measured_us", tick.time.median_us},
                             {"measured_p99_us", tick.time.p99_us},
                             {"stages", stages}},
                            tick.most, timed));
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
                  {"machine_factor", e.machine_factor},
                  {"budget_us", e.budget_us},
                  {"stability",
                   {{"stiffness_n_per_mm", e.gain.stiffness_n_per_mm},
                    {"damping_ns_per_mm", e.gain.damping_ns_per_mm},
                    {"highest_n_per_mm", e.gain.highest_n_per_mm},
                    {"margin", e.gain.margin()},
                    {"highest_with_friction_n_per_mm", e.gain.highest_with_friction_n_per_mm},
                    {"margin_with_friction", e.gain.with_friction()}}},
                  {"tools", tools},
                  {"ticks", ticks},
                  {"arrays", arrays},
                  {"total_bytes", total_bytes(e.arrays)}};
  return json.document();
}

}  // namespace kerf
