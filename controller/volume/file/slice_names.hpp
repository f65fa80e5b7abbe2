// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <span>

namespace kerf::volume {

/// Refuses files that are not one whole stack of slices by their names: pictures of two stacks, two
/// slices of one number, a slice that is missing. What counts is the last group of digits that is
/// not the same in all names; its steps are even, of 1 or more. `files`: in the order of their
/// numbers, two or more.
///
/// Throws SceneError that names the slice.
void check_slice_names(std::span<const std::filesystem::path> files);

}  // namespace kerf::volume
