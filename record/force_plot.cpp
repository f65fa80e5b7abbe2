// SPDX-License-Identifier: Apache-2.0
#include "record/force_plot.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "record/recording.hpp"
#include "record/scene_facts.hpp"
#include "record/tick_log.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/posix/report_tool.hpp"
#include "shared/segment/layout.hpp"
#include "shared/text/json.hpp"

namespace kerf {
namespace {

constexpr std::size_t kMaxPoints = 4000;  // twice the pixels across a wide screen

struct Curve {
  std::string_view name;
  Envelope envelope;
  bool is_zero = true;

  /// A value that is not finite would stop the plot; it becomes 0 there, and stays in the log.
  void add(double x, double y) {
    is_zero = is_zero && !(std::abs(y) > 0);
    envelope.add(x, std::isfinite(y) ? y : 0);
  }
};

/// `{end_s, curves: [{name, s, values}], sources: [...]}`, the sources of energy that did any work.
/// With two arms the curves of the first have commanded_2 and penetration_2 of the second.
[[nodiscard]] Json curves_of(const std::filesystem::path& folder, TickRange range,
                             std::size_t arm) {
  const Manifest manifest = read_facts(folder);
  require_arm(folder, manifest, arm);
  TickLogReader log(folder / tick_log_name(arm));
  if (log.rows() == 0) {
    throw RecordError((folder / tick_log_name(arm)).string() + ": 0 rows; nothing to plot");
  }
  const Envelope empty(log.rows(), kMaxPoints);
  std::vector<Curve> curves;
  for (const std::string_view name :
       {"contact", "modification", "commanded", "penetration", "removed", "port"}) {
    curves.push_back({name, empty});
  }
  const std::size_t first_source = curves.size();
  for (const std::string_view name : kEnergySourceNames) curves.push_back({name, empty});
  Curve second_force{"commanded_2", empty}, second_depth{"penetration_2", empty};
  double removed = 0;
  double end_s = 0;
  std::uint64_t first_tick = 0;
  const auto add = [&](const TickRecord& record) {
    if (first_tick == 0) first_tick = record.tick;
    end_s = static_cast<double>(record.tick - first_tick) * manifest.tick_ns * 1e-9;
    if ((record.flags & kFlagReset) != 0) removed = 0;
    removed += removed_density_mm3(record, manifest.voxel_mm3);
    if (record.stale != 0) return;  // without contact; the curves continue at the next tick
    const std::array values{magnitude(record.contact_force_n),
                            magnitude(record.modification_force_n),
                            magnitude(record.commanded_force_n),
                            double{record.penetration_mm},
                            removed,
                            record.port_energy_j * 1000};
    for (std::size_t i = 0; i < values.size(); ++i) curves[i].add(end_s, values[i]);
    for (std::size_t i = 0; i < kEnergySources; ++i) {
      curves[first_source + i].add(end_s, energy_mj_of_steps(record.*kEnergyColumns[i]));
    }
  };
  const auto add_second = [&](const TickRecord& second) {
    if (second.stale != 0) return;
    second_force.add(end_s, magnitude(second.commanded_force_n));
    second_depth.add(end_s, double{second.penetration_mm});
  };
  if (arm == 0) {
    for_each_tick(folder, manifest, range, [&](const TickRecord& first, const TickRecord* second) {
      add(first);
      if (second != nullptr) add_second(*second);
    });
  } else {
    log.for_each(add, range);
  }
  Json parts = Json::List{};
  Json sources = Json::List{};
  for (std::size_t i = 0; i < curves.size(); ++i) {
    if (i < first_source) {
      parts.push_back(json_of(curves[i].name, curves[i].envelope));
    } else if (!curves[i].is_zero) {
      sources.push_back(json_of(curves[i].name, curves[i].envelope));
    }
  }
  if (arm == 0 && manifest.arms > 1) {
    parts.push_back(json_of(second_force.name, second_force.envelope));
    parts.push_back(json_of(second_depth.name, second_depth.envelope));
  }
  return {{"end_s", end_s + manifest.tick_ns * 1e-9},
          {"curves", std::move(parts)},
          {"sources", std::move(sources)}};
}

}  // namespace

Json json_of(std::string_view name, Envelope& envelope) {
  Json times = Json::List{};
  Json values = Json::List{};
  for (const Envelope::Point& point : envelope.points()) {
    times.push_back(point.x);
    values.push_back(point.y);
  }
  return {{"name", name}, {"s", std::move(times)}, {"values", std::move(values)}};
}

void plot_forces(const std::filesystem::path& folder, const std::filesystem::path& svg,
                 TickRange range, std::size_t arm) {
  check_outputs(recording_files(folder), {{"--out", svg, ".svg"}});
  write_new_file(svg,
                 make_report({"recording", "forces"}, curves_of(folder, range, arm).canonical()));
}

}  // namespace kerf
