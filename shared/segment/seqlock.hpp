// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "shared/segment/layout.hpp"

namespace kerf {

/// The protocol for all data in the segment that changes: a seqlock with fences (Boehm).
///
///     writer   version = odd (relaxed); fence(release); words (relaxed); version = even (release)
///     reader   v = version (acquire); words (relaxed); fence(acquire); version (relaxed) == v?
///
/// Every shared word is accessed through `atomic_ref`, so there is no data race; the fences order
/// data against version. ThreadSanitizer does not support fences: under KERF_TSAN each data word is
/// a release store or an acquire load instead, which gives the same order.
namespace shared_words {

#ifdef __cpp_lib_atomic_ref
template <class Word>
using AtomicWord = std::atomic_ref<Word>;
static_assert(std::atomic_ref<std::uint64_t>::is_always_lock_free);
static_assert(std::atomic_ref<std::uint32_t>::is_always_lock_free);
#else  // libc++ 16 for WebAssembly, where writer and reader run in one thread
template <class Word>
class AtomicWord {
 public:
  explicit AtomicWord(Word& word) noexcept : word_(word) {}
  [[nodiscard]] Word load(std::memory_order) const noexcept { return word_; }
  void store(Word value, std::memory_order) const noexcept { word_ = value; }

 private:
  Word& word_;
};
#endif

#ifdef KERF_TSAN
inline constexpr std::memory_order kDataStore = std::memory_order_release;
inline constexpr std::memory_order kDataLoad = std::memory_order_acquire;
inline void fence(std::memory_order) noexcept {}
#else
inline constexpr std::memory_order kDataStore = std::memory_order_relaxed;
inline constexpr std::memory_order kDataLoad = std::memory_order_relaxed;
inline void fence(std::memory_order order) noexcept {
  std::atomic_thread_fence(order);
}
#endif

/// The word at `at`, an aligned address in the segment.
template <class Word = std::uint64_t>
[[nodiscard]] inline AtomicWord<Word> word(std::byte* at) noexcept {
  return AtomicWord<Word>(*reinterpret_cast<Word*>(at));
}

/// Writer: from here until `close`, the data under `version` is inconsistent.
inline void open(std::byte* version, std::uint64_t odd) noexcept {
  word(version).store(odd, std::memory_order_relaxed);
  fence(std::memory_order_release);
}
inline void close(std::byte* version, std::uint64_t even) noexcept {
  word(version).store(even, std::memory_order_release);
}

/// Writer: copies `bytes` (a multiple of 8) into the segment.
inline void store(std::byte* to, const void* from, std::size_t bytes) noexcept {
  const auto* source = static_cast<const std::byte*>(from);
  for (std::size_t i = 0; i < bytes; i += 8) {
    std::uint64_t value = 0;
    std::memcpy(&value, source + i, 8);
    word(to + i).store(value, kDataStore);
  }
}

/// Reader: copies `bytes` (a multiple of 8) out of the segment. The copy is consistent only if
/// `unchanged` then returns true.
inline void load(void* to, std::byte* from, std::size_t bytes) noexcept {
  auto* target = static_cast<std::byte*>(to);
  for (std::size_t i = 0; i < bytes; i += 8) {
    const std::uint64_t value = word(from + i).load(kDataLoad);
    std::memcpy(target + i, &value, 8);
  }
}

/// Reader: true if nothing was written under `version` since its load (acquire) returned `seen`.
[[nodiscard]] inline bool unchanged(std::byte* version, std::uint64_t seen) noexcept {
  fence(std::memory_order_acquire);
  return word(version).load(std::memory_order_relaxed) == seen;
}

}  // namespace shared_words

/// The writer's side of a ring of records in the segment. Its counter is private: the segment is
/// never read back. Record i lies in slot i mod slots and has version 2 i + 2. One thread.
template <class Record>
struct RecordRing {
  std::byte* slots = nullptr;
  std::byte* head = nullptr;
  std::uint64_t mask = 0;       ///< slots - 1
  std::uint64_t published = 0;  ///< index of the next record

  void push(const Record& record) noexcept {
    std::byte* const slot = slots + (published & mask) * sizeof(Record);
    shared_words::open(slot, 2 * published + 1);
    shared_words::store(slot + 8, reinterpret_cast<const std::byte*>(&record) + 8,
                        sizeof(Record) - 8);
    shared_words::close(slot, 2 * published + 2);
    shared_words::word(head).store(++published, std::memory_order_release);
  }

  /// Sets the index of the next record, unless it would decrease. Skipped records are never
  /// written: their slots get the odd version of the next round, which readers report as
  /// `ReadState::overrun`.
  void skip_to(std::uint64_t index) noexcept {
    if (index <= published) return;
    const std::uint64_t round = mask + 1;
    for (std::uint64_t i = std::max(published, index - std::min(index, round)); i < index; ++i) {
      shared_words::open(slots + (i & mask) * sizeof(Record), 2 * (i + round) + 1);
    }
    published = index;
  }
};

/// The rings of tick records of the segment at `base`, one per arm. If there is one arm, `slots` of
/// the second is null.
[[nodiscard]] inline std::array<RecordRing<TickRecord>, kMaxArms> tick_rings(
    std::byte* base, const SegmentHeader& header) noexcept {
  std::array<RecordRing<TickRecord>, kMaxArms> rings;
  rings[0].slots = base + header.off_state;
  rings[0].head = base + offsetof(SegmentHeader, state_head);
  if (header.off_state_2 != 0) {
    rings[1].slots = base + header.off_state_2;
    rings[1].head = base + offsetof(SegmentHeader, state_head_2);
  }
  for (auto& ring : rings) ring.mask = header.state_slots - 1;
  return rings;
}

}  // namespace kerf
