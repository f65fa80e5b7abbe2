// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>

#include "controller/input/sandbox.hpp"
#include "controller/volume/file/volume_image.hpp"
#include "shared/posix/atomic_file.hpp"

// Reads a volume file: in the sandbox, checked here.

namespace kerf {

/// A volume as its file holds it: values in the file's own units (often HU), x fastest.
///
/// The frame is LPS for the medical formats, the file's own if it names none. A mirrored file is
/// read with its last axis reversed, so the picture is the same and the axes are right-handed.
struct SourceVolume : VolumeFrame {
  /// Bit a: file or options have the distance along axis a; else `spacing_mm[a]` is 1.
  std::uint32_t spacing_known = kAllAxes;
  VoxelValues values;  ///< in `memory`
  std::string note;    ///< what the user should know of the reading, on one line; or empty
  /// Which axes are taken for a file that names none, and how to give others; or empty.
  std::string axes_note;
  double min = 0, max = 0;
  SharedBytes memory;
};

struct ReadOptions {
  /// For the axes of which the file has no distance. Along the others it must be the file's, but
  /// for the rounding of its digits: a conflict is refused.
  std::optional<std::array<double, 3>> spacing_mm{};
  std::optional<std::array<double, 3>> override_spacing_mm{};  ///< in place of any of the file's
  bool allow_missing_spacing = false;  ///< for a preview; see `spacing_known`
  int cpu_s = kReadCpuSeconds;         ///< CPU time that parsing may take
  std::string series{};                ///< of several in a folder: its number or a part of its name
  std::optional<RawLayout> raw{};      ///< of a file without a header
  std::string axes{};  ///< of a file that names none: where columns, rows and slices lead, as LPS
};

/// Reads NRRD (.nrrd, .nhdr), MetaImage (.mha, .mhd), NIfTI (.nii, .nii.gz), TIFF of several pages,
/// one DICOM file (.dcm), a DICOM series a stack of PNG or TIFF slices in a folder, and a file
/// without a header if the options give its layout. Integer and floating types, either byte order.
///
/// Parsed in a sandbox (controller/input/sandbox.hpp), where a broken file does no harm; its header
/// is checked here.
///
/// Throws LoadError, one line, for anything that is not a whole, finite, scalar volume of three
/// axes with right angles between them, of known spacing and within the limits of
/// volume_image.hpp (checked before memory is taken). Load time.
[[nodiscard]] SourceVolume read_volume(const std::filesystem::path& path,
                                       const ReadOptions& options = {});

/// Takes the labels from the file that `write_volume` puts beside a volume, if there is one.
/// Throws LoadError when it does not fit the image.
void read_labels_beside(const std::filesystem::path& volume_path, VolumeImage& image,
                        int cpu_s = kReadCpuSeconds);

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

/// Adds the volume's file to `files`, which writes all of them at once when it is committed.
void add_volume(const VolumeImage& image, const std::filesystem::path& path,
                VolumeEncoding encoding, AtomicFiles& files);

/// Labels that an earlier volume of this name left.
void remove_labels(const std::filesystem::path& volume_path);

/// Throws now what `write_volume` would throw for this path later. For long runs.
void check_volume_path(const std::filesystem::path& path);

}  // namespace kerf
