// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <string>

#include "controller/device/port/socket_port.hpp"

namespace kerf {

/// A packet port over UDP, to an emulator on another machine: each datagram is one packet. What the
/// network loses, delays or repeats is a lost, late or repeated packet to the driver. An empty
/// datagram is its greeting, and its goodbye.
///
/// Nothing is proved of the other end but its address: for networks where nobody else sends.
class UdpPort final : public SocketPort {
 public:
  /// `where` as resolve_udp takes it. Tries for `patience_ms` while the other machine refuses, or
  /// until `stop`; one that is silent is taken for a device that waits for its host. Throws
  /// std::runtime_error with one line.
  UdpPort(const std::string& where, int patience_ms, const std::atomic<bool>& stop);
  ~UdpPort() override;
};

}  // namespace kerf
