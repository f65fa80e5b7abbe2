// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "record/check/findings.hpp"
#include "record/scene_facts.hpp"

namespace kerf {

/// Compares the files beside log and scene: those that the manifest lists with their checksums, the
/// volumes of `scene` with their hashes, the inputs of the ticks before the log with their length.
/// Names those that no recording has. `is_final`: a recorder ended it, so the manifest lists all.
/// Returns the files, and folders with files, of which the manifest has no checksum.
[[nodiscard]] std::vector<std::string> check_files(const SceneFacts& scene, std::size_t arms,
                                                   bool is_final, Findings& findings);

}  // namespace kerf
