// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>

namespace kerf::zwidth {

/// Thrown out of a hit that is no longer wanted.
struct Interrupted {};

/// Ticks that a column took, and the word that ends it half-way. Each thread has its own; others
/// may look at the count.
class TickMeter {
 public:
  TickMeter() = default;
  explicit TickMeter(const std::atomic<bool>& stop) : stop_(&stop) {}

  /// Once per tick. Throws Interrupted within some milliseconds of the word.
  void tick() {
    constexpr std::uint64_t kLook = 1024;
    const std::uint64_t ticks = ticks_.load(std::memory_order_relaxed) + 1;
    ticks_.store(ticks, std::memory_order_relaxed);
    if (ticks % kLook == 0 && stop_ != nullptr && stop_->load(std::memory_order_relaxed)) {
      throw Interrupted();
    }
  }
  [[nodiscard]] const std::atomic<std::uint64_t>& ticks() const { return ticks_; }

 private:
  const std::atomic<bool>* stop_ = nullptr;
  std::atomic<std::uint64_t> ticks_{0};
};

}  // namespace kerf::zwidth
