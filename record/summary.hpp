// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>

#include "shared/numeric/energy_source.hpp"

namespace kerf {

/// The figures of one recording.
struct RecordSummary {
  std::uint64_t rows = 0;
  std::uint64_t first_tick = 0;
  std::uint64_t last_tick = 0;
  double seconds = 0;
  /// Published while recording, and in no row: by the rows' sequence numbers; what went missing
  /// behind the last row, by the manifest.
  std::uint64_t lost_ticks = 0;
  std::uint64_t missed_before_start = 0;  ///< published and gone before the recorder came
  std::uint64_t contact_ticks = 0;
  std::uint64_t shaft_ticks = 0;  ///< shaft or handpiece touched
  std::uint64_t stale_ticks = 0;
  std::uint64_t faults = 0;  ///< times that the fault code became another one than 0
  std::uint32_t missed_deadlines = 0;
  std::uint32_t lost_packets = 0;
  std::uint32_t refused_packets = 0;
  double peak_force_n = 0;
  double deepest_mm = 0;
  double removed_mm3 = 0;      ///< since the last reset
  double port_energy_mj = 0;   ///< taken from the hand up to the last row
  double port_minimum_mj = 0;  ///< its lowest value of the run: below 0 the loop gave energy
  std::array<double, kEnergySources> energy_mj{};  ///< `port_energy_mj` by source
  std::string end_reason;
};

/// Reads all of the recording in `folder`. Throws `RecordError`.
[[nodiscard]] RecordSummary summarise(const std::filesystem::path& folder);

/// Two columns for people.
[[nodiscard]] std::string to_text(const RecordSummary& summary);

/// The same figures as JSON.
[[nodiscard]] std::string to_json(const RecordSummary& summary);

/// Writes every row of the recording in `folder` as CSV, whole or not at all: one column per number
/// (`position_mm_0` ...), floats in the shortest form that reads back to the same bits. Throws
/// `RecordError`, or `FileError` where the file cannot be written.
void export_csv(const std::filesystem::path& folder, const std::filesystem::path& csv);

/// Draws the recording in `folder` as an SVG of three panels over time: force magnitudes in N,
/// penetration in mm with removed volume in mm^3, and the work of the hand in mJ with its sources.
/// At most 4000 points per curve, every peak kept.
///
/// Runs gnuplot. The file appears whole or not at all. Throws `RecordError`.
void plot_forces(const std::filesystem::path& folder, const std::filesystem::path& svg);

}  // namespace kerf
