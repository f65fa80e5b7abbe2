// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <memory>
#include <string>

#include "controller/device/port/io_thread.hpp"
#include "controller/device/port/packet_port.hpp"
#include "shared/wire/hello.hpp"
#include "shared/wire/personality.hpp"

namespace kerf {

/// The port that `--port` names:
///
///     socket:PATH                    an emulator's SEQPACKET socket
///     udp:[ADDRESS:]PORT             an emulator on another machine
///     fw[:WHERE][,OPTION...]         FireWire, as firewire_find.hpp says
///     usb[:WHERE][,firmware=FILE]    the Falcon, as usb_falcon.hpp says
///     hid[:WHERE]                    WoodenHaptics, as hid_port.hpp says
///     auto                           the bus of the device, any one that is there
///
/// Those that take such a text throw std::runtime_error with one line.

/// For a text that names no port, or one that this build lacks.
void check_port(const std::string& text);

/// What stands for `auto` with this device; any other text as it is. Throws for another one's bus.
[[nodiscard]] std::string resolve_port(const std::string& text, Personality personality);

/// A resolved one; `io`: of those with threads of their own. Tries for `patience_ms` while no
/// device is there, or until `stop`; an emulator is then asked whether it fits `ours`, for as long
/// again.
[[nodiscard]] std::unique_ptr<PacketPort> open_port(const std::string& text, const Hello& ours,
                                                    int patience_ms, const std::atomic<bool>& stop,
                                                    IoThread io = {});

}  // namespace kerf
