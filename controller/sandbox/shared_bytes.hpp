// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

namespace kerf {

/// Memory of an unnamed file, mapped for reading and writing; unmapped with the object. Load time.
class SharedBytes {
 public:
  SharedBytes() = default;
  /// Maps the first `size` bytes of `file`, which may be closed then; throws std::bad_alloc.
  SharedBytes(int file, std::size_t size);
  SharedBytes(SharedBytes&& other) noexcept;
  SharedBytes& operator=(SharedBytes&& other) noexcept;
  ~SharedBytes();

  [[nodiscard]] std::span<std::byte> bytes() const noexcept { return bytes_; }
  /// The memory is kept until the process ends.
  std::span<std::byte> release() noexcept;

 private:
  std::span<std::byte> bytes_;
};

}  // namespace kerf
