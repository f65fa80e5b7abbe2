// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "lab/run/grid_run.hpp"
#include "lab/stability/map.hpp"
#include "shared/text/json.hpp"

/// A map as files: the parts of its shards while they grow, and the finished map as CSV and JSON.
namespace kerf::zwidth {

/// Part `index` of `count` of a map: the columns whose number leaves index - 1 when divided by
/// count.
struct Shard {
  std::size_t index = 1, count = 1;

  [[nodiscard]] bool has(std::size_t column) const { return column % count == index - 1; }
};

/// A hash of the program that runs, with every law linked into it: another build may move other
/// bits.
[[nodiscard]] const std::string& this_program();

/// The content of a part file: one line of JSON for the map, one for each column.
struct Part {
  MapSpec spec;
  Shard shard;
  Columns columns;
  std::string program = this_program();  ///< that measured it
};

/// The text of a part with its columns in order: the same for the same content.
[[nodiscard]] std::string part_text(const Part& part);

/// Reads a part file, of any program; a last line that is not whole (of a run that was killed) is
/// left out. Throws HilError that names `path`.
[[nodiscard]] Part read_part(const std::string& path);

/// Whole maps from the parts of all shards. Throws HilError if they are not of one map and one
/// program, or if a part or a column of one is missing or there twice.
[[nodiscard]] Part merge_parts(const std::vector<std::string>& paths);

/// A part file while its columns come: each is on the disk before the next one is reported. Columns
/// of the same map by the same program that the file already has are kept.
class PartWriter {
 public:
  /// With an empty path nothing is read or written. Throws HilError if the file has another map or
  /// is another program's, if another run is at work on it, or if it cannot be written.
  PartWriter(const std::string& path, const MapSpec& spec, const Shard& shard);

  [[nodiscard]] const Columns& columns() const { return part_.columns; }
  void add(std::size_t index, Column column);
  /// Puts the lines into order.
  void finish();

 private:
  Part part_;
  std::optional<grid::PartFile> file_;
};

/// The analytic boundaries of a column, N/mm; 0: none is stable, or the bound is about another loop
/// (`quantum`: without delay and B). Of the linear loop with the backward difference, whatever the
/// column's own loop is.
struct Analytic {
  double exact, passive, quantum;
  /// The column's loop is that of `exact`: two-sided linear wall, backward difference, double,
  /// without friction, encoder steps, limits and stabiliser.
  bool exact_holds;
  /// Its wall is that of `passive` and `quantum`, which hold with friction, encoder steps and a
  /// wall that never pulls: linear, backward difference, double, without limits and stabiliser.
  bool passive_holds;
};
[[nodiscard]] Analytic analytic_of(const LoopCase& subject);

/// Why a first crossing (`StabilityBoundary`) is no stiffness: "not measured", "below all", "above
/// all", or "undecided" if no cell is bad but one is open; else empty.
[[nodiscard]] std::string no_crossing(const Column& column, double n_per_mm);

/// One row for each cell: all axes, then its figures. A column that cannot exist has no rows.
[[nodiscard]] std::string csv_of(const Part& part);

/// The value of each axis, by its name with the unit.
[[nodiscard]] Json axes_json(const Assignment& values);

/// The map: its axes, and for each column crossings, analytic boundaries and cells.
[[nodiscard]] std::string json_of(const Part& part);

}  // namespace kerf::zwidth
