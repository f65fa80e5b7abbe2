// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

/// The Haply Inverse3 behind its vendor's Inverse Service: constants of the service's public pages
/// (documentation of versions 3.0 to 3.5), and one choice of ours. JSON over a WebSocket; m, N,
/// unit quaternions by name.
///
/// Frame of the service: X right, Y away from the user, Z up, about the device's mounting plate.
/// Driver (controller/device/inverse3) and emulated service (hil/front/inverse3) each turn it into
/// kerf's with code of their own, so that a wrong sign cannot cancel.
namespace kerf::inverse3 {

inline constexpr std::uint16_t kServicePort = 10001;  ///< WebSocket and HTTP, since 3.1
inline constexpr std::uint16_t kEventPort = 10020;

/// Origin of kerf's frame in that of the service, m. Ours: about the middle of the workspace, at
/// the user's side of the device. `device.offset_mm` of a scene moves it for an owner.
inline constexpr std::array<double, 3> kOriginM{0.0, -0.13, 0.2};

/// Longest message of the service that the driver reads, and how deep it may be nested.
inline constexpr std::size_t kMostMessageBytes = std::size_t{64} << 10;
inline constexpr std::size_t kMostLevels = 16;

/// The group of each kind of handle in a message.
inline constexpr std::array<std::string_view, 3> kHandleGroups{"verse_grip", "wireless_verse_grip",
                                                               "custom_verse_grip"};

}  // namespace kerf::inverse3
