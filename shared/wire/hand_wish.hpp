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

#include "shared/numeric/vec.hpp"
#include "shared/wire/little_endian.hpp"

namespace kerf {

/// Where a user who leads the emulated hand wants it to be: what a window tells kerf-emulator
/// (`--hand-socket`) in each of its frames, one wish a packet. Whole numbers, so that every packet
/// of the right length names a place within the limits below; what the hand makes of it, and what
/// it does when no wish comes any more, is `GuidedHand`'s.
struct HandWish {
  DeviceVec<double> tip_mm;                 ///< in steps of 1 um, each axis up to kMaxWishMm
  std::array<double, 3> orientation_rad{};  ///< as of `HandGoal`, up to kMaxWishRad each
  bool button1 = false, button2 = false;
  bool park = false;  ///< go to the rest pose, stay there a moment, and come back
  friend bool operator==(const HandWish&, const HandWish&) noexcept = default;
};

inline constexpr double kMaxWishMm = 500;  ///< from the device's origin: no arm of these is longer
inline constexpr double kMaxWishRad = std::numbers::pi / 3;  ///< a wrist bends no further

inline constexpr std::size_t kHandWishBytes = 36;
using HandWishBytes = std::array<std::uint8_t, kHandWishBytes>;
// The last byte is the version.
inline constexpr std::array<std::uint8_t, 8> kHandWishMagic{'k', 'e', 'r', 'f', 0, 'h', 'w', 1};

/// What the emulator says first to one that connects: the same version, and whether the hand is its
/// to lead. One leads at a time; to another `taken` is said, and the connection closed.
enum class HandGreeting : std::uint8_t { yours, taken };
using HandGreetingBytes = std::array<std::uint8_t, 9>;

[[nodiscard]] inline HandWishBytes encode(const HandWish& wish) noexcept {
  constexpr double kSteps = 1e6;  // urad per rad; mm become um with a thousandth of it
  const auto steps = [](double value, double most, double per_unit) {
    const double within = value == value ? std::clamp(value, -most, most) : 0.0;
    return static_cast<std::uint32_t>(static_cast<std::int32_t>(std::lround(within * per_unit)));
  };
  HandWishBytes bytes{};
  std::copy(kHandWishMagic.begin(), kHandWishMagic.end(), bytes.begin());
  const std::array<double, 3> tip{wish.tip_mm.x, wish.tip_mm.y, wish.tip_mm.z};
  for (std::size_t i = 0; i < 3; ++i) {
    wire::put_u32(bytes, 8 + 4 * i, steps(tip[i], kMaxWishMm, kSteps / 1000));
    wire::put_u32(bytes, 20 + 4 * i, steps(wish.orientation_rad[i], kMaxWishRad, kSteps));
  }
  bytes[32] = static_cast<std::uint8_t>((wish.button1 ? 1 : 0) | (wish.button2 ? 2 : 0) |
                                        (wish.park ? 4 : 0));
  return bytes;
}

/// Nothing for what is no wish of this version. Numbers beyond the limits are taken as the limits.
[[nodiscard]] inline std::optional<HandWish> decode_hand_wish(
    std::span<const std::uint8_t> bytes) noexcept {
  if (bytes.size() != kHandWishBytes ||
      !std::equal(kHandWishMagic.begin(), kHandWishMagic.end(), bytes.begin()) || bytes[32] > 7) {
    return std::nullopt;
  }
  const auto value = [&](std::size_t at, double most, double unit) {
    const auto steps = static_cast<std::int32_t>(wire::get_u32(bytes, at));
    return std::clamp(steps * unit, -most, most);
  };
  HandWish wish;
  wish.tip_mm = {value(8, kMaxWishMm, 1e-3), value(12, kMaxWishMm, 1e-3),
                 value(16, kMaxWishMm, 1e-3)};
  for (std::size_t i = 0; i < 3; ++i) {
    wish.orientation_rad[i] = value(20 + 4 * i, kMaxWishRad, 1e-6);
  }
  wish.button1 = (bytes[32] & 1) != 0;
  wish.button2 = (bytes[32] & 2) != 0;
  wish.park = (bytes[32] & 4) != 0;
  return wish;
}

[[nodiscard]] inline HandGreetingBytes encode(HandGreeting greeting) noexcept {
  HandGreetingBytes bytes{};
  std::copy(kHandWishMagic.begin(), kHandWishMagic.end(), bytes.begin());
  bytes[8] = static_cast<std::uint8_t>(greeting);
  return bytes;
}

/// Nothing for another version's.
[[nodiscard]] inline std::optional<HandGreeting> decode_hand_greeting(
    std::span<const std::uint8_t> bytes) noexcept {
  if (bytes.size() != HandGreetingBytes{}.size() ||
      !std::equal(kHandWishMagic.begin(), kHandWishMagic.end(), bytes.begin()) || bytes[8] > 1) {
    return std::nullopt;
  }
  return static_cast<HandGreeting>(bytes[8]);
}

}  // namespace kerf
