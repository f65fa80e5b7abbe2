// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

// The heap of `write_plan`: all that `new` returns lies in one of two arenas, in blocks that are
// known afterwards. One thread.

namespace kerf::bare {

/// What one `new` returned, by its distance from the arena's first byte.
struct Block {
  std::size_t offset = 0, bytes = 0, align = 1;
};

/// Memory that is only ever handed out, filled with zeros, at an address of its own. A program that
/// makes the same thing in two arenas makes it twice to the byte, but for pointers: they differ by
/// the distance of the arenas.
class Arena {
 public:
  static constexpr std::size_t kBytes = std::size_t{256} << 20;

  Arena();

  /// Where `new` takes memory from, from now on; null: from malloc, as before.
  static void use(Arena* arena) noexcept;

  [[nodiscard]] const std::byte* begin() const noexcept { return begin_; }
  /// By offset. What was deleted is still there.
  [[nodiscard]] const std::vector<Block>& blocks() const noexcept { return blocks_; }

  /// For `new`. Aborts at the end of the arena.
  void* take(std::size_t bytes, std::size_t align);
  [[nodiscard]] bool holds(const void* at) const noexcept {
    return at >= begin_ && at < begin_ + kBytes;
  }

 private:
  std::byte* begin_;
  std::size_t used_ = 0;
  std::vector<Block> blocks_;
};

}  // namespace kerf::bare
