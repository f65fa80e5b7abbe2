// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace kerf {

/// How values of a file lie in memory: the smallest of these that holds each of its type exactly,
/// or nearest. A CT of 16 bits takes 2 bytes a voxel.
enum class ValueKind : std::uint32_t { float32, int16, uint16 };

[[nodiscard]] constexpr std::size_t bytes_of(ValueKind kind) noexcept {
  return kind == ValueKind::float32 ? sizeof(float) : sizeof(std::int16_t);
}

/// The values of a volume, in memory of another's. Any byte of that memory is some value.
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
  /// What `use` gives for them as a span of their own type.
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

/// Types of numbers that files have.
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

[[nodiscard]] std::size_t bytes_of(VoxelType type) noexcept;
[[nodiscard]] ValueKind kind_of(VoxelType type) noexcept;

/// Numbers of a file, in this machine's byte order, to values, in order: as many as `from` holds
/// and `to` has room for. The begin of `to` may lie in `from`, not after it.
void convert_values(VoxelType type, std::span<const std::byte> from, ValueKind kind,
                    std::span<std::byte> to);

}  // namespace kerf
