// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <iosfwd>
#include <optional>
#include <string>

namespace kerf::bridge {

/// `kerf-bridge join`.
struct JoinOptions {
  std::string address;                ///< what `serve` prints: wss://HOST:PORT/?token=TOKEN
  std::string name = "far";           ///< of the local segment
  std::filesystem::path ca;           ///< PEM file: CAs of the server's certificate; or
  std::string fingerprint;            ///< SHA-256 of the server's certificate, in hex
  std::filesystem::path certificate;  ///< PEM file of this viewer, if the server asks for it
  std::filesystem::path key;          ///< its key, PEM
  std::filesystem::path token_file;   ///< its first token, if the address has none
  std::optional<double> wait_s;       ///< for the first picture; nothing: for ever
  std::uint64_t most_mib = 2048;      ///< a larger segment is refused
};

/// Keeps the local segment `name` equal to the remote one until `stop`; reconnects after each loss
/// of the connection. Reports each change on `out` in one line, and at the end the age of the
/// picture. Throws `BridgeError` or `SegmentError` if another try cannot help (a wrong token, a
/// certificate that is refused, a name in use), or if nothing came within `wait_s`.
int run_join(const JoinOptions& options, const std::atomic<bool>& stop, std::ostream& out);

}  // namespace kerf::bridge
