// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <bit>
#include <cstdint>
#include <optional>

namespace kerf {

/// A queue of `N` items between one thread that pushes and one that takes. Wait-free on both sides;
/// a full queue refuses.
template <class T, std::uint32_t N>
class SpscQueue {
  static_assert(std::has_single_bit(N));

 public:
  [[nodiscard]] bool push(const T& item) noexcept {
    const std::uint32_t tail = tail_.load(std::memory_order_relaxed);
    if (tail - head_.load(std::memory_order_acquire) == N) return false;
    items_[tail & (N - 1)] = item;
    tail_.store(tail + 1, std::memory_order_release);
    return true;
  }

  [[nodiscard]] std::optional<T> take() noexcept {
    const std::uint32_t head = head_.load(std::memory_order_relaxed);
    if (head == tail_.load(std::memory_order_acquire)) return std::nullopt;
    const T item = items_[head & (N - 1)];
    head_.store(head + 1, std::memory_order_release);
    return item;
  }

 private:
  // Both sides count on for ever and wrap; the difference is the fill. A line each, so that the
  // taker's line moves only when it takes.
  alignas(64) std::atomic<std::uint32_t> head_{0};
  alignas(64) std::atomic<std::uint32_t> tail_{0};
  std::array<T, N> items_{};
};

}  // namespace kerf
