// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

namespace kerf {

/// An array whose size is known before its memory is taken; empty where nothing needs it.
template <class T>
class PlannedArray {
 public:
  /// Several users share it: the largest wish counts.
  void need(std::size_t count) { count_ = std::max(count_, count); }
  void allocate() { memory_.resize(count_); }
  [[nodiscard]] std::size_t bytes() const noexcept { return count_ * sizeof(T); }
  [[nodiscard]] std::span<T> span() noexcept { return memory_; }

 private:
  std::size_t count_ = 0;
  std::vector<T> memory_;
};

}  // namespace kerf
