// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace kerf {

/// A memfd, mapped writable by its maker only, populated and locked where the limits allow.
class SegmentMemory {
 public:
  /// Throws `SegmentError` where `bytes` are not to be had.
  [[nodiscard]] static SegmentMemory create(std::uint64_t bytes);
  SegmentMemory(SegmentMemory&& other) noexcept;
  SegmentMemory& operator=(SegmentMemory&& other) noexcept;
  ~SegmentMemory();

  /// From here on nobody resizes it, and nobody else maps or writes it writable.
  void seal();

  [[nodiscard]] int fd() const noexcept { return fd_; }
  [[nodiscard]] bool locked() const noexcept { return locked_; }
  [[nodiscard]] std::span<std::byte> bytes() const noexcept { return bytes_; }

 private:
  SegmentMemory() = default;
  int fd_ = -1;
  bool locked_ = false;
  std::span<std::byte> bytes_;
};

/// Random, never 0.
[[nodiscard]] std::uint64_t random_session_id();

}  // namespace kerf
