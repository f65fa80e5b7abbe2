// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace kerf::bridge {

/// Whether `host` is an address, IPv4 or IPv6 without brackets, not a name.
[[nodiscard]] bool is_address(const std::string& host) noexcept;

/// Whether what is sent to `host` never leaves this machine, by its text alone.
[[nodiscard]] bool is_loopback(std::string_view host) noexcept;

/// This machine's name; empty where it has none.
[[nodiscard]] std::string machine_name();

/// Its addresses that others may reach and loopback's: IPv4 and global IPv6, as text.
[[nodiscard]] std::vector<std::string> own_addresses();

/// Name, name.local, localhost and addresses: by what a browser may call it.
[[nodiscard]] std::vector<std::string> own_hosts();

}  // namespace kerf::bridge
