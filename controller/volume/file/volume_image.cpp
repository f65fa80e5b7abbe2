// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/file/volume_image.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <sstream>

#include "controller/input/load_error.hpp"

namespace kerf {

void check_grid(const std::string& place, std::int64_t nx, std::int64_t ny, std::int64_t nz,
                const char* way_out) {
  std::ostringstream size;
  size << place << ": " << nx << " x " << ny << " x " << nz;
  if (nx <= 0 || ny <= 0 || nz <= 0) {
    throw LoadError(size.str() + " voxels is empty; every extent must be at least 1");
  }
  const bool long_axis = nx > kMaxVoxelsPerAxis || ny > kMaxVoxelsPerAxis || nz > kMaxVoxelsPerAxis;
  if (long_axis || nx * ny * nz > kMaxVoxels) {
    size << " voxels is above the limit of " << kMaxVoxelsPerAxis << " per axis and "
         << (kMaxVoxels >> 20) << " Mi in all; " << way_out;
    throw LoadError(size.str());
  }
}

void check_spacing(const std::string& place, const std::array<double, 3>& spacing_mm,
                   const char* way_out) {
  constexpr double kSmallestMm = 1e-6;
  constexpr double kLargestMm = 1e3;
  for (const double s : spacing_mm) {
    if (s >= kSmallestMm && s <= kLargestMm) continue;
    std::ostringstream text;
    text << place << ": " << spacing_mm[0] << " " << spacing_mm[1] << " " << spacing_mm[2]
         << " mm is not a voxel size; give three positive numbers of mm with " << way_out;
    throw LoadError(text.str());
  }
}

namespace {

constexpr std::size_t kBlock = 1024;

template <class From, class To>
void convert_as(std::span<const std::byte> from, std::span<std::byte> to) {
  std::array<From, kBlock> values;
  std::array<To, kBlock> converted;
  for (std::size_t left = std::min(from.size() / sizeof(From), to.size() / sizeof(To)); left > 0;) {
    const std::size_t count = std::min(left, kBlock);
    std::memcpy(values.data(), from.data(), count * sizeof(From));
    std::transform(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(count),
                   converted.begin(), [](From value) { return static_cast<To>(value); });
    std::memcpy(to.data(), converted.data(), count * sizeof(To));
    from = from.subspan(count * sizeof(From));
    to = to.subspan(count * sizeof(To));
    left -= count;
  }
}

template <class From>
void convert_from(std::span<const std::byte> from, ValueKind kind, std::span<std::byte> to) {
  if constexpr (sizeof(From) <= sizeof(std::int16_t)) {
    if (kind == ValueKind::int16) return convert_as<From, std::int16_t>(from, to);
    if (kind == ValueKind::uint16) return convert_as<From, std::uint16_t>(from, to);
  }
  convert_as<From, float>(from, to);
}

}  // namespace

std::size_t bytes_of(VoxelType type) noexcept {
  constexpr std::array<std::size_t, std::size(kVoxelTypeWords)> kBytes{1, 1, 2, 2, 4,
                                                                       4, 8, 8, 4, 8};
  return kBytes[static_cast<std::size_t>(type)];
}

ValueKind kind_of(VoxelType type) noexcept {
  switch (type) {
    case VoxelType::uint8:
    case VoxelType::int8:
    case VoxelType::int16:
      return ValueKind::int16;
    case VoxelType::uint16:
      return ValueKind::uint16;
    default:
      return ValueKind::float32;
  }
}

void convert_values(VoxelType type, std::span<const std::byte> from, ValueKind kind,
                    std::span<std::byte> to) {
  switch (type) {
    case VoxelType::uint8:
      return convert_from<std::uint8_t>(from, kind, to);
    case VoxelType::int8:
      return convert_from<std::int8_t>(from, kind, to);
    case VoxelType::uint16:
      return convert_from<std::uint16_t>(from, kind, to);
    case VoxelType::int16:
      return convert_from<std::int16_t>(from, kind, to);
    case VoxelType::uint32:
      return convert_from<std::uint32_t>(from, kind, to);
    case VoxelType::int32:
      return convert_from<std::int32_t>(from, kind, to);
    case VoxelType::uint64:
      return convert_from<std::uint64_t>(from, kind, to);
    case VoxelType::int64:
      return convert_from<std::int64_t>(from, kind, to);
    case VoxelType::float32:
      return convert_from<float>(from, kind, to);
    case VoxelType::float64:
      return convert_from<double>(from, kind, to);
  }
}

}  // namespace kerf
