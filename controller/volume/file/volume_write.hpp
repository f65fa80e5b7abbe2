// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>

#include "controller/volume/file/volume_image.hpp"
#include "shared/posix/atomic_file.hpp"

namespace kerf {

/// Whether the voxels of a file are compressed.
enum class VolumeEncoding : std::uint8_t { gzip, raw };

/// Where the labels of a volume file lie: `tooth.nrrd` -> `tooth-labels.nrrd`.
[[nodiscard]] std::filesystem::path labels_path(const std::filesystem::path& volume_path);

/// Writes a .nrrd of 16 bits and, if the image has labels, their file beside it. Removes a label
/// file that an earlier volume of this name left there.
///
/// Both are written under temporary names first, so a full disk leaves the old files as they were.
/// Throws LoadError.
void write_volume(const VolumeImage& image, const std::filesystem::path& path,
                  VolumeEncoding encoding = VolumeEncoding::gzip);

/// The same as a part of `files`, which are not committed yet.
void add_volume(const VolumeImage& image, const std::filesystem::path& path,
                VolumeEncoding encoding, AtomicFiles& files);

/// Labels that an earlier volume of this name left.
void remove_labels(const std::filesystem::path& volume_path);

/// Throws now what `write_volume` would throw for this path later. For long runs.
void check_volume_path(const std::filesystem::path& path);

}  // namespace kerf
