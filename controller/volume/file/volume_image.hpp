// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "shared/volume/voxel_grid.hpp"

// A volume in memory: its frame, its image, its limits of size; and the types of numbers of volume
// files.

namespace kerf {

/// Where the voxels of a volume lie: voxel (i, j, k) has its centre at
/// `origin_mm + direction * (spacing_mm * (i, j, k))` in the frame of the source file; `direction`
/// is a proper rotation (row-major, columns are the voxel axes).
struct VolumeFrame {
  VoxelGrid grid;
  std::array<double, 3> spacing_mm{1, 1, 1};
  std::array<double, 3> origin_mm{0, 0, 0};
  std::array<double, 9> direction{1, 0, 0, 0, 1, 0, 0, 0, 1};
};

/// Axes of a volume as bits, bit a for axis a: all of them.
inline constexpr std::uint32_t kAllAxes = 0b111;

/// A volume in memory as the scene keeps it: u16 density, x fastest, in its own axes. Load time
/// only.
struct VolumeImage : VolumeFrame {
  std::vector<Density> density;
  std::vector<Label> labels;  ///< empty, or one per voxel
};

/// Largest volume that is read or made. Checked from the header, before any memory is taken.
inline constexpr std::int64_t kMaxVoxelsPerAxis = 1024;
inline constexpr std::int64_t kMaxVoxels = std::int64_t{512} << 20;

/// Throws LoadError if an extent is not positive or above the limits. `location` begins the
/// message; `way_out` ends it if the extents are too large.
void check_grid(const std::string& location, std::int64_t nx, std::int64_t ny, std::int64_t nz,
                const char* way_out = "crop or resample it first");

/// Throws LoadError unless each spacing is finite and within 1 nm .. 1 m. `location` begins
/// the message; `way_out` ends it.
void check_spacing(const std::string& location, const std::array<double, 3>& spacing_mm,
                   const char* way_out = "`spacing_mm = [..]` in the scene or `--spacing`");

/// Type of the values of a file in memory: the smallest that holds each value exactly, or nearest.
/// A CT of 16 bits takes 2 bytes a voxel.
enum class ValueKind : std::uint32_t { float32, int16, uint16 };

[[nodiscard]] constexpr std::size_t bytes_of(ValueKind kind) noexcept {
  return kind == ValueKind::float32 ? sizeof(float) : sizeof(std::int16_t);
}

/// The values of a volume, in memory that it does not own. Every byte pattern is a valid value.
class VoxelValues {
 public:
  VoxelValues() = default;
  explicit VoxelValues(std::span<float> values)
      : bytes_(std::as_writable_bytes(values)), count_(values.size()) {}
  /// `bytes` has room for them and is aligned to them.
  VoxelValues(std::span<std::byte> bytes, ValueKind kind, std::size_t count)
      : bytes_(bytes.first(count * bytes_of(kind))), kind_(kind), count_(count) {}

  [[nodiscard]] std::size_t size() const noexcept { return count_; }
  [[nodiscard]] std::span<std::byte> bytes() const noexcept { return bytes_; }
  /// Calls `use` with a span of their own type.
  template <class Use>
  decltype(auto) visit(const Use& use) const {
    switch (kind_) {
      case ValueKind::int16:
        return use(as<std::int16_t>());
      case ValueKind::uint16:
        return use(as<std::uint16_t>());
      case ValueKind::float32:
        break;
    }
    return use(as<float>());
  }

  [[nodiscard]] float operator[](std::size_t i) const noexcept {
    return visit([i](auto values) { return static_cast<float>(values[i]); });
  }

 private:
  template <class T>
  [[nodiscard]] std::span<const T> as() const noexcept {
    return {reinterpret_cast<const T*>(bytes_.data()), count_};
  }

  std::span<std::byte> bytes_;
  ValueKind kind_ = ValueKind::float32;
  std::size_t count_ = 0;
};

/// Types of the numbers in files.
enum class VoxelType : std::uint8_t {
  uint8,
  int8,
  uint16,
  int16,
  uint32,
  int32,
  uint64,
  int64,
  float32,
  float64
};
inline constexpr std::string_view kVoxelTypeWords[] = {
    "uint8", "int8", "uint16", "int16", "uint32", "int32", "uint64", "int64", "float32", "float64"};

/// Layout of a file of voxels without a header.
struct RawLayout {
  VoxelGrid grid;
  VoxelType type = VoxelType::uint16;
  bool big_endian = false;
  std::uint64_t skip = 0;  ///< bytes before the first voxel
};

/// Calls `use` with a value of the type.
template <class Use>
decltype(auto) visit_type(VoxelType type, const Use& use) {
  switch (type) {
    case VoxelType::uint8:
      return use(std::uint8_t{});
    case VoxelType::int8:
      return use(std::int8_t{});
    case VoxelType::uint16:
      return use(std::uint16_t{});
    case VoxelType::int16:
      return use(std::int16_t{});
    case VoxelType::uint32:
      return use(std::uint32_t{});
    case VoxelType::int32:
      return use(std::int32_t{});
    case VoxelType::uint64:
      return use(std::uint64_t{});
    case VoxelType::int64:
      return use(std::int64_t{});
    case VoxelType::float32:
      return use(float{});
    case VoxelType::float64:
      break;
  }
  return use(double{});
}

/// Values that a file stores as other numbers: slope * number + intercept, in double.
struct Scaling {
  double slope = 1, intercept = 0;
  bool operator==(const Scaling&) const = default;
};

[[nodiscard]] std::size_t bytes_of(VoxelType type) noexcept;
/// Of all numbers of the type, scaled.
[[nodiscard]] ValueKind kind_of(VoxelType type, const Scaling& scaling = {}) noexcept;

/// Converts numbers of a file, in this machine's byte order, to values, in order: as many as `from`
/// holds and `to` has room for. The two may overlap if `to` does not begin after `from`.
void convert_values(VoxelType type, std::span<const std::byte> from, ValueKind kind,
                    std::span<std::byte> to, const Scaling& scaling = {});

}  // namespace kerf
