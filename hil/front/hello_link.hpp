// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "hil/front/serving.hpp"
#include "shared/wire/hello.hpp"

namespace kerf {

/// The way to a client that may say hello before its first packet (hello.hpp). Each hello is
/// answered, since UDP may lose an answer, and what the device said last is said again after it, so
/// that a lock-step session begins with its first report. One that does not fit is answered too,
/// and closes the link. A client that says none is served all the same.
class HelloLink final : public PacketLink {
 public:
  /// `client` outlives it.
  HelloLink(PacketLink& client, const Hello& own);

  [[nodiscard]] std::span<const std::uint8_t> take(
      std::span<std::uint8_t> buffer) noexcept override;
  [[nodiscard]] Sent send(std::span<const std::uint8_t> packet) noexcept override;

  /// Why the client was refused; empty: it was not.
  [[nodiscard]] const std::string& refusal() const noexcept { return refusal_; }

 private:
  PacketLink& client_;
  Hello own_;
  bool greets_ = true;              ///< the client has said nothing else yet
  std::vector<std::uint8_t> last_;  ///< of the device, while it greets
  std::string refusal_;
};

}  // namespace kerf
