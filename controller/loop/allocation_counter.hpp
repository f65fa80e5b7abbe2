// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace kerf {

/// Counts calls of malloc, calloc, realloc and their aligned forms (operator new among them) that
/// the current thread makes while one of these lives. The allocator is interposed at link time, so
/// library calls count too. Under sanitizers, and in a shared object, whose program has an
/// allocator of its own, the counter is off and reads 0.
class CountedAllocations {
 public:
  CountedAllocations() noexcept;
  ~CountedAllocations();
  CountedAllocations(const CountedAllocations&) = delete;
  CountedAllocations& operator=(const CountedAllocations&) = delete;

  /// Allocations of this thread inside any counted stretch since the thread began.
  [[nodiscard]] static std::uint64_t total() noexcept;
};

}  // namespace kerf
