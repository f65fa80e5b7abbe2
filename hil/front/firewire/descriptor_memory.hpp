// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

namespace kerf {

/// How much of its 16 MiB of descriptors a context has in use, page by page as the kernel takes
/// them (ohci.c, context_get_descriptors): a block does not cross pages, and a page is free again
/// once its last block is completed.
class DescriptorMemory {
 public:
  static constexpr std::uint64_t kPages = 16 * 1024 * 1024 / 4096;
  static constexpr std::size_t kPageBytes = 4096 - 48 - 16;  ///< less its header and a guard

  /// False when all pages are in use.
  [[nodiscard]] bool take(std::size_t bytes) noexcept {
    if (used_ + bytes > kPageBytes) {
      if (page_ + 1 - oldest_page_ >= kPages) return false;
      ++page_;
      used_ = 0;
    }
    used_ += bytes;
    return true;
  }
  /// The page of the block taken last.
  [[nodiscard]] std::uint64_t page() const noexcept { return page_; }
  /// All blocks on pages before `page` are completed.
  void complete_before(std::uint64_t page) noexcept { oldest_page_ = page; }

 private:
  std::uint64_t page_ = 0;
  std::uint64_t oldest_page_ = 0;
  std::size_t used_ = 0;
};

}  // namespace kerf
