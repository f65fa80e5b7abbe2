// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <filesystem>
#include <string>

namespace kerf::bridge {

/// `kerf-bridge serve`.
struct ServeOptions {
  std::string listen = "127.0.0.1:7400";  ///< HOST:PORT; port 0: one that is free
  std::string name = "default";           ///< of the controller
  std::filesystem::path identity;         ///< folder of `make-identity`; empty: self-signed
  std::filesystem::path token_file;       ///< who may look; empty: one token, made now
  std::filesystem::path command_tokens;   ///< who may command; empty: nobody
  int max_viewers = 32;
  bool dedicated_link = false;
};

/// Serves until `stop`. Prints the address with its token on stdout. Throws `BridgeError`.
int run_serve(const ServeOptions& options, const std::atomic<bool>& stop);

}  // namespace kerf::bridge
