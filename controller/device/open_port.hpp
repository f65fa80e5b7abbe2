// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <memory>
#include <string>

#include "controller/device/packet_port.hpp"

namespace kerf {

/// The port that `--port` names:
///
///     socket:PATH             an emulator's SEQPACKET socket
///     fw[:WHERE][,OPTION...]  FireWire, as firewire_find.hpp says
///
/// Both throw std::runtime_error with one line.

/// For a text that names no port.
void check_port(const std::string& text);

/// Tries for `patience_ms` while no device is there, or until `stop`.
[[nodiscard]] std::unique_ptr<PacketPort> open_port(const std::string& text, int rate_hz,
                                                    int patience_ms, const std::atomic<bool>& stop);

}  // namespace kerf
