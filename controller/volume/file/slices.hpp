// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>

#include "controller/volume/file/volume_image.hpp"

// Pictures of grey values as slices of a volume: TIFF, PNG. In the sandbox.

namespace kerf::volume {

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
