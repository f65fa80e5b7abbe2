// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>

#include "shared/segment/shared_words.hpp"

namespace kerf {

/// The writer's side of a ring of records in the segment, with a private counter: the segment is
/// never read back. Record i lies in slot i mod slots under the version 2 i + 2. One thread.
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

  /// Goes on at `index`, which grows: what lies between never comes. Their slots say so as if the
  /// record of the next round were being written, which readers take for `ReadState::overrun`.
  void skip_to(std::uint64_t index) noexcept {
    if (index <= published) return;
    const std::uint64_t round = mask + 1;
    for (std::uint64_t i = std::max(published, index - std::min(index, round)); i < index; ++i) {
      shared_words::open(slots + (i & mask) * sizeof(Record), 2 * (i + round) + 1);
    }
    published = index;
  }
};

}  // namespace kerf
