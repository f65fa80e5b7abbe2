// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <utility>

namespace kerf {

/// What will happen in a later bus cycle: answers on their way, time-outs, scripted faults. Things
/// of one cycle happen in the order in which they were entered.
class Agenda {
 public:
  static constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();

  void at(std::int64_t cycle, std::function<void()> action) {
    entries_.emplace(cycle, std::move(action));
  }
  [[nodiscard]] std::int64_t next() const noexcept {
    return entries_.empty() ? kNever : entries_.begin()->first;
  }
  /// Does what is due up to and in `cycle`, in order; what these actions add too, if it is due.
  void run(std::int64_t cycle) {
    while (next() <= cycle) entries_.extract(entries_.begin()).mapped()();
  }

 private:
  std::multimap<std::int64_t, std::function<void()>> entries_;
};

}  // namespace kerf
