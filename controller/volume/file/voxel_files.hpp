// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "controller/volume/file/foreign_volume.hpp"
#include "controller/volume/file/header_fields.hpp"
#include "controller/volume/file/volume_image.hpp"

// Voxels behind a header of NRRD, MetaImage or NIfTI, or without one: in one file or in several,
// packed or not, as bytes or as text.

namespace kerf::volume {

enum class Packing : std::uint8_t { raw, text, hex, deflated, bzip2 };

/// A file with a part of the voxels.
struct VoxelPart {
  std::filesystem::path file;
  // The voxels begin after these three, in this order:
  std::uint64_t begin = 0;  ///< bytes of a header in this file
  std::uint64_t lines = 0;  ///< lines to skip
  std::int64_t bytes = 0;   ///< bytes to skip, unpacked; -1 - n: the voxels are the last ones of
                            ///< the file but for n bytes
};

struct VoxelFiles {
  VoxelType type = VoxelType::uint16;
  Packing packing = Packing::raw;
  bool big_endian = false;
  Scaling scaling;
  std::vector<VoxelPart> parts;  ///< of equal numbers of voxels, in order
  /// Of each part: the most bytes that it takes of its file.
  std::uint64_t packed_bytes = std::numeric_limits<std::uint64_t>::max();
};

/// Names of data files as a header writes them: `NAME`, `LIST [axes]`, or a pattern such as
/// `slice_%03d.raw`, and behind it whole numbers.
struct FileNames {
  std::string pattern;
  std::vector<std::int64_t> numbers;  ///< at most `most`

  FileNames(const std::string& text, std::size_t most);
  [[nodiscard]] bool is_list() const { return pattern == "LIST" || pattern == "SKIPLIST"; }
  /// Whether the name holds a number, as in `%03d`.
  [[nodiscard]] bool is_pattern() const { return name(0) != name(1); }
  /// `pattern` with the number in it.
  [[nodiscard]] std::string name(std::int64_t number) const;
};

/// Paths of the data files, in the header's folder.
///
/// Of a pattern, `names.numbers` has first number, last number, step and, optional, the axes per
/// file; of `LIST`, the names are in `list` and `names.numbers` has at most the axes per file. By
/// default one file has all axes but the last. If a file has all axes, each has an equal number of
/// layers of the last one. Refuses the field `key` if the number of names does not match `sizes`.
[[nodiscard]] std::vector<std::filesystem::path> files_of(const HeaderFields& fields,
                                                          const char* key, const FileNames& names,
                                                          const std::vector<std::string>& list,
                                                          const std::vector<std::int64_t>& sizes);

/// Refuses the field `key` if its data file is the header.
void refuse_itself(const HeaderFields& fields, const char* key, const std::filesystem::path& file,
                   const char* remedy);

/// Offers `claim`, whose type of values is set here, and reads the voxels into the memory. Throws
/// LoadError, before memory is taken if their sizes show it, for files that are missing, too short
/// or broken, or (text, packed) hold more than the voxels, or (raw) twice their bytes or more.
/// Fewer bytes that follow raw voxels are left out, and the note says so. `header`: the file that
/// names the others, for messages.
void read_voxel_files(const std::filesystem::path& header, const VoxelFiles& files,
                      UntrustedHeader claim, const MemoryRequest& offer);

}  // namespace kerf::volume
