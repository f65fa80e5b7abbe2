// SPDX-License-Identifier: Apache-2.0
#include "hil/front/hand_server.hpp"

#include <array>
#include <utility>

#include "shared/wire/hand_wish.hpp"

namespace kerf {
namespace {

constexpr std::int64_t kLookCycles = kCyclesPerSecond / 20;  // for another window: each 50 ms
constexpr int kMaxWishesPerLook = 16;  // a flooding window cannot hold the device

}  // namespace

void HandServer::look_for_windows() noexcept {
  auto newcomer = server_.accept_waiting();
  if (!newcomer) return;
  const bool taken = window_.has_value();
  static_cast<void>(newcomer->send(encode(taken ? HandGreeting::taken : HandGreeting::yours)));
  if (!taken) window_.emplace(std::move(*newcomer));
}

void HandServer::lead(Emulator& emulator, int cycles) noexcept {
  since_look_ += cycles;
  if (since_look_ >= kLookCycles && emulator.can_be_led()) {
    since_look_ = 0;
    look_for_windows();
  }
  if (!window_) return;
  std::array<std::uint8_t, kHandWishBytes + 1> buffer;  // a longer packet is seen to be wrong
  std::optional<HandWish> newest;
  for (int taken = 0; taken < kMaxWishesPerLook; ++taken) {
    const auto packet = window_->take(buffer);
    if (packet.empty()) break;
    const auto wish = decode_hand_wish(packet);
    ++(wish ? wishes_ : refused_);
    if (wish) newest = wish;
  }
  if (newest) emulator.wish(*newest);
  if (!window_->closed()) return;
  window_.reset();
  emulator.forsake();
}

}  // namespace kerf
