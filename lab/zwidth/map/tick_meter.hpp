// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>

namespace kerf::zwidth {

/// Thrown out of a hit that is no longer wanted.
struct Interrupted {};

/// Ticks that a column took, and the word that ends it half-way. Each thread has its own.
class TickMeter {
 public:
  TickMeter() = default;
  explicit TickMeter(const std::atomic<bool>& stop) : stop_(&stop) {}

  /// Once per tick. Throws Interrupted within some milliseconds of the word.
  void tick() {
    constexpr std::uint64_t kLook = 1024;
    if (++ticks_ % kLook == 0 && stop_ != nullptr && stop_->load(std::memory_order_relaxed)) {
      throw Interrupted();
    }
  }
  [[nodiscard]] std::uint64_t ticks() const { return ticks_; }

 private:
  const std::atomic<bool>* stop_ = nullptr;
  std::uint64_t ticks_ = 0;
};

}  // namespace kerf::zwidth
