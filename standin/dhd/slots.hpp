// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace kerf::dhd {

/// The slots of a device in real time: each takes one force command, of whichever thread. They
/// begin with the first command and follow each other without a gap, so that commands and missed
/// slots together are all that have begun. Times in ns by any clock. One thread at a time.
class Slots {
 public:
  explicit Slots(std::int64_t period_ns) noexcept : period_ns_(period_ns) {}

  struct Slot {
    std::int64_t at_ns;   ///< when the command may leave; `now_ns` if its slot has begun
    std::int64_t missed;  ///< slots that are over without a command
  };

  /// The first slot that is neither over nor taken; it is taken then.
  [[nodiscard]] Slot take(std::int64_t now_ns) noexcept {
    if (!has_begun_) next_ns_ = now_ns;
    has_begun_ = true;
    const std::int64_t missed = now_ns > next_ns_ ? (now_ns - next_ns_) / period_ns_ : 0;
    const std::int64_t begins_ns = next_ns_ + missed * period_ns_;
    next_ns_ = begins_ns + period_ns_;
    return {begins_ns > now_ns ? begins_ns : now_ns, missed};
  }

 private:
  std::int64_t period_ns_;
  std::int64_t next_ns_ = 0;  ///< begin of the first slot that is not taken
  bool has_begun_ = false;
};

}  // namespace kerf::dhd
