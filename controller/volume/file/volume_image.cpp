// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/file/volume_image.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <sstream>

#include "controller/input/load_error.hpp"

namespace kerf {

void check_grid(const std::string& location, std::int64_t nx, std::int64_t ny, std::int64_t nz,
                const char* way_out) {
  std::ostringstream size;
  size << location << ": " << nx << " x " << ny << " x " << nz;
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

void check_spacing(const std::string& location, const std::array<double, 3>& spacing_mm,
                   const char* way_out) {
  constexpr double kSmallestMm = 1e-6;
  constexpr double kLargestMm = 1e3;
  for (const double s : spacing_mm) {
    if (s >= kSmallestMm && s <= kLargestMm) continue;
    std::ostringstream text;
    text << location << ": " << spacing_mm[0] << " " << spacing_mm[1] << " " << spacing_mm[2]
         << " mm is not a voxel size; give three positive numbers of mm with " << way_out;
    throw LoadError(text.str());
  }
}

namespace {

constexpr std::size_t kBlock = 1024;

template <class From, class To>
void convert_as(std::span<const std::byte> from, std::span<std::byte> to, const Scaling& scaling) {
  const bool scaled = scaling != Scaling{};
  std::array<From, kBlock> values;
  std::array<To, kBlock> converted;
  for (std::size_t left = std::min(from.size() / sizeof(From), to.size() / sizeof(To)); left > 0;) {
    const std::size_t count = std::min(left, kBlock);
    std::memcpy(values.data(), from.data(), count * sizeof(From));
    for (std::size_t i = 0; i < count; ++i) {
      converted[i] =
          scaled
              ? static_cast<To>(scaling.slope * static_cast<double>(values[i]) + scaling.intercept)
              : static_cast<To>(values[i]);
    }
    std::memcpy(to.data(), converted.data(), count * sizeof(To));
    from = from.subspan(count * sizeof(From));
    to = to.subspan(count * sizeof(To));
    left -= count;
  }
}

template <class From>
void convert_from(std::span<const std::byte> from, ValueKind kind, std::span<std::byte> to,
                  const Scaling& scaling) {
  if constexpr (sizeof(From) <= sizeof(std::int16_t)) {
    if (kind == ValueKind::int16) return convert_as<From, std::int16_t>(from, to, scaling);
    if (kind == ValueKind::uint16) return convert_as<From, std::uint16_t>(from, to, scaling);
  }
  convert_as<From, float>(from, to, scaling);
}

}  // namespace

std::size_t bytes_of(VoxelType type) noexcept {
  return visit_type(type, [](auto number) { return sizeof number; });
}

ValueKind kind_of(VoxelType type, const Scaling& scaling) noexcept {
  const bool whole = scaling.slope == std::floor(scaling.slope) &&
                     scaling.intercept == std::floor(scaling.intercept);
  return visit_type(type, [&]<class T>(T) {
    using Range = std::numeric_limits<T>;
    if (!whole || !Range::is_integer || sizeof(T) > sizeof(std::int16_t)) return ValueKind::float32;
    const double a = scaling.slope * static_cast<double>(Range::min()) + scaling.intercept,
                 b = scaling.slope * static_cast<double>(Range::max()) + scaling.intercept;
    const auto hold = [&]<class V>(V) {
      return std::min(a, b) >= std::numeric_limits<V>::min() &&
             std::max(a, b) <= std::numeric_limits<V>::max();
    };
    return hold(std::int16_t{})    ? ValueKind::int16
           : hold(std::uint16_t{}) ? ValueKind::uint16
                                   : ValueKind::float32;
  });
}

void convert_values(VoxelType type, std::span<const std::byte> from, ValueKind kind,
                    std::span<std::byte> to, const Scaling& scaling) {
  visit_type(type, [&]<class T>(T) { convert_from<T>(from, kind, to, scaling); });
}

}  // namespace kerf
