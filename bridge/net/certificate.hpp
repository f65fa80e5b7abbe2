// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <openssl/types.h>

namespace kerf::bridge {

/// TLS 1.3 settings of one peer: its own certificate, and what it requires of the other peer's. The
/// functions below fill them once, before the first connection, and throw `BridgeError`.
using Tls = std::shared_ptr<SSL_CTX>;

/// Without a certificate; verifies none.
[[nodiscard]] Tls new_tls();

/// Presents the first certificate of `certificate`, with those after it as its chain, and its
/// private key `key`: PEM files, the options `--cert` and `--key` of serve and join. Throws if the
/// key is open to other users, has a password or does not match, or if the certificate is expired
/// or not yet valid.
void show_certificate(SSL_CTX* tls, const std::filesystem::path& certificate,
                      const std::filesystem::path& key);

/// Shows a certificate made now for `hosts` (names and addresses), which no CA has signed.
void show_self_signed(SSL_CTX* tls, const std::vector<std::string>& hosts);

/// Refuses clients without a certificate that a CA of this PEM file has signed (`--client-ca`).
void require_client_certificate(SSL_CTX* tls, const std::filesystem::path& ca);

/// SHA-256 of a certificate: hex in capitals, a colon between bytes. Empty if OpenSSL has no
/// memory; never throws `BridgeError`.
[[nodiscard]] std::string fingerprint_of(const X509* certificate);
/// Of the certificate that `tls` shows.
[[nodiscard]] std::string fingerprint_of(const SSL_CTX* tls);
/// The DNS names of the certificate that `tls` shows.
[[nodiscard]] std::vector<std::string> dns_names_of(const SSL_CTX* tls);

/// What join requires of the server's certificate: a CA of the file `ca` has signed it for this
/// host, or it has the given fingerprint. Otherwise it is refused, and the refusal names the
/// fingerprint seen. One connection at a time.
class CertificateCheck {
 public:
  /// Throws `BridgeError` if the fingerprint is not valid, or both are given.
  CertificateCheck(std::string host, std::filesystem::path ca, const std::string& fingerprint);
  CertificateCheck(const CertificateCheck&) = delete;
  CertificateCheck& operator=(const CertificateCheck&) = delete;

  /// Once; must outlive the connections of `tls`. Throws `BridgeError` if the CA cannot be read.
  void apply_to(SSL_CTX* tls);
  /// Before each handshake.
  void begin(SSL* connection);
  /// After a handshake that failed: one line; empty: the certificate was not the reason.
  [[nodiscard]] const std::string& refusal() const noexcept { return refusal_; }
  /// Whether it requires one certificate, by its fingerprint.
  [[nodiscard]] bool is_pinned() const noexcept { return !fingerprint_.empty(); }

 private:
  [[nodiscard]] bool accepts(bool verified, X509_STORE_CTX* chain);
  [[nodiscard]] static int verify(int verified, X509_STORE_CTX* chain);

  std::string host_;
  std::filesystem::path ca_;
  std::string fingerprint_;  // empty: none was given
  std::string refusal_;
};

}  // namespace kerf::bridge
