// SPDX-License-Identifier: Apache-2.0
#include "bridge/net/tls_keys.hpp"

#include "bridge/net/bridge_error.hpp"

namespace kerf::bridge {

TlsKeys load_tls_keys(const std::filesystem::path& folder) {
  throw BridgeError("--identity " + folder.string() + ": not built yet");
}

TlsKeys self_signed_keys(const std::vector<std::string>&) {
  throw BridgeError("TLS: not built yet");
}

}  // namespace kerf::bridge
