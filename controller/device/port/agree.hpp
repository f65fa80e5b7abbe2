// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <string>

#include "controller/device/port/packet_port.hpp"
#include "shared/wire/hello.hpp"

namespace kerf {

/// Says to the emulator at the other end of `port` what this side is set up for, and hears what it
/// is (hello.hpp); what its device said before is dropped. `is_lossy`: a hello may get lost, and is
/// said again.
///
/// Throws std::runtime_error with one line, which begins with `place`, where the two do not fit,
/// the link closes, or nobody answers for `patience_ms` or until `stop`.
void agree(PacketPort& port, const std::string& place, const Hello& ours, bool is_lossy,
           int patience_ms, const std::atomic<bool>& stop);

}  // namespace kerf
