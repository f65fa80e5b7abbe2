// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace kerf {

/// Draws the recording in `folder` as an SVG of two panels over time: force magnitudes in N, and
/// penetration in mm with removed volume in mm^3. At most 4000 points per curve, every peak kept.
///
/// Runs gnuplot. The file appears whole or not at all. Throws `RecordError`.
void plot_forces(const std::filesystem::path& folder, const std::filesystem::path& svg);

}  // namespace kerf
