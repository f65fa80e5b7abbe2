// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "controller/volume/file/foreign_volume.hpp"

namespace kerf::volume {

/// The volume in a folder: its kind, the files for its reader, and the others.
struct FolderFiles {
  VolumeKind kind = VolumeKind::dicom_series;
  const char* name = "";  ///< of the kind, for messages
  /// Slices of PNG or TIFF: the pictures, those of the folder itself if they chose the kind. DICOM:
  /// all other files, of folders below too; the reader finds the images among them. In the order of
  /// their names, in which runs of digits count as numbers: slice2 comes before slice10.
  std::vector<std::filesystem::path> files;
  std::string note;  ///< for the user; or empty
};

/// Searches a folder and those below it, to kDeepest levels below, for files, without
/// hidden ones and DICOMDIR.
///
/// Images of a kind in the folder itself choose the kind; a single picture does not. If it has
/// none, as a disc of DICOM, all that lies below does. A kind of less than half as many files as
/// another is left out and noted. Only names and the first bytes are compared, no content is
/// parsed.
///
/// Throws LoadError, one line: a folder that cannot be listed, more than 20,000 files, or two kinds
/// of which neither is the less usual.
[[nodiscard]] FolderFiles files_of_volume(const std::filesystem::path& folder);
inline constexpr int kDeepest = 5;

/// Whether a file begins as DICOM does (PS3.10 7.1), or, as older ones do, with an element of group
/// 2 or 8.
[[nodiscard]] bool begins_as_dicom(const std::filesystem::path& file);

}  // namespace kerf::volume
