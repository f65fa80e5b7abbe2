// SPDX-License-Identifier: Apache-2.0
// The monkey's heap. Who writes outside of a block, or into one that was freed, is stopped there
// and then: kerf, a driver, code that a driver made a moment ago. Sanitizers see only what was
// compiled for them. A large block ends where a page begins that may not be touched, and is such
// pages itself once it is freed. A small one lies between marks, which are looked at when it is
// freed, and again before its memory goes back.
#ifndef KERF_SANITIZED

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <string_view>
#include <utility>

#include <sys/mman.h>
#include <unistd.h>

// NOLINTBEGIN(bugprone-reserved-identifier,readability-identifier-naming)
// NOLINTBEGIN(cppcoreguidelines-pro-type-reinterpret-cast): memory before it has a type
extern "C" {
void* __libc_memalign(std::size_t alignment, std::size_t size);
void __libc_free(void* block);
}

namespace {

constexpr std::size_t kPage = 4096;
constexpr std::size_t kLarge = 512;
/// A process has 65,530 mappings, a block in use takes three: beyond this many they count as small.
constexpr std::size_t kMostLarge = 12'000;
constexpr std::size_t kLargest = std::size_t{1} << 46;
/// Freed ones that are not given out yet.
constexpr std::size_t kKeptLarge = 8'000, kKeptSmall = 100'000;
constexpr std::size_t kMarkBytes = 32;
constexpr std::byte kMark{0xa5}, kFresh{0xcc}, kGone{0xdb};
constexpr std::uint64_t kInUse = 0x6b657266'75736564, kFreed = 0x6b657266'66726565;

/// Lies right before the bytes that are given.
struct Head {
  std::uint64_t state;
  std::size_t size;   ///< that was asked for
  void* memory;       ///< all of it
  std::size_t whole;  ///< of a large one, with its pages; else 0
  std::array<std::byte, kMarkBytes> mark;
};
static_assert(sizeof(Head) == 64);

[[noreturn]] void stop(std::string_view what) {
  constexpr std::string_view kWho = "guarded heap: a block was ";
  static_cast<void>(!write(STDERR_FILENO, kWho.data(), kWho.size()));
  static_cast<void>(!write(STDERR_FILENO, what.data(), what.size()));
  std::abort();
}

std::size_t rounded_up(std::size_t size, std::size_t to) {
  return (size + to - 1) / to * to;
}

std::byte* bytes_of(Head* head) {
  return reinterpret_cast<std::byte*>(head + 1);
}

Head* head_of(void* block) {
  return static_cast<Head*>(block) - 1;
}

bool all_are(const std::byte* bytes, std::size_t count, std::byte value) {
  return std::all_of(bytes, bytes + count, [value](std::byte byte) { return byte == value; });
}

/// From the end of a block to that of what may be touched.
std::size_t marked_behind(const Head& head) {
  if (head.whole == 0) return rounded_up(head.size, 16) - head.size + kMarkBytes;
  const auto* const end = static_cast<std::byte*>(head.memory) + head.whole - kPage;
  return static_cast<std::size_t>(end - reinterpret_cast<const std::byte*>(&head + 1)) - head.size;
}

void mark(Head* head) {
  head->mark.fill(kMark);
  std::memset(bytes_of(head) + head->size, static_cast<int>(kMark), marked_behind(*head));
}

void check_marks(Head* head) {
  if (!all_are(head->mark.data(), kMarkBytes, kMark)) stop("written before its begin\n");
  if (!all_are(bytes_of(head) + head->size, marked_behind(*head), kMark)) {
    stop("written behind its end\n");
  }
}

/// Holds what is freed for a while: gives what has been there longest, once it is full.
template <class Held, std::size_t most>
class Kept {
 public:
  Held exchange(Held newest) {
    const std::lock_guard lock(mutex_);
    Held& oldest = held_[next_++ % most];
    return std::exchange(oldest, newest);
  }

