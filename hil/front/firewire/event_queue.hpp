// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <deque>
#include <span>
#include <utility>
#include <vector>

namespace kerf {

/// Events of one open file, oldest first, each as the bytes that one read() returns.
///
/// As in the kernel there is no bound: a client that does not read grows it for ever. The
/// high-water mark shows that.
class EventQueue {
 public:
  using Bytes = std::vector<std::uint8_t>;

  /// `event` as it stands in memory, and then `data` from `data_offset` on; the event grows by the
  /// data's size, whatever padding it has.
  template <class Event>
  void push(const Event& event, std::span<const std::uint8_t> data = {},
            std::size_t data_offset = sizeof(Event)) {
    Bytes bytes(sizeof event + data.size());
    std::memcpy(bytes.data(), &event, sizeof event);
    if (!data.empty()) std::memcpy(&bytes[data_offset], data.data(), data.size());
    events_.push_back(std::move(bytes));
    high_water_ = std::max(high_water_, events_.size());
  }
  [[nodiscard]] Bytes pop() {
    Bytes bytes = std::move(events_.front());
    events_.pop_front();
    return bytes;
  }
  [[nodiscard]] bool empty() const noexcept { return events_.empty(); }
  [[nodiscard]] std::size_t high_water() const noexcept { return high_water_; }

 private:
  std::deque<Bytes> events_;
  std::size_t high_water_ = 0;
};

}  // namespace kerf
