// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>

namespace kerf {

/// Whose turn it is on a line where a device answers each command once. A command that waits for
/// its turn can be replaced by a newer one; in the device's buffer it could only grow old.
///
/// Times in ns of any clock that goes forward. One thread.
class Turns {
 public:
  /// An answer that takes longer is taken for lost, and the turn is the host's again.
  static constexpr std::int64_t kPatienceNs = 4'000'000;

  [[nodiscard]] bool ours(std::int64_t now_ns) const noexcept {
    return unanswered_ == 0 || now_ns >= answer_due_ns_;
  }
  /// A command has left, in its turn or out of it.
  void sent(std::int64_t now_ns) noexcept {
    unanswered_ = ours(now_ns) ? 1 : unanswered_ + 1;
    answer_due_ns_ = now_ns + kPatienceNs;
  }
  /// An answer has come; or a command is known not to have arrived.
  void answered() noexcept { unanswered_ = std::max(unanswered_ - 1, 0); }

 private:
  int unanswered_ = 0;
  std::int64_t answer_due_ns_ = 0;
};

}  // namespace kerf
