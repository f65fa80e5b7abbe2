// SPDX-License-Identifier: Apache-2.0
#include "controller/loop/allocation_counter.hpp"

#include <cerrno>
#include <cstddef>

namespace kerf {
namespace {
// constinit: an access before main, or from malloc itself, must not run an initialiser.
constinit thread_local int counting = 0;
constinit thread_local std::uint64_t allocations = 0;

[[maybe_unused]] void count_one() noexcept {
  if (counting > 0) ++allocations;
}
}  // namespace

CountedAllocations::CountedAllocations() noexcept {
  ++counting;
}
CountedAllocations::~CountedAllocations() {
  --counting;
}
std::uint64_t CountedAllocations::total() noexcept {
  return allocations;
}

}  // namespace kerf

#if !defined(KERF_SANITIZED) && !defined(KERF_SHARED_OBJECT)
// glibc's own names for its allocator; the ordinary names below replace the library's for the whole
// program, as the C library documents it ("Replacing malloc").
// NOLINTBEGIN(bugprone-reserved-identifier,readability-identifier-naming)
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* block, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
void __libc_free(void* block);

void* malloc(std::size_t size) noexcept {
  kerf::count_one();
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) noexcept {
  kerf::count_one();
  return __libc_calloc(count, size);
}
void* realloc(void* block, std::size_t size) noexcept {
  kerf::count_one();
  return __libc_realloc(block, size);
}
void* memalign(std::size_t alignment, std::size_t size) noexcept {
  kerf::count_one();
  return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  return memalign(alignment, size);
}
int posix_memalign(void** out, std::size_t alignment, std::size_t size) noexcept {
  if (alignment % sizeof(void*) != 0 || (alignment & (alignment - 1)) != 0) return EINVAL;
  void* block = memalign(alignment, size);
  if (block == nullptr) return ENOMEM;
  *out = block;
  return 0;
}
void free(void* block) noexcept {
  __libc_free(block);
}
}
// NOLINTEND(bugprone-reserved-identifier,readability-identifier-naming)
#endif
