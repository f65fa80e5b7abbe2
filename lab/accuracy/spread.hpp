// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace kerf::accuracy {

/// Errors of many cases: their root mean square and the largest.
class Spread {
 public:
  void add(double error) noexcept {
    square_ += error * error;
    worst_ = std::max(worst_, std::abs(error));
    ++count_;
  }
  void add(const Spread& other) noexcept {
    square_ += other.square_;
    worst_ = std::max(worst_, other.worst_);
    count_ += other.count_;
  }
  [[nodiscard]] double rms() const noexcept {
    return count_ == 0 ? 0 : std::sqrt(square_ / static_cast<double>(count_));
  }
  [[nodiscard]] double worst() const noexcept { return worst_; }
  [[nodiscard]] std::size_t count() const noexcept { return count_; }

 private:
  double square_ = 0, worst_ = 0;
  std::size_t count_ = 0;
};

}  // namespace kerf::accuracy
