// SPDX-License-Identifier: Apache-2.0
#include "controller/device/open_port.hpp"

#include <optional>
#include <stdexcept>
#include <string_view>

#include "controller/device/firewire_port.hpp"
#include "controller/device/socket_port.hpp"

namespace kerf {
namespace {

constexpr std::string_view kSocket = "socket:";

/// What follows `fw`; nothing for another port.
std::optional<std::string_view> after_fw(std::string_view text) {
  if (text != "fw" && !text.starts_with("fw:") && !text.starts_with("fw,")) return std::nullopt;
  return text.substr(2);
}

}  // namespace

void check_port(const std::string& text) {
  if (const auto rest = after_fw(text)) {
    static_cast<void>(parse_firewire_port(*rest));
  } else if (!text.starts_with(kSocket)) {
    throw std::runtime_error("--port '" + text +
                             "' is not known; use fw, or socket:PATH, where kerf-emulator listens");
  }
}

std::unique_ptr<PacketPort> open_port(const std::string& text, int rate_hz, int patience_ms,
                                      const std::atomic<bool>& stop) {
  check_port(text);
  if (const auto rest = after_fw(text)) {
    FirewireOptions options = parse_firewire_port(*rest);
    options.rate_hz = rate_hz;
    return std::make_unique<FirewirePort>(options, patience_ms, stop);
  }
  return std::make_unique<SocketPort>(text.substr(kSocket.size()), patience_ms, stop);
}

}  // namespace kerf
