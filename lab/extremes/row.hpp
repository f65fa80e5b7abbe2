// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "shared/volume/voxel_grid.hpp"

namespace kerf::extremes {

/// A quantity against what it must not exceed, and what it should not.
struct Row {
  std::string group;  ///< as `--only` names it
  std::string name;
  double value = 0;
  std::string unit;
  std::optional<double> must, aim;  ///< none: told, not judged
  std::string skipped{};            ///< why it was not measured; empty: it was

  [[nodiscard]] bool judged() const { return must && skipped.empty(); }
  [[nodiscard]] bool pass() const { return !judged() || value <= *must; }
  [[nodiscard]] bool reached() const { return !aim || value <= *aim; }
};

/// Takes the rows as they are measured.
using RowSink = std::function<void(Row)>;

/// How much is measured: the whole takes about a minute.
struct Effort {
  int walls = 500;  ///< of each kind of wall and tool, 500 ticks at each: a million ticks in all
  int tilts = 100;
  int slides = 10;        ///< over each bump
  int tick_count = 2000;  ///< that are timed
  int phases = 64;        ///< of the ticks along a stroke
  VoxelGrid phantom{256, 256, 161};
  double hand_seconds = 8;
  std::filesystem::path data;  ///< folder of real volumes; empty: there is none

  [[nodiscard]] static Effort quick() { return {5, 8, 1, 200, 8, {128, 128, 80}, 4, {}}; }
};

}  // namespace kerf::extremes
