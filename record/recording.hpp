// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "record/recorder.hpp"
#include "shared/numeric/energy_source.hpp"

// A recording as its readers use it: manifest, summary, CSV.

namespace kerf {

inline constexpr std::string_view kTickLogName = "ticks.npy";
inline constexpr std::string_view kManifestName = "manifest.json";
inline constexpr std::string_view kSceneName = "scene.json";
inline constexpr std::string_view kStillRunning = "running";
inline constexpr std::string_view kFault = "fault";     ///< the run did not end as it was asked to
inline constexpr std::string_view kNoRoom = "no room";  ///< the disk was full

/// The log of an arm: ticks.npy of the first, ticks-2.npy of the second. Both have the same rows:
/// row i is of one tick. A recorder that was killed may leave some more rows in the second.
[[nodiscard]] inline std::string_view tick_log_name(std::size_t arm) noexcept {
  return arm == 0 ? kTickLogName : "ticks-2.npy";
}

/// The files of a recording, of which none may become an output beside it.
[[nodiscard]] inline std::vector<std::filesystem::path> recording_files(
    const std::filesystem::path& folder) {
  return {folder / tick_log_name(0), folder / tick_log_name(1), folder / kManifestName,
          folder / kSceneName};
}

/// The figures of one recording.
struct RecordSummary {
  std::uint64_t rows = 0;
  std::uint64_t first_tick = 0;
  std::uint64_t last_tick = 0;
  double seconds = 0;
  /// Published while recording, and in no row: by the sequence numbers of the rows, and after the
  /// last row by the manifest.
  std::uint64_t lost_ticks = 0;
  std::uint64_t missed_before_start = 0;  ///< published and gone before the recorder came
  std::uint64_t contact_ticks = 0;
  std::uint64_t shaft_ticks = 0;  ///< shaft or handpiece touched
  std::uint64_t stale_ticks = 0;  ///< since the device was taken in hand, before it had gone
  std::uint64_t faults = 0;       ///< changes of the fault code to another one than 0
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

/// The summary of each arm; none if the recorder was killed.
using ArmSummaries = std::vector<RecordSummary>;

/// Facts about a log beside its rows.
struct Manifest {
  std::size_t arms = 1;
  std::uint32_t tick_ns = 0;
  std::vector<double> voxel_mm3;  ///< per volume
  std::string session_id;         ///< of the run, as 16 hexadecimal digits
  std::string end_reason;
  RecordLosses losses;     ///< until the last loss that the recorder wrote down
  ArmSummaries summaries;  ///< of all rows
};

/// Makes the folder of a new recording. Throws `RecordError`.
void make_recording_folder(const std::filesystem::path& folder);

/// Writes manifest.json, whole or not at all.
void write_manifest(const std::filesystem::path& folder, const SegmentInfo& info,
                    const RecordLosses& losses, std::uint64_t rows, std::string_view end_reason,
                    const ArmSummaries& summaries = {});

/// Throws `RecordError` if it is missing or has no such values.
[[nodiscard]] Manifest read_manifest(const std::filesystem::path& folder);

/// The text of scene.json in `folder`. Throws `RecordError`, also if it is larger than any scene.
[[nodiscard]] std::string recorded_scene(const std::filesystem::path& folder);

/// Sums up rows that come in order.
class SummaryBuilder {
 public:
  SummaryBuilder(std::uint32_t tick_ns, std::vector<double> voxel_mm3);
  explicit SummaryBuilder(const SegmentInfo& info);
  void add(const TickRecord& record);
  [[nodiscard]] std::uint64_t rows() const noexcept { return out_.rows; }
  [[nodiscard]] RecordSummary result(const RecordLosses& losses, std::string_view end_reason) const;

 private:
  RecordSummary out_;
  std::uint32_t tick_ns_;
  std::vector<double> voxel_mm3_;
  std::uint64_t first_index_ = 0, next_index_ = 0;
  std::uint32_t fault_ = 0;
  std::uint64_t stale_in_a_row_ = 0;
};

/// Throws `RecordError`, one line, if the recording has no such arm.
void require_arm(const std::filesystem::path& folder, const Manifest& manifest, std::size_t arm);

/// Calls `visit` for each row of `range` in order, with two arms with the second's row of the same
/// tick; that is null with one arm, and behind the end of a log that was cut. Throws `RecordError`,
/// also if the rows of both arms are not of one tick.
void for_each_tick(const std::filesystem::path& folder, const Manifest& manifest, TickRange range,
                   const std::function<void(const TickRecord&, const TickRecord*)>& visit);

/// Reads the rows of an arm of the recording in `folder`. Throws `RecordError`.
[[nodiscard]] RecordSummary summarise(const std::filesystem::path& folder, TickRange range = {},
                                      std::size_t arm = 0);

/// The summary that the recorder left, without a look at the rows; none if it left none, or if the
/// log has another number of rows. Throws `RecordError`.
[[nodiscard]] std::optional<RecordSummary> kept_summary(const std::filesystem::path& folder,
                                                        std::size_t arm = 0);

/// Two columns for people.
[[nodiscard]] std::string to_text(const RecordSummary& summary);

/// The same figures as JSON.
[[nodiscard]] std::string to_json(const RecordSummary& summary);

/// Writes the rows of an arm of the recording in `folder` as CSV, whole or not at all: one column
/// per number
/// (`position_mm_0` ...), floats in the shortest form that reads back to the same bits. Throws
/// `RecordError`, or `FileError` if the file cannot be written.
void export_csv(const std::filesystem::path& folder, const std::filesystem::path& csv,
                TickRange range = {}, std::size_t arm = 0);

}  // namespace kerf
