// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "record/log_clock.hpp"
#include "shared/numeric/energy_source.hpp"
#include "shared/segment/reader.hpp"

// What lies beside the rows of a recording: manifest.json and scene.json.

namespace kerf {

class Json;
class TickLogReader;

/// Ticks that were published but not recorded, because the recorder paused for longer than the ring
/// lasts.
struct RecordGap {
  std::uint64_t first_index = 0;
  std::uint64_t count = 0;
};

/// The ticks of a run that its recording lacks.
struct RecordLosses {
  std::uint64_t missed_before_start = 0;  ///< overwritten before the recorder started
  std::uint64_t lost = 0;                 ///< published after that, but in no row
  std::vector<RecordGap> gaps{};          ///< at most `Recorder::kMaxGaps`; `lost` has all
};

inline constexpr std::string_view kTickLogName = "ticks.npy";
inline constexpr std::string_view kManifestName = "manifest.json";
inline constexpr std::string_view kSceneName = "scene.json";
/// No manifest.json is larger: 4,096 gaps in less than 1 MiB, and the checksums, in 35 bytes each,
/// of the files of a log that was split each second for 20 days.
inline constexpr std::uintmax_t kMostManifestBytes = std::uintmax_t{64} << 20;
inline constexpr std::string_view kStillRunning = "running";
inline constexpr std::string_view kCleanEnd = "clean end";
inline constexpr std::string_view kFault = "fault";     ///< the run did not end as it was asked to
inline constexpr std::string_view kNoRoom = "no room";  ///< the disk was full
/// The manifest was made anew, and nothing says how the run ended: its recorder may have been
/// killed.
inline constexpr std::string_view kUnknownEnd = "unknown";

/// Whether the recorder wrote a manifest after its last row, so that rows and losses are those of
/// the whole recording. Else the rows say more than the manifest.
[[nodiscard]] inline bool is_of_whole_log(std::string_view end_reason) noexcept {
  return end_reason != kStillRunning && end_reason != kNoRoom && end_reason != kUnknownEnd;
}

/// The log of an arm: ticks.npy of the first, ticks-2.npy of the second. Both have the same rows:
/// row i is of one tick. A recorder that was killed may leave some more rows in the second.
[[nodiscard]] inline std::string_view tick_log_name(std::size_t arm) noexcept {
  return arm == 0 ? kTickLogName : "ticks-2.npy";
}

/// The logs of all arms. They end with the ticks that all have, but for rows that the header of the
/// first counts: if the second has fewer, that is an error which those who read it report. Throws
/// `RecordError`.
[[nodiscard]] std::vector<TickLogReader> open_logs(const std::filesystem::path& folder,
                                                   std::size_t arms);

/// The files of a recording, which no other output may overwrite.
[[nodiscard]] std::vector<std::filesystem::path> recording_files(
    const std::filesystem::path& folder);

/// The figures of one recording.
struct RecordSummary {
  std::uint64_t rows = 0;
  std::uint64_t first_tick = 0;
  std::uint64_t last_tick = 0;
  double seconds = 0;
  /// Published while recording, and in no row: by the sequence numbers of the rows, and after the
  /// last row by the manifest.
  std::uint64_t lost_ticks = 0;
  std::uint64_t missed_before_start = 0;  ///< overwritten before the recorder started
  std::uint64_t contact_ticks = 0;
  std::uint64_t shaft_ticks = 0;  ///< shaft or handpiece touched
  std::uint64_t stale_ticks = 0;  ///< since the user picked up the device, before it had gone
  std::uint64_t faults = 0;       ///< changes of the fault code to a value that is not 0
  std::uint32_t missed_deadlines = 0;
  std::uint32_t lost_packets = 0;
  std::uint32_t refused_packets = 0;
  double peak_force_n = 0;
  double deepest_mm = 0;
  double removed_density_mm3 = 0;  ///< since the last reset
  double port_energy_mj = 0;       ///< taken from the hand up to the last row
  double port_minimum_mj = 0;      ///< its lowest value of the run: below 0 the loop gave energy
  std::array<double, kEnergySources> energy_mj{};  ///< `port_energy_mj` by source
  std::string end_reason;
};

/// The figures by their names, in the order above.
[[nodiscard]] Json figures_of(const RecordSummary& summary);

/// The summary of each arm; none if the recorder was killed.
using ArmSummaries = std::vector<RecordSummary>;

/// Facts about a log beside its rows.
struct Manifest {
  std::size_t arms = 1;
  std::uint32_t tick_ns = 0;
  std::vector<double> voxel_mm3;  ///< per volume
  std::string session_id;         ///< of the run, as 16 hexadecimal digits
  std::string end_reason;
  bool has_clock = false;                 ///< names clock.npy: log_clock.hpp
  bool has_inputs = false;                ///< lists inputs of the ticks before the log
  std::size_t parts = 1;                  ///< files of the log that had begun when it was written
  std::vector<std::uint32_t> first_rows;  ///< of each arm's log the checksum of its first row
  std::string repaired_by;  ///< version of kerf that made it anew; empty: as its recorder wrote it
  RecordLosses losses;      ///< until the last loss that the recorder wrote down
  ArmSummaries summaries;   ///< of all rows
};

/// Writes manifest.json, whole or not at all, with its checksum and those of the files beside it
/// (record/manifest_seal.hpp): all that are there, or `files`, of a recorder that still runs. It
/// names clock.npy if that is in `folder`, and counts the files of the log.
void write_manifest(const std::filesystem::path& folder, const SegmentInfo& info,
                    const RecordLosses& losses, std::uint64_t rows, std::string_view end_reason,
                    const ArmSummaries& summaries = {}, const Json* files = nullptr);

/// Adds rows, losses, end, figures and checksums to a manifest that has all else, and writes it.
void write_with_end(const std::filesystem::path& folder, Json manifest, const RecordLosses& losses,
                    std::uint64_t rows, std::string_view end_reason, const ArmSummaries& summaries,
                    const Json* files = nullptr);

/// A value of a manifest for a message: short, on one line.
[[nodiscard]] std::string shown(const Json& value);

/// The error line for a file that is not a manifest.
[[nodiscard]] std::string not_a_manifest(const std::filesystem::path& folder);

/// The text of manifest.json in `folder`. Throws `RecordError` if it cannot be read.
[[nodiscard]] std::string manifest_text(const std::filesystem::path& folder);

/// What it says, as it stands there. Throws `RecordError` (of a recording `DamagedRecording`) if it
/// is missing, or a member is missing or of another kind, which it names.
[[nodiscard]] Manifest read_manifest(const std::filesystem::path& folder);

/// The text of scene.json in `folder`. Throws `RecordError`, also if it is larger than any scene.
[[nodiscard]] std::string recorded_scene(const std::filesystem::path& folder);

}  // namespace kerf
