// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace kerf {

/// What a port looks for.
struct SoughtDevice {
  std::string_view name;
  std::string_view port;       ///< word of `--port`
  std::string_view emulation;  ///< options of ./kerf demo that emulate it
};

/// The one text of all ports for a device that is not there, without its place: of the node that
/// was named, or of any device, where a serial number was named of that one.
[[nodiscard]] inline std::string absent_node(const SoughtDevice& sought) {
  return "no such node; --port " + std::string(sought.port) + " finds the device by itself";
}
[[nodiscard]] inline std::string absent_device(const SoughtDevice& sought, bool serial_named) {
  return "no " + std::string(sought.name) + (serial_named ? " with this serial number" : "") +
         " is there; connect one, or try ./kerf demo " + std::string(sought.emulation);
}
/// Where `where`, as the user gave it, is a node, a serial number or nothing.
[[nodiscard]] inline std::string absent_text(const SoughtDevice& sought, std::string_view where) {
  if (where.find('/') != std::string_view::npos) return absent_node(sought);
  return absent_device(sought, !where.empty());
}

}  // namespace kerf
