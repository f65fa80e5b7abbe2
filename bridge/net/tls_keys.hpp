// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace kerf::bridge {

/// What a server shows and what it proves it with.
struct TlsKeys {
  std::string chain_pem;  ///< its certificate, then those above it
  std::string key_pem;
  std::string fingerprint;         ///< SHA-256 of the certificate, hex with colons
  std::vector<std::string> names;  ///< DNS names that it holds for
};

/// From a folder of `make-identity`. Throws `BridgeError` where a file is missing, open to others,
/// damaged, out of date or not its partner's.
[[nodiscard]] TlsKeys load_tls_keys(const std::filesystem::path& folder);

/// Made now, for `hosts` (names and addresses); nobody vouches for it.
[[nodiscard]] TlsKeys self_signed_keys(const std::vector<std::string>& hosts);

}  // namespace kerf::bridge
