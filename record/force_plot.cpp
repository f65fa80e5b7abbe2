// SPDX-License-Identifier: Apache-2.0
#include "record/force_plot.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
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

/// The curves of an arm, and of a second one its commanded force and penetration, from their ticks
/// in order. `manifest` outlives it.
class ForceCurves {
 public:
  ForceCurves(const Manifest& manifest, std::uint64_t rows) : manifest_(manifest) {
    const Envelope empty(rows, kMaxPoints);
    for (const std::string_view name :
         {"contact", "modification", "commanded", "penetration", "removed", "port"}) {
      curves_.push_back({name, empty});
    }
    for (const std::string_view name : kEnergySourceNames) sources_.push_back({name, empty});
    for (const std::string_view name : {"commanded_2", "penetration_2"}) {
      second_.push_back({name, empty});
    }
  }

  void add(const TickRecord& record) {
    if (first_tick_ == 0) first_tick_ = record.tick;
    end_s_ = static_cast<double>(record.tick - first_tick_) * manifest_.tick_ns * 1e-9;
    if ((record.flags & kFlagReset) != 0) removed_ = 0;
    removed_ += removed_density_mm3(record, manifest_.voxel_mm3);
    if (record.stale != 0) return;  // without contact; the curves continue at the next tick
    const std::array values{magnitude(record.contact_force_n),
                            magnitude(record.modification_force_n),
                            magnitude(record.commanded_force_n),
                            double{record.penetration_mm},
                            removed_,
                            record.port_energy_j * 1000};
    for (std::size_t i = 0; i < values.size(); ++i) curves_[i].add(end_s_, values[i]);
    for (std::size_t i = 0; i < kEnergySources; ++i) {
      sources_[i].add(end_s_, energy_mj_of_steps(record.*kEnergyColumns[i]));
    }
  }
  /// The second arm's record of the tick that was added last.
  void add_second(const TickRecord& second) {
    if (second.stale != 0) return;
    second_[0].add(end_s_, magnitude(second.commanded_force_n));
    second_[1].add(end_s_, double{second.penetration_mm});
  }

  /// `{end_s, curves: [{name, s, values}], sources: [...]}` after the last tick; the sources of
  /// energy that did any work.
  [[nodiscard]] Json json(bool with_second) {
    Json curves = Json::List{};
    for (Curve& curve : curves_) curves.push_back(json_of(curve.name, curve.envelope));
    if (with_second) {
      for (Curve& curve : second_) curves.push_back(json_of(curve.name, curve.envelope));
    }
    Json sources = Json::List{};
    for (Curve& curve : sources_) {
      if (!curve.is_zero) sources.push_back(json_of(curve.name, curve.envelope));
    }
    return {{"end_s", end_s_ + manifest_.tick_ns * 1e-9},
            {"curves", std::move(curves)},
            {"sources", std::move(sources)}};
  }

 private:
  const Manifest& manifest_;
  std::vector<Curve> curves_, sources_, second_;
  double removed_ = 0, end_s_ = 0;
  std::uint64_t first_tick_ = 0;
};

/// The curves of an arm as `ForceCurves::json` has them; those of the first of two arms with those
/// of the second.
[[nodiscard]] Json curves_of(const std::filesystem::path& folder, TickRange range,
                             std::size_t arm) {
  const Manifest manifest = read_facts(folder);
  require_arm(folder, manifest, arm);
  TickLogReader log = std::move(open_logs(folder, manifest.arms)[arm]);
  if (log.rows() == 0) {
    throw RecordError((folder / tick_log_name(arm)).string() + ": 0 rows; nothing to plot");
  }
  ForceCurves curves(manifest, log.rows());
  if (arm == 0) {
    for_each_tick(folder, manifest, range, [&](const TickRecord& first, const TickRecord* second) {
      curves.add(first);
      if (second != nullptr) curves.add_second(*second);
    });
  } else {
    log.for_each([&](const TickRecord& record) { curves.add(record); }, range);
  }
  return curves.json(arm == 0 && manifest.arms > 1);
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
