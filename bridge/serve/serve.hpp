// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <filesystem>
#include <string>

#include "shared/segment/command.hpp"

namespace kerf::bridge {

/// `text` as a QR code for a terminal: black on white, two modules per character, margin of four
/// modules. If `text` is too long or kerf was built without libqrencode, one line with the reason.
[[nodiscard]] std::string qr_code(const std::string& text);

inline constexpr int kMostViewers = 32;

/// `kerf-bridge serve`.
struct ServeOptions {
  std::string listen = "127.0.0.1:7400";  ///< HOST:PORT; port 0: any free port
  std::string name = kDefaultName;        ///< of the controller
  std::filesystem::path certificate;      ///< PEM file; empty: self-signed off loopback
  std::filesystem::path key;              ///< PEM file: key of the certificate
  std::filesystem::path client_ca;   ///< PEM file: CAs of viewers' certificates; empty: none needed
  std::filesystem::path token_file;  ///< tokens of viewers; empty: one new token
  std::filesystem::path command_tokens;  ///< tokens of viewers that may command; empty: none
  std::string public_url;                ///< of a reverse proxy; empty: none
  int max_viewers = kMostViewers;
  bool dedicated_link = false;  ///< no other traffic on the link
  int openigtlink = 0;          ///< port for 3D Slicer, on the same host; 0: none
  bool qr = false;              ///< also prints the first non-loopback address as a QR code
};

/// Serves until `stop`. Prints the addresses with their tokens on stdout. Throws `BridgeError`, or
/// an exception of `IgtlOutput`.
int run_serve(const ServeOptions& options, const std::atomic<bool>& stop);

}  // namespace kerf::bridge
