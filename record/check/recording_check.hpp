// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "record/manifest.hpp"
#include "record/tick_log.hpp"

// Whether a recording is as its recorder wrote it: `kerf record info`, `export`, `plot`, `check`
// and `kerf replay` all ask here.

namespace kerf {

/// What is read: manifest.json, scene.json and the headers; the rows, too; and all other files.
enum class CheckDepth { facts, rows, files };

/// A recording, and all that contradicts itself in it.
struct CheckedRecording {
  Manifest manifest;       ///< as `read_facts`
  ArmSummaries summaries;  ///< of the rows in the range, up to the first one that is damaged
  /// One line each: "location: value; remedy".
  std::vector<std::string> problems;
  /// Lines of what a power cut took, which is no contradiction.
  std::vector<std::string> notes;
  bool in_manifest = false;   ///< one of them is in manifest.json, which can be made again
  bool rows_readable = true;  ///< up to the end of the range
  /// Files and folders of which the manifest has no checksum; of `CheckDepth::files`.
  std::vector<std::string> without_checksum;
};

/// Compares all that a recording says twice, and all checksums.
///
/// Each fact has one source: the scene has length of a tick, voxels and arms, the rows have ticks,
/// losses and figures, the manifest has the rest, under its own checksum. Losses and figures are
/// compared if `range` is the whole recording. A recorder that was killed, or that still runs,
/// leaves fewer rows in the manifest than in the log, and possibly a part of a row: that is no
/// problem. Nor are torn rows which the header of such a log does not count: they get a note.
///
/// Throws `DamagedRecording` if nothing can be compared: manifest or log are lost, or have another
/// form; `RecordError` if the folder holds no recording.
[[nodiscard]] CheckedRecording check_recording(const std::filesystem::path& folder,
                                               TickRange range = {},
                                               CheckDepth depth = CheckDepth::rows);

/// The figures of an arm. Throws `RecordError` if a row in the range is damaged.
[[nodiscard]] RecordSummary summarise(const std::filesystem::path& folder, TickRange range = {},
                                      std::size_t arm = 0);

}  // namespace kerf
