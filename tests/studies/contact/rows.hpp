// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "controller/tool/tool_shapes.hpp"
#include "shared/volume/voxel_grid.hpp"
#include "tests/rig/geometry.hpp"

/// The groups of `kerf-studies extremes` and their rows. Each group measures the servo's own code
/// in fixed point, open loop, by default in voxels of 0.1 mm and at 1 kHz. All but the ticks' times
/// repeat bit for bit.
namespace kerf::extremes {

/// A quantity against its limit and its aim.
struct Row {
  std::string group;  ///< as `--only` names it
  std::string name;
  double value = 0;
  std::string unit;
  std::optional<double> must, aim;  ///< empty: reported, not judged
  std::string skipped{};            ///< the reason if it was not measured, else empty

  [[nodiscard]] bool judged() const { return must && skipped.empty(); }
  [[nodiscard]] bool pass() const { return !judged() || value <= *must; }
  [[nodiscard]] bool reached() const { return !aim || value <= *aim; }
};

/// Takes the rows as they are measured.
using RowSink = std::function<void(Row)>;

/// How much is measured: the whole takes about a minute.
struct Effort {
  int walls = 500;    ///< of each kind of wall and tool, 500 ticks at each: a million ticks in all
  int air_walls = 8;  ///< along which each tool flies 100 ticks
  int tilts = 100;
  int slides = 10;        ///< over each bump
  int tick_count = 2000;  ///< that are timed
  int phases = 64;        ///< of the ticks along a stroke
  VoxelGrid phantom{256, 256, 161};
  double hand_seconds = 8;
  int presses = 240;  ///< of tools that cut, 5 s each; all 10,000 if this is the only group
  std::uint64_t first_scene = 0;  ///< of the presses (stuck_rows.cpp)
  std::filesystem::path data;     ///< folder of real volumes; empty if there is none

  [[nodiscard]] static Effort quick() { return {5, 2, 8, 1, 200, 8, {128, 128, 80}, 4, 24, 0, {}}; }
};

/// F7 (docs/contact.md): random motions at walls.
void measure_walls(const Effort& effort, const RowSink& add_row);
/// Force in air beside a wall: none, at any speed.
void measure_air(const Effort& effort, const RowSink& add_row);
/// F9: rest positions of a ball, against the ideal solid, and on sharp edges against the volume's
/// own iso-surface.
void measure_rests(const Effort& effort, const RowSink& add_row);
/// F8: force on a sliding ball, on edges over two voxels and on those of a noisy CT.
void measure_slides(const Effort& effort, const RowSink& add_row);
/// Slides along and over a sharp edge, 0.05 units a tick.
void measure_edge_slides(const Effort& effort, const RowSink& add_row);
/// The contact's normal if the iso is not half of full density.
void measure_isos(const Effort& effort, const RowSink& add_row);
/// Tools that are not balls, on flats, in any pose.
void measure_shapes(const Effort& effort, const RowSink& add_row);
/// Their part that slides over a bump of 40 units, and the one that rests on sharp edges.
void measure_shape_slides(const Effort& effort, const RowSink& add_row);
void measure_shape_edges(const Effort& effort, const RowSink& add_row);
/// F11: removal by force in the whole servo, and the force on the hand. Few cases at any effort.
void measure_cutting(const Effort& effort, const RowSink& add_row);
/// Random search for positions at which a pressing tool stops cutting, or is held by soft material.
void measure_traps(const Effort& effort, const RowSink& add_row);
/// Time of a tick.
void measure_ticks(const Effort& effort, const RowSink& add_row);

// Tools that are no balls.

/// A tool that is no ball, with the name of its rows.
struct EdgedTool {
  const char* name;
  SceneTool tool;
};

/// A cylinder, a cone and a mesh, 16 units long. Each is measured in any pose.
[[nodiscard]] std::array<EdgedTool, 3> edged_tools();

/// The fluted bur of scenes/fluted_bur.toml, 4 mm long and 0.8 mm in radius, on a grid of this
/// pitch; by default in voxels of 0.125 mm. Throws LoadError if its file cannot be read.
[[nodiscard]] SceneTool shipped_bur(double units_per_mm = 8, double pitch = 1);

/// Search for the input that makes a tick of the swept contact cost most.

/// A body and a place at its surface, about which a hand looks for the tick that costs most.
struct WorstCase {
  std::string name;
  std::function<Body()> body;  ///< made while it is needed: tens of MB
  Point middle;
  Density iso;
};

/// Solids for which a query or a sweep is expensive: flat, sharp, hollow, hardly wider than the
/// tool, noisy, and tissue with contact everywhere and solid nowhere; and the tooth of a CT, if
/// `data` has it. Throws LoadError if that cannot be read.
[[nodiscard]] std::vector<WorstCase> worst_cases(const std::filesystem::path& data);

/// The costliest tick that was found.
struct WorstTick {
  double us = 0;
  int queries = 0;
  std::string at;            ///< name of the worst case
  std::int64_t samples = 0;  ///< as `QueryWork` counts
};

/// Ticks of `follow` from a proxy that is placed or looks for a place, for goals near and far;
/// those whose one run took longest are repeated, from the same state and so alike to the bit, and
/// of each the fastest repetition counts: time taken by other programs does not count, the cost of
/// the input does.
void find_worst_tick(const SceneTool& tool, const WorstCase& worst_case, const Body& body,
                     int ticks, WorstTick& worst);

}  // namespace kerf::extremes
