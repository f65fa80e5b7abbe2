// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <vector>

namespace kerf {

/// Parts of one growing array, for meshes that come and go: a part has a power of two of elements,
/// and a freed one is taken again for a mesh of its size.
class RangePool {
 public:
  struct Range {
    std::uint32_t first = 0;
    std::uint32_t capacity = 0;  ///< 0: none
  };

  /// Room for `count` elements, the old range of the same owner given back or kept; `count` 0 gives
  /// it back.
  [[nodiscard]] Range fit(Range old, std::uint32_t count) {
    const std::uint32_t capacity = count == 0 ? 0 : std::max(kLeast, std::bit_ceil(count));
    if (capacity == old.capacity) return old;
    if (old.capacity != 0) free_of(old.capacity).push_back(old.first);
    if (capacity == 0) return {};
    std::vector<std::uint32_t>& free = free_of(capacity);
    if (free.empty()) {
      free.push_back(size_);
      size_ += capacity;
    }
    const Range range{free.back(), capacity};
    free.pop_back();
    return range;
  }
  /// Elements that the array needs.
  [[nodiscard]] std::uint32_t size() const noexcept { return size_; }

 private:
  static constexpr std::uint32_t kLeast = 32;

  [[nodiscard]] std::vector<std::uint32_t>& free_of(std::uint32_t capacity) {
    return free_[static_cast<std::size_t>(std::countr_zero(capacity))];
  }

  std::array<std::vector<std::uint32_t>, 32> free_;  ///< by log2 of the capacity
  std::uint32_t size_ = 0;
};

}  // namespace kerf
