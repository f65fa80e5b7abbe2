// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace kerf {

/// Writes every row of the recording in `folder` as CSV, whole or not at all: one column per number
/// (`position_mm_0` ...), floats in the shortest form that reads back to the same bits. Throws
/// `RecordError`, or `SceneError` where the file cannot be written.
void export_csv(const std::filesystem::path& folder, const std::filesystem::path& csv);

}  // namespace kerf
