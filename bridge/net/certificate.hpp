// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <openssl/evp.h>
#include <openssl/x509.h>

namespace kerf::bridge {

struct FreeOpenssl {
  void operator()(EVP_PKEY* key) const noexcept { EVP_PKEY_free(key); }
  void operator()(X509* certificate) const noexcept { X509_free(certificate); }
};
using Key = std::unique_ptr<EVP_PKEY, FreeOpenssl>;
using Certificate = std::unique_ptr<X509, FreeOpenssl>;

/// A new key on the curve P-256. Throws `BridgeError`, as all below.
[[nodiscard]] Key new_key();

/// The content of a new certificate. It holds from a day ago on, since clocks differ.
struct CertificateSpec {
  std::string name;                ///< common name
  std::vector<std::string> hosts;  ///< names and addresses of a server; empty: a CA
  int days = 825;
};

/// Throws if one is neither a name nor an address.
void require_hosts(const std::vector<std::string>& hosts);

/// Of `key`, signed by `issuer` with `issuer_key`; nullptr: by itself.
[[nodiscard]] Certificate new_certificate(const CertificateSpec& spec, EVP_PKEY* key, X509* issuer,
                                          EVP_PKEY* issuer_key);

[[nodiscard]] std::string pem_of(X509* certificate);
[[nodiscard]] std::string pem_of(EVP_PKEY* key);
/// nullptr if the text has none.
[[nodiscard]] Certificate certificate_of(const std::string& pem);
[[nodiscard]] Key key_of(const std::string& pem);

/// SHA-256 of the certificate: hex in capitals, a colon between bytes. Empty if OpenSSL has no
/// memory; never throws `BridgeError`.
[[nodiscard]] std::string fingerprint_of(const X509* certificate);
/// Its DNS names.
[[nodiscard]] std::vector<std::string> dns_names_of(X509* certificate);
/// The day of its end, as OpenSSL prints it.
[[nodiscard]] std::string end_of(const X509* certificate);

/// What a server shows and what it proves it with.
struct TlsKeys {
  std::string chain_pem;  ///< its certificate, then those above it
  std::string key_pem;
  std::string fingerprint;         ///< SHA-256 of the certificate, hex with colons
  std::vector<std::string> names;  ///< DNS names that it holds for
};

/// From a folder of `make-identity`. Throws `BridgeError` if a file is missing, open to others,
/// damaged, out of date or not its partner's.
[[nodiscard]] TlsKeys load_tls_keys(const std::filesystem::path& folder);

/// Made now, for `hosts` (names and addresses); no authority vouches for it.
[[nodiscard]] TlsKeys self_signed_keys(const std::vector<std::string>& hosts);

/// Why a viewer believes that the other side is the one it means: the lab's CA vouches for it, or
/// its certificate is the one whose fingerprint was given. Without either nothing is believed, and
/// the refusal names the fingerprint seen. One connection at a time.
class CertificateCheck {
 public:
  /// Throws `BridgeError` if the CA cannot be read, the fingerprint is none, or both are given.
  CertificateCheck(std::string host, const std::filesystem::path& ca,
                   const std::string& fingerprint);
  CertificateCheck(const CertificateCheck&) = delete;
  CertificateCheck& operator=(const CertificateCheck&) = delete;

  /// Once; must outlive `context`'s connections.
  void apply_to(SSL_CTX* context);
  /// Before each handshake.
  void begin(SSL* connection);
  /// After a handshake that failed: one line; empty: the certificate was not the reason.
  [[nodiscard]] const std::string& refusal() const noexcept { return refusal_; }

 private:
  [[nodiscard]] bool believe(bool verified, X509_STORE_CTX* chain);
  [[nodiscard]] static int verify(int verified, X509_STORE_CTX* chain);

  std::string host_;
  std::filesystem::path ca_;
  std::string fingerprint_;  // empty: none was given
  std::string refusal_;
};

/// `kerf-bridge make-identity`.
struct IdentityOptions {
  std::filesystem::path folder;
  std::vector<std::string> hosts;  ///< names and addresses of the machine; empty: this one's
  int days = 825;
};

/// Makes DIR/ca.pem, ca-key.pem (kept if they exist), cert.pem and key.pem, and prints what
/// they are. Throws `BridgeError`.
int run_make_identity(const IdentityOptions& options);

}  // namespace kerf::bridge
