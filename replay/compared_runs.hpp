// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "record/force_plot.hpp"
#include "record/recording.hpp"
#include "replay/replay_step.hpp"
#include "shared/segment/layout.hpp"

namespace kerf {

/// Compares a run and its replay: forces, positions of the proxy, removed volumes. For a replay
/// with changes or with another number type.
class ComparedRuns {
 public:
  /// `ticks`: number of the `add` calls to come, at most. `replayed_voxel_mm3`: by volume; the
  /// recorded ones are in `manifest`.
  ComparedRuns(std::uint64_t ticks, const Manifest& manifest,
               std::vector<double> replayed_voxel_mm3);

  /// With two arms, forces and positions are those of the first, removed volumes those of both.
  void add(const ArmRecords& all_recorded, const ArmRecords& all_replayed);

  /// Both peaks and the largest differences, as text in two columns.
  [[nodiscard]] std::string text() const;

  /// Draws three panels over time as SVG: both commanded forces, the distance of both positions,
  /// both removed volumes. The file appears whole or not at all. Throws `RecordError` for a replay
  /// of no tick, `ReportError` or `FileError`.
  void plot(const std::filesystem::path& svg);

 private:
  struct Curve {
    std::string_view name;
    Envelope envelope;
  };
  enum Name : std::size_t { recorded_n, replayed_n, apart_mm, recorded_mm3, replayed_mm3 };
  void draw(Name curve, double value) { curves_[curve].envelope.add(seconds_, value); }

  Manifest manifest_;
  std::vector<double> replayed_voxel_mm3_;
  std::vector<Curve> curves_;  ///< by `Name`
  double seconds_ = 0;         ///< of the last tick
  double recorded_peak_n_ = 0, replayed_peak_n_ = 0, force_apart_n_ = 0, apart_mm_ = 0;
  double recorded_mm3_ = 0, replayed_mm3_ = 0;
};

}  // namespace kerf
