// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <span>
#include <string>

#include "controller/input/sandbox.hpp"
#include "controller/volume/file/volume_image.hpp"

// Reads a volume file: in the sandbox, checked here.

namespace kerf {

/// A volume as its file holds it: values in the file's own units (often HU), x fastest.
///
/// The frame is LPS for the medical formats, the file's own if it names none. A mirrored file is
/// read with its last axis reversed, so the picture is the same and the axes are right-handed.
struct SourceVolume : VolumeFrame {
  bool has_spacing = true;  ///< false: neither file nor options have one; 1 mm is used
  VoxelValues values;       ///< in `memory`
  std::string note;         ///< the choice among several, or empty
  double min = 0, max = 0;
  SharedBytes memory;
};

struct ReadOptions {
  std::optional<std::array<double, 3>> spacing_mm;  ///< replaces that of the file
  bool allow_missing_spacing = false;               ///< for a preview; see `has_spacing`
  int cpu_s = kReadCpuSeconds;                      ///< CPU time that parsing may take
  std::string series{};            ///< of several in a folder: its number or a part of its name
  std::optional<RawLayout> raw{};  ///< of a file without a header
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

}  // namespace kerf
