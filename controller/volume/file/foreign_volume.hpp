// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "controller/input/sandbox.hpp"
#include "controller/volume/file/header_fields.hpp"
#include "controller/volume/file/volume_image.hpp"
#include "shared/numeric/linear_algebra.hpp"

// The readers of foreign volumes as the program calls them, in the sandbox.

namespace kerf::volume {

enum class VolumeKind : std::uint8_t {
  nrrd,
  meta,
  nifti,
  tiff,
  dicom_file,
  invesalius,
  dicom_series,
  png_stack,
  tiff_stack,
  raw
};

/// The header of a volume as it comes out of the sandbox: plain bytes, none of them trusted.
struct UntrustedHeader {
  std::array<std::int64_t, 3> size{};
  std::uint32_t voxel_bytes = 0;  ///< of the requested memory, at least those of a value
  ValueKind kind = ValueKind::float32;
  /// Bit a: the file names the distance along axis a; else `spacing_mm[a]` is a library's guess.
  std::uint32_t spacing_known = kAllAxes;
  std::array<char, 96> bad_spacing{};  ///< what the file has that is no distance; or empty
  std::array<double, 3> spacing_mm{1, 1, 1}, origin_mm{};
  std::array<vec3::Vec, 3> axes{};  ///< direction of each, LPS
  std::uint32_t axes_known = 1;     ///< 0: the file names no axes of a body, these are usual ones
  std::array<char, 1024> note{};    ///< for the user: sentences of `add_note`
};

/// Adds a sentence to the note, after "; " if it has one: a choice among several, an order by
/// number, skipped files. A sentence that does not fit is cut off, and ends in "...".
void add_note(UntrustedHeader& header, std::string_view sentence);

/// Of slices without a frame: rows run downwards and slices upwards in a body that lies on its
/// back, as in DICOM.
inline constexpr std::array<vec3::Vec, 3> kSliceAxes{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};

/// Hands over the claim and returns the memory for it.
using MemoryRequest = std::function<std::span<std::byte>(const UntrustedHeader&)>;

/// In the sandbox: parses the file or folder with the libraries, offers a UntrustedHeader and fills
/// the memory with a value for each voxel, x fastest, from its begin. The rest of the memory is
/// left over from the voxels as the file has them. `folder` holds the files of a folder, for
/// slices; other files may be among them. `series`: which of several, by its number or a part of
/// its name. Throws LoadError, or std::bad_alloc.
void read_foreign_volume(const std::filesystem::path& path, VolumeKind kind,
                         const std::vector<std::filesystem::path>& folder,
                         const std::string& series, SandboxReader& sandbox);

/// In the sandbox: one file of that kind, and those that it names. Throw LoadError for what is no
/// single volume of grey values whose geometry is clear.
void read_nrrd(const std::filesystem::path& path, const MemoryRequest& offer);
void read_meta(const std::filesystem::path& path, const MemoryRequest& offer);
void read_nifti(const std::filesystem::path& path, const MemoryRequest& offer);
void read_tiff(const std::filesystem::path& path, const MemoryRequest& offer);
void read_invesalius(const std::filesystem::path& path, const MemoryRequest& offer);

/// In the sandbox: pictures of one size in the order of the numbers in their names. `beside`: the
/// files of the folder.
void read_slice_stack(const std::filesystem::path& folder,
                      const std::vector<std::filesystem::path>& beside, VolumeKind kind,
                      SandboxReader& sandbox, const MemoryRequest& offer);

/// In the sandbox. Throws LoadError for a file whose size is not that of the layout.
void read_raw(const std::filesystem::path& path, const RawLayout& layout,
              const MemoryRequest& offer);

/// Size, spacing, origin and axes of a NRRD of `sizes`, in LPS and mm; the note says what the
/// header leaves open. Throws LoadError for more than one value per voxel, not three axes in space,
/// an unknown space or unit, and what contradicts itself. The sizes are not checked against the
/// limits.
[[nodiscard]] UntrustedHeader nrrd_claim(const HeaderFields& fields,
                                         const std::vector<std::int64_t>& sizes);

/// One volume from the frames of DICOM files: of one file, or of those of a folder, among which
/// other files may be. In the sandbox, as `read_foreign_volume`, which calls it. `path`: the file
/// or folder, for messages.
///
/// Frames are put in order by their positions along the normal; without any position by
/// SliceLocation, else by number, which the note names. Refused by name: no unique series, a gap,
/// two frames at one position, slices that are shifted sideways, a slice that cannot be read.
void read_dicom(const std::filesystem::path& path, const std::vector<std::filesystem::path>& files,
                const std::string& series, SandboxReader& sandbox, const MemoryRequest& offer);

// Pictures of grey values as slices of a volume: TIFF, PNG. In the sandbox.

/// What slices of one file have in common.
struct Slices {
  std::array<std::int64_t, 3> size{};
  VoxelType type{};
  Scaling scaling;  ///< as ImageJ names it
  std::array<double, 3> spacing_mm{1, 1, 1};
  std::uint32_t spacing_known = 0;  ///< bit a: by ImageJ or OME-XML, along axis a
  std::string note;                 ///< for the user: sentences

  void say(const std::string& sentence) { note += (note.empty() ? "" : "; ") + sentence; }
};

/// Returns the memory for the slices; empty if only their facts are wanted.
using SliceMemory = std::function<std::span<std::byte>(const Slices&)>;

/// Reads the slices, x fastest. Throws LoadError for pages that are no slices of one stack: of
/// several sizes or types, colours, packed bits, rows that do not run from the top left, several
/// channels or times.
void read_tiff_slices(const std::filesystem::path& path, const SliceMemory& memory);

/// Reads the one slice of a PNG of 8 or 16 bits. Throws LoadError for another.
void read_png_slice(const std::filesystem::path& path, const SliceMemory& memory);

/// Pixels per unit of length along rows and columns, 0 if unknown; the unit as TIFF counts them.
struct TiffResolution {
  double x = 0, y = 0;
  unsigned unit = 0;
};

/// Sets spacing and scaling of a TIFF's slices as ImageJ or OME-XML name them in `text`, the
/// description of the first page. Throws LoadError if ImageJ, OME-XML or tifffile has other axes
/// than rows, columns and these slices, or planes in another order. In the sandbox.
void describe_slices(const std::filesystem::path& path, const std::string& text,
                     const TiffResolution& resolution, Slices& slices);

}  // namespace kerf::volume
