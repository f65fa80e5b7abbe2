// SPDX-License-Identifier: Apache-2.0

#include "shared/volume/checksum.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstring>

namespace kerf {
namespace {

[[nodiscard]] std::uint64_t multiply_in(std::uint64_t lane, std::uint64_t word) noexcept {
  return std::rotl((lane ^ word) * 0x9fb21c651e98df25, 29);
}

using CrcTable = std::array<std::array<std::uint32_t, 256>, 8>;

// table[k][b]: effect of byte b followed by k zero bytes.
constexpr CrcTable kCrcTable = [] {
  constexpr std::uint32_t kPolynomial = 0x82f63b78;  // Castagnoli, reflected
  CrcTable table{};
  for (std::uint32_t byte = 0; byte < 256; ++byte) {
    std::uint32_t crc = byte;
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ ((crc & 1) != 0 ? kPolynomial : 0);
    table[0][byte] = crc;
  }
  for (std::size_t k = 1; k < table.size(); ++k) {
    for (std::size_t byte = 0; byte < 256; ++byte) {
      const std::uint32_t before = table[k - 1][byte];
      table[k][byte] = before >> 8 ^ table[0][before & 0xff];
    }
  }
  return table;
}();

}  // namespace

void DensityHasher::add_row(std::span<const Density> row) noexcept {
  constexpr std::size_t kPerWord = sizeof(std::uint64_t) / sizeof(Density);
  const auto word_at = [&row](std::size_t first, std::size_t count) {
    std::uint64_t word = 0;  // the first density lowest
    if constexpr (std::endian::native == std::endian::little) {
      std::memcpy(&word, row.data() + first, count * sizeof(Density));
    } else {
      for (std::size_t k = 0; k < count; ++k) word |= std::uint64_t{row[first + k]} << (16 * k);
    }
    return word;
  };
  std::size_t i = 0;
  for (; i + 4 * kPerWord <= row.size(); i += 4 * kPerWord) {
    for (std::size_t k = 0; k < 4; ++k) {
      lane_[k] = multiply_in(lane_[k], word_at(i + k * kPerWord, kPerWord));
    }
  }
  for (std::size_t k = 0; i < row.size(); i += kPerWord, ++k) {
    lane_[k] = multiply_in(lane_[k], word_at(i, std::min(kPerWord, row.size() - i)));
  }
  voxels_ += row.size();
}

std::uint64_t DensityHasher::value() const noexcept {
  std::uint64_t hash = voxels_;
  for (const std::uint64_t lane : lane_) hash = multiply_in(hash, lane);
  return hash ^ hash >> 32;
}

std::uint64_t density_hash(std::span<const Density> density) noexcept {
  DensityHasher hasher;
  hasher.add_row(density);
  return hasher.value();
}

std::uint64_t box_hash(std::span<const Density> linear, const VoxelGrid& grid,
                       const VoxelBox& box) noexcept {
  DensityHasher hasher;
  const auto row_length = static_cast<std::size_t>(box.extent().x);
  for (std::int32_t z = box.lo.z; z < box.hi.z; ++z) {
    for (std::int32_t y = box.lo.y; y < box.hi.y; ++y) {
      hasher.add_row(linear.subspan(grid.index(box.lo.x, y, z), row_length));
    }
  }
  return hasher.value();
}

std::uint32_t crc32c(std::span<const std::byte> bytes) noexcept {
  std::uint32_t crc = 0xffffffff;
  std::size_t i = 0;
  for (; i + 8 <= bytes.size(); i += 8) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes.data() + i, 8);
    word ^= crc;
    crc = 0;
    for (std::size_t k = 0; k < 8; ++k) crc ^= kCrcTable[7 - k][word >> (8 * k) & 0xff];
  }
  for (; i < bytes.size(); ++i) {
    crc = crc >> 8 ^ kCrcTable[0][(crc ^ static_cast<std::uint32_t>(bytes[i])) & 0xff];
  }
  return ~crc;
}

}  // namespace kerf
