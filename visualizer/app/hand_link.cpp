// SPDX-License-Identifier: Apache-2.0
#include "visualizer/app/hand_link.hpp"

#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "visualizer/error.hpp"

namespace kerf {

namespace {

constexpr auto kTryPause = std::chrono::milliseconds(500);
constexpr auto kPatience = std::chrono::seconds(3);  // an emulator that starts beside the window

sockaddr_un address_of(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  return address;
}

}  // namespace

HandLink::HandLink(std::string path) : path_(std::move(path)) {
  constexpr std::size_t kLongest = sizeof(sockaddr_un::sun_path) - 1;
  if (path_.empty() || path_.size() > kLongest) {
    throw VisualizerError("--hand-socket: " + path_ + " has " + std::to_string(path_.size()) +
                          " bytes; use 1 to " + std::to_string(kLongest));
  }
}

HandLink::~HandLink() {
  leave();
}

void HandLink::leave() noexcept {
  if (fd_ >= 0) close(fd_);
  fd_ = -1;
}

void HandLink::connect() noexcept {
  fd_ = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd_ < 0) return;
  const sockaddr_un address = address_of(path_);
  if (::connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) leave();
}

HandLink::State HandLink::heard() noexcept {
  std::array<std::uint8_t, 64> bytes;
  const ssize_t size = recv(fd_, bytes.data(), bytes.size(), MSG_DONTWAIT);
  if (size < 0 && (errno == EAGAIN || errno == EINTR)) return state_;
  if (size <= 0) return State::absent;
  const auto greeting = decode_hand_greeting({bytes.data(), static_cast<std::size_t>(size)});
  if (!greeting) return State::stranger;
  return *greeting == HandGreeting::yours ? State::leads : State::taken;
}

std::optional<Notice> HandLink::turned(State state) {
  const bool had_it = told_ == State::leads;
  told_ = state;
  switch (state) {
    case State::leads:
      return Notice{"the hand is yours: move the pointer; left button: press; h: all keys"};
    case State::taken:
      return Notice{"hand: another window leads it; close that one, or only watch here", true};
    case State::stranger:
      return Notice{"hand: " + path_ + " is no kerf-emulator of this version; build both anew",
                    true};
    case State::absent:
      return Notice{
          had_it ? "hand: the emulator has gone; waiting for it at " + path_
                 : "hand: nobody at " + path_ + "; start kerf-emulator with --hand-socket " + path_,
          true};
    case State::asked:
      break;
  }
  return std::nullopt;
}

std::optional<Notice> HandLink::step(Clock::time_point now) {
  if (!began_) began_ = now;
  if (fd_ < 0 && now >= next_try_) {
    next_try_ = now + kTryPause;
    connect();
    if (fd_ >= 0) {
      state_ = State::asked;
    } else if (state_ != State::taken || errno == ENOENT || errno == ECONNREFUSED) {
      state_ = State::absent;
    }
  }
  if (fd_ >= 0) {
    state_ = heard();
    if (state_ != State::asked && state_ != State::leads) leave();
  }
  const bool in_vain =
      state_ == State::absent && (told_ == State::leads || now - *began_ >= kPatience);
  const bool news = state_ == State::absent ? in_vain : state_ != State::asked;
  return news && state_ != told_ ? turned(state_) : std::nullopt;
}

void HandLink::send(const HandWish& wish) noexcept {
  if (!leads()) return;
  const HandWishBytes bytes = encode(wish);
  // A full socket is one whose emulator stands still: it takes the newest wish once it goes on.
  static_cast<void>(::send(fd_, bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL));
}

}  // namespace kerf
