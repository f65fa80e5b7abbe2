// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace kerf {

/// A SensAble device on FireWire, as the configuration ROM tells it. Its model is not in there: an
/// Omni cannot be told from its siblings.
struct FirewireDevice {
  std::string path;          ///< of its node
  std::uint32_t packed = 0;  ///< low word of the GUID
  std::string serial;        ///< the digits on the unit, unpacked from it
};

/// What `--port fw[:WHERE][,OPTION...]` says.
struct FirewireOptions {
  std::string where;  ///< a node, a folder of nodes, or a serial number; empty: /dev, any one
  bool write_20010 =
      false;           ///< "20010": write 0xF80F0000 to that register before streaming. Two open
                       ///< drivers contradict each other: needed, or harmful with two devices
  bool fill = false;   ///< "fill": keep the transmit queue filled with skipped cycles, instead of
                       ///< letting it run dry, which costs a cycle less but is unproved on some
                       ///< controllers
  int rate_hz = 1000;  ///< how often packets will be sent
};

/// Throws std::runtime_error with one line when `text`, what follows "fw", cannot be read.
[[nodiscard]] FirewireOptions parse_firewire_port(std::string_view text);

/// The serial number in its printed form; bit 0 has no meaning.
[[nodiscard]] std::string firewire_serial(std::uint32_t packed);

/// All devices of the vendor whose node can be opened. `refused` gets the errno of one that could
/// not.
[[nodiscard]] std::vector<FirewireDevice> list_firewire(const std::string& folder, int* refused);

/// The one that `options.where` means; a serial number is looked for in `folder`. Throws
/// std::runtime_error with one line when there is none, or more than one.
[[nodiscard]] FirewireDevice find_firewire(const FirewireOptions& options,
                                           const std::string& folder = "/dev");

}  // namespace kerf
