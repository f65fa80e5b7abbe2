// SPDX-License-Identifier: Apache-2.0
#include "hil/front/hello_link.hpp"

namespace kerf {

HelloLink::HelloLink(PacketLink& client, const Hello& own)
    : PacketLink(client.descriptor()), client_(client), own_(own) {}

std::span<const std::uint8_t> HelloLink::take(std::span<std::uint8_t> buffer) noexcept {
  const auto packet = client_.take(buffer);
  closed_ = client_.closed();
  if (packet.empty() || !greets_) return packet;
  const auto hello = decode_hello(packet);
  greets_ = hello.has_value();
  if (!greets_) return packet;
  static_cast<void>(client_.send(encode(own_)));
  refusal_ = discord(*hello, own_);
  if (!refusal_.empty()) {
    closed_ = true;
  } else if (!last_.empty()) {
    static_cast<void>(client_.send(last_));
  }
  return {};
}

PacketLink::Sent HelloLink::send(std::span<const std::uint8_t> packet) noexcept {
  if (greets_) last_.assign(packet.begin(), packet.end());
  const Sent sent = client_.send(packet);
  closed_ = closed_ || client_.closed();
  return sent;
}

}  // namespace kerf
