// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace kerf::bridge {

/// `kerf-bridge make-identity`.
struct IdentityOptions {
  std::filesystem::path folder;
  std::vector<std::string> hosts;  ///< names and addresses of the machine; empty: this one's
  int days = 825;
};

/// Makes DIR/ca.pem, ca-key.pem (kept where they are there), cert.pem and key.pem, and tells what
/// they are. Throws `BridgeError`.
int run_make_identity(const IdentityOptions& options);

}  // namespace kerf::bridge
