// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "shared/wire/little_endian.hpp"
#include "shared/wire/personality.hpp"

namespace kerf {

/// What one side of kerf's own links (SEQPACKET, UDP) is set up for. The controller says it before
/// anything else, and the emulator answers with its own; what the device said before that answer is
/// void. A host that is not kerf's says none, and is served as it is: no packet of a device or for
/// one has this length. Real buses carry no hello.
struct Hello {
  Personality personality{};
  bool lockstep = false;
  int rate_hz = 1000;  ///< of the servo; of an emulator in real time, that of its looks at the host
  friend bool operator==(const Hello&, const Hello&) noexcept = default;
};

inline constexpr std::size_t kHelloBytes = 20;
using HelloBytes = std::array<std::uint8_t, kHelloBytes>;
// The last byte is the version: another one's hello is none, and stays without an answer.
inline constexpr std::array<std::uint8_t, 8> kHelloMagic{'k', 'e', 'r', 'f', 0, 'h', 'i', 1};

[[nodiscard]] constexpr HelloBytes encode(const Hello& hello) noexcept {
  HelloBytes bytes{};
  std::copy(kHelloMagic.begin(), kHelloMagic.end(), bytes.begin());
  bytes[8] = static_cast<std::uint8_t>(hello.personality);
  bytes[9] = hello.lockstep ? 1 : 0;
  wire::put_u32(bytes, 12, static_cast<std::uint32_t>(hello.rate_hz));
  return bytes;
}

/// Nothing for any other packet.
[[nodiscard]] constexpr std::optional<Hello> decode_hello(
    std::span<const std::uint8_t> bytes) noexcept {
  if (bytes.size() != kHelloBytes) return std::nullopt;
  if (!std::equal(kHelloMagic.begin(), kHelloMagic.end(), bytes.begin())) return std::nullopt;
  constexpr std::uint32_t kFastestHz = 8000;
  const std::uint32_t rate_hz = wire::get_u32(bytes, 12);
  if (bytes[8] >= kPersonalityWords.size() || bytes[9] > 1 || rate_hz > kFastestHz) {
    return std::nullopt;
  }
  const Hello hello{static_cast<Personality>(bytes[8]), bytes[9] == 1, static_cast<int>(rate_hz)};
  const HelloBytes same = encode(hello);
  if (!std::equal(same.begin(), same.end(), bytes.begin())) return std::nullopt;
  return hello;
}

/// Why the two cannot work together, and what to change, as both tell it; empty: they can. In real
/// time each side keeps its own rate.
[[nodiscard]] inline std::string discord(const Hello& controller, const Hello& emulator) {
  const auto word = [](const Hello& hello) {
    return std::string(kPersonalityWords[static_cast<std::size_t>(hello.personality)]);
  };
  const auto hz = [](const Hello& hello) { return std::to_string(hello.rate_hz); };
  if (controller.personality != emulator.personality) {
    return "the controller wants a device " + word(controller) + ", the emulator is " +
           word(emulator) + "; start kerf-emulator with --personality " + word(controller) +
           ", or kerf-controller with --device " + word(emulator);
  }
  if (controller.lockstep && !emulator.lockstep) {
    return "the controller runs in lock-step, the emulator by its clock; start kerf-emulator with "
           "--lockstep --rate " +
           hz(controller) + ", or kerf-controller without --virtual";
  }
  if (emulator.lockstep && !controller.lockstep) {
    return "the emulator runs in lock-step, the controller by its clock; start kerf-controller "
           "with --virtual, or kerf-emulator without --lockstep";
  }
  if (controller.lockstep && controller.rate_hz != emulator.rate_hz) {
    return "lock-step at " + hz(controller) + " Hz in the controller, at " + hz(emulator) +
           " Hz in the emulator; start both with the same --rate";
  }
  return "";
}

}  // namespace kerf
