// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <memory>
#include <string>

#include "controller/device/port/io_mailbox.hpp"
#include "controller/device/port/packet_port.hpp"
#include "shared/wire/emulator_link.hpp"
#include "shared/wire/personality.hpp"

// The port that `--port` names, and the handshake with an emulator.

namespace kerf {

/// Handshake with the emulator behind `port` (shared/wire/emulator_link.hpp): sends the setup of
/// this side, and reads that of the emulator; earlier packets of its device are dropped.
/// `is_lossy`: a hello may get lost, and is repeated.
///
/// Throws std::runtime_error with one line, which begins with `location`, if the two do not fit,
/// the link closes, or no answer comes for `patience_ms` or until `stop`.
void agree(PacketPort& port, const std::string& location, const LinkHello& ours, bool is_lossy,
           int patience_ms, const std::atomic<bool>& stop);

/// The port that `--port` names:
///
///     socket:PATH                    an emulator's SEQPACKET socket
///     udp:[ADDRESS:]PORT             an emulator on another machine
///     fw[:WHERE][,OPTION...]         FireWire: FirewireOptions
///     usb[:WHERE][,firmware=FILE]    the Falcon: UsbOptions
///     hid[:WHERE]                    WoodenHaptics: parse_hid_port
///     arm[:NAME]                     Inverse3, Touch, omega: kerf-arm of that name: parse_arm_port
///     auto                           the bus of the device, any connected one
///
/// This throws std::runtime_error with one line for a text that names no port, or one that this
/// build lacks; the others throw for such a text too.
void check_port(const std::string& text);

/// Replaces `auto` by the bus of this device; any other text is returned. Throws for the bus of
/// another device.
[[nodiscard]] std::string resolve_port(const std::string& text, Personality personality);

/// Opens a resolved port; `io` is for ports with threads of their own. `starts_kerf_arm`: for `arm`
/// without a name starts kerf-arm if none runs. Retries for `patience_ms`
/// while no device is connected, or until `stop`; the handshake with an emulator may take as long
/// again.
[[nodiscard]] std::unique_ptr<PacketPort> open_port(const std::string& text, const LinkHello& ours,
                                                    int patience_ms, const std::atomic<bool>& stop,
                                                    IoThread io = {}, bool starts_kerf_arm = false);

}  // namespace kerf
