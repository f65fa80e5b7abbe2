// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

/// The Haply Inverse3 behind its vendor's Inverse Service: constants from the public documentation
/// of the service (versions 3.0 to 3.5), and one choice of ours. JSON over a WebSocket; m, N, unit
/// quaternions with named components.
///
/// Frame of the service: X right, Y away from the user, Z up; origin on the device's mounting
/// plate. Driver (arm/inverse3) and emulated service (hil/front/inverse3) convert it
/// to kerf's frame with separate code, so that a wrong sign in one is not hidden by the same one in
/// the other.
namespace kerf::inverse3 {

inline constexpr std::uint16_t kServicePort = 10001;  ///< WebSocket and HTTP, since 3.1
inline constexpr std::uint16_t kEventPort = 10020;

/// Origin of kerf's frame in the frame of the service, m. Our choice: about the middle of the
/// workspace, on the user's side of the device. `device.offset_mm` of a scene moves it.
inline constexpr std::array<double, 3> kOriginM{0.0, -0.13, 0.2};

/// Longest message of the service that the driver reads, and its deepest nesting.
inline constexpr std::size_t kMostMessageBytes = std::size_t{64} << 10;
inline constexpr std::size_t kMostLevels = 16;

/// Member of a message that lists the handles of one kind.
inline constexpr std::array<std::string_view, 3> kHandleGroups{"verse_grip", "wireless_verse_grip",
                                                               "custom_verse_grip"};

}  // namespace kerf::inverse3
