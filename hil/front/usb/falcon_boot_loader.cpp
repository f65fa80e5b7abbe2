// SPDX-License-Identifier: Apache-2.0
#include "hil/front/usb/falcon_boot_loader.hpp"

namespace kerf {

void FalconBootLoader::set_divisor(std::uint16_t divisor) noexcept {
  divisor_ = divisor;
  if (state_ == State::loading && divisor == falcon::kRunDivisor && stored_ > 0) {
    state_ = State::running;
  }
}

void FalconBootLoader::set_dtr(bool high) noexcept {
  const bool listens = !running() || divisor_ == falcon::kBootDivisor;
  if (high && !dtr_ && listens) {
    state_ = State::greeting;
    greeted_ = 0;
    stored_ = 0;
  }
  dtr_ = high;
}

void FalconBootLoader::take(std::uint8_t byte, std::deque<std::uint8_t>& line) {
  switch (state_) {
    case State::asleep:
    case State::running:
      return;
    case State::greeting:
    case State::waiting:
      if (state_ == State::waiting && divisor_ == falcon::kUploadDivisor && !dtr_ &&
          byte == falcon::kUploadBegin[0]) {
        state_ = State::loading;
        line.push_back(byte);
        return;
      }
      return hear_greeting(byte, line);
    case State::loading:
      line.push_back(stored_++ == wrong_echo_at_ ? static_cast<std::uint8_t>(byte ^ 1) : byte);
      return;
  }
}

/// Answered as often as it comes: hosts say it again where a read that was under way took the
/// answer.
void FalconBootLoader::hear_greeting(std::uint8_t byte, std::deque<std::uint8_t>& line) {
  if (divisor_ != falcon::kBootDivisor || byte != falcon::kBootHello[greeted_]) {
    greeted_ = 0;
    return;
  }
  if (++greeted_ < falcon::kBootHello.size()) return;
  greeted_ = 0;
  if (state_ == State::greeting) line.push_back(0);  // some units begin so: hosts have to bear it
  line.insert(line.end(), falcon::kBootHelloReply.begin(), falcon::kBootHelloReply.end());
  state_ = State::waiting;
}

}  // namespace kerf