 private:
  std::mutex mutex_;
  std::array<Held, most> held_{};
  std::size_t next_ = 0;
};

struct Pages {
  void* memory = nullptr;
  std::size_t size = 0;
};

// constinit: malloc is called before any initialiser.
constinit Kept<Pages, kKeptLarge> g_kept_large;
constinit Kept<Head*, kKeptSmall> g_kept_small;
constinit std::atomic<std::size_t> g_large = 0;

Head* new_large(std::size_t size, std::size_t alignment) {
  const std::size_t span = rounded_up(size, alignment);
  const std::size_t room = rounded_up(span + sizeof(Head) + alignment, kPage);
  const std::size_t whole = room + 2 * kPage;
  void* const memory =
      mmap(nullptr, whole, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (memory == MAP_FAILED) return nullptr;
  std::byte* const first = static_cast<std::byte*>(memory) + kPage;
  if (mprotect(first, room, PROT_READ | PROT_WRITE) != 0) {
    munmap(memory, whole);
    return nullptr;
  }
  ++g_large;
  const auto end = reinterpret_cast<std::uintptr_t>(first) + room - span;
  // NOLINTNEXTLINE(performance-no-int-to-ptr): std::align would move it up, away from the guard
  Head* const head = head_of(reinterpret_cast<void*>(end / alignment * alignment));
  *head = {kInUse, size, memory, whole, {}};
  return head;
}

Head* new_small(std::size_t size, std::size_t alignment, bool zeroed) {
  const std::size_t before = std::max(alignment, sizeof(Head));
  void* const memory = __libc_memalign(std::max<std::size_t>(alignment, 16),
                                       before + rounded_up(size, 16) + kMarkBytes);
  if (memory == nullptr) return nullptr;
  Head* const head = head_of(static_cast<std::byte*>(memory) + before);
  *head = {kInUse, size, memory, 0, {}};
  std::memset(bytes_of(head), zeroed ? 0 : static_cast<int>(kFresh), size);
  return head;
}

void* new_block(std::size_t size, std::size_t alignment, bool zeroed = false) {
  Head* head = nullptr;
  if (size <= kLargest) {
    head = size >= kLarge && g_large < kMostLarge
               ? new_large(size, std::max<std::size_t>(alignment, 16))
               : new_small(size, alignment, zeroed);
  }
  if (head == nullptr) {
    errno = ENOMEM;
    return nullptr;
  }
  mark(head);
  return bytes_of(head);
}

void free_large(const Head& head) {
  const Pages pages{head.memory, head.whole};
  --g_large;
  // New pages in the place of the old ones: nothing may touch these.
  if (mmap(pages.memory, pages.size, PROT_NONE,
           MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE | MAP_FIXED, -1, 0) == MAP_FAILED) {
    stop("freed, and its pages cannot be closed\n");
  }
  const Pages oldest = g_kept_large.exchange(pages);
  if (oldest.memory != nullptr) munmap(oldest.memory, oldest.size);
}

void free_small(Head* head) {
  std::memset(bytes_of(head), static_cast<int>(kGone), head->size);
  Head* const oldest = g_kept_small.exchange(head);
  if (oldest == nullptr) return;
  if (oldest->state != kFreed || !all_are(bytes_of(oldest), oldest->size, kGone)) {
    stop("written after it was freed\n");
  }
  check_marks(oldest);
  __libc_free(oldest->memory);
}

void free_block(void* block) {
  if (block == nullptr) return;
  Head* const head = head_of(block);
  if (head->state == kFreed) stop("freed twice\n");
  if (head->state != kInUse) stop("written before its begin, or is none of this heap\n");
  check_marks(head);
  head->state = kFreed;
  head->whole != 0 ? free_large(*head) : free_small(head);
}

}  // namespace

// The ordinary names replace the library's for the whole program, as the C library documents it
// ("Replacing malloc").
extern "C" {
void* malloc(std::size_t size) noexcept {
  return new_block(size, 16);
}
void* calloc(std::size_t count, std::size_t size) noexcept {
  std::size_t bytes = 0;
  if (__builtin_mul_overflow(count, size, &bytes)) bytes = SIZE_MAX;
  return new_block(bytes, 16, true);  // large ones are fresh pages
}
void free(void* block) noexcept {
  const int kept = errno;
  free_block(block);
  errno = kept;
}
void* realloc(void* block, std::size_t size) noexcept {
  void* const moved = new_block(size, 16);
  if (block == nullptr || moved == nullptr) return moved;
  std::memcpy(moved, block, std::min(size, head_of(block)->size));
  free_block(block);
  return moved;
}
void* memalign(std::size_t alignment, std::size_t size) noexcept {
  return new_block(size, alignment);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  return new_block(size, alignment);
}
int posix_memalign(void** out, std::size_t alignment, std::size_t size) noexcept {
  *out = new_block(size, alignment);
  return *out == nullptr ? ENOMEM : 0;
}
void* valloc(std::size_t size) noexcept {
  return new_block(size, kPage);
}
void* pvalloc(std::size_t size) noexcept {
  return new_block(rounded_up(size, kPage), kPage);
}
std::size_t malloc_usable_size(void* block) noexcept {
  return block == nullptr ? 0 : head_of(block)->size;
}
}
// NOLINTEND(cppcoreguidelines-pro-type-reinterpret-cast)
// NOLINTEND(bugprone-reserved-identifier,readability-identifier-naming)

#endif
