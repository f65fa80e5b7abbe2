// SPDX-License-Identifier: Apache-2.0
#pragma once

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

/// What a new certificate says. It holds from a day ago on, since clocks differ.
struct CertificateSpec {
  std::string name;                ///< common name
  std::vector<std::string> hosts;  ///< names and addresses of a server; empty: a CA
  int days = 825;
};

/// Throws where one is neither a name nor an address.
void require_hosts(const std::vector<std::string>& hosts);

/// Of `key`, signed by `issuer` with `issuer_key`; nullptr: by itself.
[[nodiscard]] Certificate new_certificate(const CertificateSpec& spec, EVP_PKEY* key, X509* issuer,
                                          EVP_PKEY* issuer_key);

[[nodiscard]] std::string pem_of(X509* certificate);
[[nodiscard]] std::string pem_of(EVP_PKEY* key);
/// nullptr where the text has none.
[[nodiscard]] Certificate certificate_of(const std::string& pem);
[[nodiscard]] Key key_of(const std::string& pem);

/// SHA-256 of the certificate: hex in capitals, a colon between bytes. Empty where OpenSSL has no
/// memory; never throws `BridgeError`.
[[nodiscard]] std::string fingerprint_of(const X509* certificate);
/// Its DNS names.
[[nodiscard]] std::vector<std::string> dns_names_of(X509* certificate);
/// The day of its end, as OpenSSL tells it.
[[nodiscard]] std::string end_of(const X509* certificate);

}  // namespace kerf::bridge
