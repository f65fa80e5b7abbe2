// SPDX-License-Identifier: Apache-2.0
#include "replay/compared_runs.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <span>
#include <utility>

#include "record/tick_log.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/posix/report_tool.hpp"
#include "shared/text/json.hpp"

namespace kerf {
namespace {

constexpr std::size_t kMaxPoints = 4000;  // as in a plot of one run

double apart(const float (&a)[3], const float (&b)[3]) {
  return std::hypot(double{a[0]} - b[0], double{a[1]} - b[1], double{a[2]} - b[2]);
}

/// Between the places at which the tool is felt: the hand is at the same one in both runs.
double proxies_apart_mm(const TickRecord& a, const TickRecord& b) {
  double squares = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const double mm = a.position_mm[i] + double{a.proxy_offset_mm[i]} - b.position_mm[i] -
                      double{b.proxy_offset_mm[i]};
    squares += mm * mm;
  }
  return std::isfinite(squares) ? std::sqrt(squares) : 0;  // before docking no place is known
}

void count_removed(const TickRecord& record, std::span<const double> voxel_mm3, double& mm3) {
  if ((record.flags & kFlagReset) != 0) mm3 = 0;
  mm3 += removed_density_mm3(record, voxel_mm3);
}

}  // namespace

ComparedRuns::ComparedRuns(std::uint64_t ticks, const Manifest& manifest,
                           std::vector<double> replayed_voxel_mm3)
    : manifest_(manifest), replayed_voxel_mm3_(std::move(replayed_voxel_mm3)) {
  for (const std::string_view name :
       {"recorded_n", "replayed_n", "apart_mm", "recorded_mm3", "replayed_mm3"}) {
    curves_.push_back({name, Envelope(ticks, kMaxPoints)});
  }
}

void ComparedRuns::add(const ArmRecords& all_recorded, const ArmRecords& all_replayed) {
  const TickRecord& recorded = all_recorded[0];
  const TickRecord& replayed = all_replayed[0];
  seconds_ = static_cast<double>(recorded.tick) * manifest_.tick_ns * 1e-9;
  const double recorded_force_n = magnitude(recorded.commanded_force_n);
  const double replayed_force_n = magnitude(replayed.commanded_force_n);
  const double mm = proxies_apart_mm(recorded, replayed);
  for (std::size_t arm = 0; arm < manifest_.arms; ++arm) {
    count_removed(all_recorded[arm], manifest_.voxel_mm3, recorded_mm3_);
    count_removed(all_replayed[arm], replayed_voxel_mm3_, replayed_mm3_);
  }
  recorded_peak_n_ = std::max(recorded_peak_n_, recorded_force_n);
  replayed_peak_n_ = std::max(replayed_peak_n_, replayed_force_n);
  force_apart_n_ =
      std::max(force_apart_n_, apart(recorded.commanded_force_n, replayed.commanded_force_n));
  apart_mm_ = std::max(apart_mm_, mm);
  draw(recorded_n, recorded_force_n);
  draw(replayed_n, replayed_force_n);
  draw(apart_mm, mm);
  draw(recorded_mm3, recorded_mm3_);
  draw(replayed_mm3, replayed_mm3_);
}

std::string ComparedRuns::text() const {
  char lines[400];
  std::snprintf(lines, sizeof lines,
                "                 recorded    replayed\n"
                "peak force       %8.4f    %8.4f N\n"
                "removed density  %8.4f    %8.4f mm3\n"
                "at most apart    %8.4f N, %.4f mm between the places of the tool\n",
                recorded_peak_n_, replayed_peak_n_, recorded_mm3_, replayed_mm3_, force_apart_n_,
                apart_mm_);
  return lines;
}

void ComparedRuns::plot(const std::filesystem::path& svg) {
  if (seconds_ == 0) throw RecordError(svg.string() + ": no tick was replayed; nothing to plot");
  Json curves = Json::List{};
  for (Curve& curve : curves_) curves.push_back(json_of(curve.name, curve.envelope));
  const Json data = {{"end_s", seconds_}, {"curves", std::move(curves)}};
  write_new_file(svg, make_report({"recording", "replay"}, data.canonical()));
}

}  // namespace kerf
