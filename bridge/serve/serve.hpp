// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <filesystem>
#include <string>

#include "shared/segment/command.hpp"

namespace kerf::bridge {

/// `text` as a QR code for a terminal of any colours: black on white, two modules per character, a
/// margin of four. One line with the reason if libqrencode was missing when kerf was built, or if
/// `text` is too long.
[[nodiscard]] std::string qr_code(const std::string& text);

inline constexpr int kMostViewers = 32;

/// `kerf-bridge serve`.
struct ServeOptions {
  std::string listen = "127.0.0.1:7400";  ///< HOST:PORT; port 0: one that is free
  std::string name = kDefaultName;        ///< of the controller
  std::filesystem::path certificate;      ///< PEM file; empty: self-signed off loopback
  std::filesystem::path key;              ///< of the certificate, PEM
  std::filesystem::path client_ca;   ///< PEM file: CAs of viewers' certificates; empty: none needed
  std::filesystem::path token_file;  ///< tokens of viewers; empty: one token, made now
  std::filesystem::path command_tokens;  ///< tokens of viewers that may command; empty: none
  std::string public_url;                ///< of a reverse proxy; empty: none
  int max_viewers = kMostViewers;
  bool dedicated_link = false;
  int openigtlink = 0;  ///< port for 3D Slicer, at the same host; 0: none
  bool qr = false;      ///< also draws the first address off loopback as a QR code
};

/// Serves until `stop`. Prints the address with its token on stdout. Throws `BridgeError`, or what
/// `IgtlOutput` does.
int run_serve(const ServeOptions& options, const std::atomic<bool>& stop);

}  // namespace kerf::bridge
