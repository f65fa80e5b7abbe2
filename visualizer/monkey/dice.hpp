// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <random>
#include <span>

namespace kerf {

/// Chance with a seed: the same numbers on every machine.
class Dice {
 public:
  explicit Dice(std::uint32_t seed) : random_(seed) {}

  /// 0 to n - 1.
  [[nodiscard]] int below(int n) {
    return static_cast<int>(random_() % static_cast<std::uint32_t>(n));
  }
  /// Once in `n` times.
  [[nodiscard]] bool once_in(int n) { return below(n) == 0; }
  /// From `low` to `high`, in a thousand steps.
  [[nodiscard]] double between(double low, double high) {
    return low + (high - low) * below(1001) * 1e-3;
  }
  template <class T>
  [[nodiscard]] const T& one_of(std::span<const T> all) {
    return all[static_cast<std::size_t>(below(static_cast<int>(all.size())))];
  }

 private:
  std::mt19937 random_;
};

}  // namespace kerf
