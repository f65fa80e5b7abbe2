// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <optional>
#include <span>
#include <string>

#include "shared/numeric/vec.hpp"
#include "shared/wire/little_endian.hpp"
#include "shared/wire/personality.hpp"

// Messages on kerf's own links to the emulator: hello, lock-step turn, target of the emulated hand.

namespace kerf {

/// Settings of one side of kerf's own links (SEQPACKET, UDP). The controller sends its hello first,
/// and the emulator answers with its own; the controller drops the device's packets before that
/// answer. A host that sends no hello is served too: no packet of a device has the length of a
/// hello, so the two cannot be confused. Real buses carry no hello.
struct LinkHello {
  Personality personality{};
  bool lockstep = false;
  int rate_hz = 1000;  ///< of the servo; of an emulator in real time, that of its packets
  friend bool operator==(const LinkHello&, const LinkHello&) noexcept = default;
};

inline constexpr std::size_t kHelloBytes = 20;
using HelloBytes = std::array<std::uint8_t, kHelloBytes>;
// The last byte is the version: a hello of another version gets no answer.
inline constexpr std::array<std::uint8_t, 8> kHelloMagic{'k', 'e', 'r', 'f', 0, 'h', 'i', 1};

[[nodiscard]] constexpr HelloBytes encode(const LinkHello& hello) noexcept {
  HelloBytes bytes{};
  std::copy(kHelloMagic.begin(), kHelloMagic.end(), bytes.begin());
  bytes[8] = static_cast<std::uint8_t>(hello.personality);
  bytes[9] = hello.lockstep ? 1 : 0;
  wire::put_u32(bytes, 12, static_cast<std::uint32_t>(hello.rate_hz));
  return bytes;
}

/// nullopt for any other packet.
[[nodiscard]] constexpr std::optional<LinkHello> decode_hello(
    std::span<const std::uint8_t> bytes) noexcept {
  if (bytes.size() != kHelloBytes) return std::nullopt;
  if (!std::equal(kHelloMagic.begin(), kHelloMagic.end(), bytes.begin())) return std::nullopt;
  constexpr std::uint32_t kFastestHz = 8000;
  const std::uint32_t rate_hz = wire::get_u32(bytes, 12);
  if (bytes[8] >= kPersonalityWords.size() || bytes[9] > 1 || rate_hz > kFastestHz) {
    return std::nullopt;
  }
  const LinkHello hello{static_cast<Personality>(bytes[8]), bytes[9] == 1,
                        static_cast<int>(rate_hz)};
  const HelloBytes same = encode(hello);
  if (!std::equal(same.begin(), same.end(), bytes.begin())) return std::nullopt;
  return hello;
}

/// One line for the user of either program: why the two settings do not fit, and what to change.
/// Empty if they fit. In real time the rates may differ.
[[nodiscard]] inline std::string discord(const LinkHello& controller, const LinkHello& emulator) {
  const auto word = [](const LinkHello& hello) { return std::string(word_of(hello.personality)); };
  const auto hz = [](const LinkHello& hello) { return std::to_string(hello.rate_hz); };
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

/// All packets of a device in one tick of a lock-step run, as one datagram: the magic, then each
/// packet behind a byte with its length. If a fault withholds packets, a turn without packets keeps
/// both sides running.
///
/// No packet of a supported device begins with the magic.
class Turn {
 public:
  static constexpr std::array<std::uint8_t, 8> kMagic{'k', 'e', 'r', 'f', 0, 't', 'n', 1};
  /// Longest turn: room for 15 packets of 64 bytes, more than a device sends in a tick.
  static constexpr std::size_t kMostBytes = 1024;

  Turn() noexcept { std::copy(kMagic.begin(), kMagic.end(), bytes_.begin()); }

  /// Appends a packet. Returns false if there is no room, or if it is empty or above 255 bytes.
  bool add(std::span<const std::uint8_t> packet) noexcept {
    if (packet.empty() || packet.size() > 255 || size_ + 1 + packet.size() > kMostBytes)
      return false;
    bytes_[size_] = static_cast<std::uint8_t>(packet.size());
    std::copy(packet.begin(), packet.end(),
              bytes_.begin() + static_cast<std::ptrdiff_t>(size_ + 1));
    size_ += 1 + packet.size();
    return true;
  }
  [[nodiscard]] std::span<const std::uint8_t> bytes() const noexcept {
    return std::span(bytes_).first(size_);
  }

  [[nodiscard]] static bool is_turn(std::span<const std::uint8_t> bytes) noexcept {
    return bytes.size() >= kMagic.size() && std::equal(kMagic.begin(), kMagic.end(), bytes.begin());
  }
  /// Removes the first packet from `rest`, the bytes after the magic, and returns it. Empty at the
  /// end, or if a packet's length exceeds `rest`.
  [[nodiscard]] static std::span<const std::uint8_t> next(
      std::span<const std::uint8_t>& rest) noexcept {
    if (rest.empty() || rest.size() - 1 < rest[0]) return {};
    const auto packet = rest.subspan(1, rest[0]);
    rest = rest.subspan(1 + packet.size());
    return packet;
  }

 private:
  std::array<std::uint8_t, kMostBytes> bytes_{};
  std::size_t size_ = kMagic.size();
};

/// Target of the emulated hand when a user guides it. A window sends one per frame to kerf-emulator
/// (`--hand-socket`), each in a packet of its own. The packet holds integers and the receiver
/// clamps them, so a target is always finite and within the limits below. `GuidedHand` moves the
/// hand towards it, and handles targets that stop.
struct HandTarget {
  DeviceVec<double> tip_mm;                 ///< in steps of 1 um, each axis up to kMaxTargetMm
  std::array<double, 3> orientation_rad{};  ///< as in `HandGoal`, up to kMaxTargetRad each
  bool button1 = false, button2 = false;
  bool park = false;  ///< go to the rest pose, stay there a moment, come back
  friend bool operator==(const HandTarget&, const HandTarget&) noexcept = default;
};

inline constexpr double kMaxTargetMm = 500;  ///< from the device's origin; no arm is longer
inline constexpr double kMaxTargetRad = std::numbers::pi / 3;  ///< a wrist bends no further

inline constexpr std::size_t kHandTargetBytes = 36;
using HandTargetBytes = std::array<std::uint8_t, kHandTargetBytes>;
// The last byte is the version.
inline constexpr std::array<std::uint8_t, 8> kHandTargetMagic{'k', 'e', 'r', 'f', 0, 'h', 'w', 1};

/// First message of the emulator to a new client: the version, and whether the client may guide the
/// hand. Only one client may at a time; any other gets `taken`, and its connection is closed.
enum class HandGreeting : std::uint8_t { yours, taken };
using HandGreetingBytes = std::array<std::uint8_t, 9>;

[[nodiscard]] inline HandTargetBytes encode(const HandTarget& target) noexcept {
  constexpr double kSteps = 1e6;  // urad per rad; um per mm is a thousandth of it
  const auto steps = [](double value, double most, double per_unit) {
    const double within = value == value ? std::clamp(value, -most, most) : 0.0;
    return static_cast<std::uint32_t>(static_cast<std::int32_t>(std::lround(within * per_unit)));
  };
  HandTargetBytes bytes{};
  std::copy(kHandTargetMagic.begin(), kHandTargetMagic.end(), bytes.begin());
  const std::array<double, 3> tip{target.tip_mm.x, target.tip_mm.y, target.tip_mm.z};
  for (std::size_t i = 0; i < 3; ++i) {
    wire::put_u32(bytes, 8 + 4 * i, steps(tip[i], kMaxTargetMm, kSteps / 1000));
    wire::put_u32(bytes, 20 + 4 * i, steps(target.orientation_rad[i], kMaxTargetRad, kSteps));
  }
  bytes[32] = static_cast<std::uint8_t>((target.button1 ? 1 : 0) | (target.button2 ? 2 : 0) |
                                        (target.park ? 4 : 0));
  return bytes;
}

/// nullopt for a packet of another kind or version. Clamps numbers to the limits.
[[nodiscard]] inline std::optional<HandTarget> decode_hand_target(
    std::span<const std::uint8_t> bytes) noexcept {
  if (bytes.size() != kHandTargetBytes ||
      !std::equal(kHandTargetMagic.begin(), kHandTargetMagic.end(), bytes.begin()) ||
      bytes[32] > 7) {
    return std::nullopt;
  }
  const auto value = [&](std::size_t at, double most, double unit) {
    const auto steps = static_cast<std::int32_t>(wire::get_u32(bytes, at));
    return std::clamp(steps * unit, -most, most);
  };
  HandTarget target;
  target.tip_mm = {value(8, kMaxTargetMm, 1e-3), value(12, kMaxTargetMm, 1e-3),
                   value(16, kMaxTargetMm, 1e-3)};
  for (std::size_t i = 0; i < 3; ++i) {
    target.orientation_rad[i] = value(20 + 4 * i, kMaxTargetRad, 1e-6);
  }
  target.button1 = (bytes[32] & 1) != 0;
  target.button2 = (bytes[32] & 2) != 0;
  target.park = (bytes[32] & 4) != 0;
  return target;
}

[[nodiscard]] inline HandGreetingBytes encode(HandGreeting greeting) noexcept {
  HandGreetingBytes bytes{};
  std::copy(kHandTargetMagic.begin(), kHandTargetMagic.end(), bytes.begin());
  bytes[8] = static_cast<std::uint8_t>(greeting);
  return bytes;
}

/// nullopt for another version.
[[nodiscard]] inline std::optional<HandGreeting> decode_hand_greeting(
    std::span<const std::uint8_t> bytes) noexcept {
  if (bytes.size() != HandGreetingBytes{}.size() ||
      !std::equal(kHandTargetMagic.begin(), kHandTargetMagic.end(), bytes.begin()) ||
      bytes[8] > 1) {
    return std::nullopt;
  }
  return static_cast<HandGreeting>(bytes[8]);
}

}  // namespace kerf
