// SPDX-License-Identifier: Apache-2.0
#include "examples/bare-metal/arena.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <new>

#include <sys/mman.h>

namespace kerf::bare {
namespace {

Arena* current = nullptr;
Arena* all[2] = {};

void* from_malloc(std::size_t bytes, std::size_t align) {
  void* at = nullptr;
  if (posix_memalign(&at, std::max(align, sizeof(void*)), bytes) != 0) std::abort();
  return at;
}

void* taken(std::size_t bytes, std::size_t align) {
  return current == nullptr ? from_malloc(bytes, align) : current->take(bytes, align);
}

void given_back(void* at) noexcept {
  for (const Arena* arena : all) {
    if (arena != nullptr && arena->holds(at)) return;
  }
  std::free(at);
}

}  // namespace

Arena::Arena() {
  void* at = mmap(nullptr, kBytes, PROT_READ | PROT_WRITE,
                  MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (at == MAP_FAILED) {
    std::fputs("write_plan: no address space for two arenas of 256 MiB\n", stderr);
    std::exit(2);
  }
  begin_ = static_cast<std::byte*>(at);
  (all[0] == nullptr ? all[0] : all[1]) = this;
}

void Arena::use(Arena* arena) noexcept {
  current = arena;
}

void* Arena::take(std::size_t bytes, std::size_t align) {
  constexpr std::size_t kGap = 16;  // the end of a block is no address of the next
  const std::size_t offset = (used_ + kGap + align - 1) / align * align;
  if (offset + bytes > kBytes) {
    std::fputs("write_plan: the scene needs more than 256 MiB; take a smaller one\n", stderr);
    std::exit(2);
  }
  used_ = offset + bytes;
  Arena* const self = current;
  current = nullptr;  // the list is none of the blocks
  blocks_.push_back({offset, bytes, align});
  current = self;
  return begin_ + offset;
}

}  // namespace kerf::bare

void* operator new(std::size_t bytes) {
  return kerf::bare::taken(bytes, alignof(std::max_align_t));
}
void* operator new(std::size_t bytes, std::align_val_t align) {
  return kerf::bare::taken(bytes, static_cast<std::size_t>(align));
}
void operator delete(void* at) noexcept {
  kerf::bare::given_back(at);
}
void operator delete(void* at, std::size_t) noexcept {
  kerf::bare::given_back(at);
}
void operator delete(void* at, std::align_val_t) noexcept {
  kerf::bare::given_back(at);
}
void operator delete(void* at, std::size_t, std::align_val_t) noexcept {
  kerf::bare::given_back(at);
}
