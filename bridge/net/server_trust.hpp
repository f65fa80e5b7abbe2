// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

struct ssl_st;  // OpenSSL's own names
struct ssl_ctx_st;
struct x509_store_ctx_st;

namespace kerf::bridge {

/// Why a viewer believes that the other side is the one it means: the lab's CA vouches for it, or
/// its certificate is the one whose fingerprint was told. Without either nothing is believed, and
/// the refusal tells the fingerprint seen. One connection at a time.
class ServerTrust {
 public:
  /// Throws `BridgeError` where the CA cannot be read, the fingerprint is none, or both are given.
  ServerTrust(std::string host, const std::filesystem::path& ca, const std::string& fingerprint);
  ServerTrust(const ServerTrust&) = delete;
  ServerTrust& operator=(const ServerTrust&) = delete;

  /// Once; must outlive `context`'s connections.
  void apply_to(ssl_ctx_st* context);
  /// Before each handshake.
  void begin(ssl_st* connection);
  /// After a handshake that failed: one line; empty: the certificate was not the reason.
  [[nodiscard]] const std::string& refusal() const noexcept { return refusal_; }

 private:
  [[nodiscard]] bool believe(bool verified, x509_store_ctx_st* chain);
  [[nodiscard]] static int verify(int verified, x509_store_ctx_st* chain);

  std::string host_;
  std::filesystem::path ca_;
  std::string fingerprint_;  // empty: none was told
  std::string refusal_;
};

}  // namespace kerf::bridge
