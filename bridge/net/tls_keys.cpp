// SPDX-License-Identifier: Apache-2.0
#include "bridge/net/tls_keys.hpp"

#include <sys/stat.h>

#include "bridge/net/bridge_error.hpp"
#include "bridge/net/certificate.hpp"
#include "shared/text/file_text.hpp"

namespace kerf::bridge {
namespace {

constexpr const char* kMake = "make one: kerf bridge make-identity ";

std::string text_of_file(const std::filesystem::path& file, const std::filesystem::path& folder) {
  std::string text = text_in(file);
  if (text.empty()) {
    throw BridgeError("--identity " + folder.string() + ": " + file.filename().string() +
                      " is missing, empty or not to be read; " + kMake + folder.string());
  }
  return text;
}

}  // namespace

TlsKeys load_tls_keys(const std::filesystem::path& folder) {
  const auto refuse = [&folder](const std::string& why) {
    return BridgeError("--identity " + folder.string() + ": " + why + "; " + kMake +
                       folder.string());
  };
  TlsKeys out{
      text_of_file(folder / "cert.pem", folder), text_of_file(folder / "key.pem", folder), "", {}};
  struct stat status {};
  if (stat((folder / "key.pem").c_str(), &status) == 0 &&
      (status.st_mode & (S_IRWXG | S_IRWXO)) != 0) {
    throw BridgeError("--identity " + folder.string() +
                      ": key.pem is open to other users; chmod 600 it");
  }
  const Certificate certificate = certificate_of(out.chain_pem);
  if (!certificate) throw refuse("cert.pem is no certificate");
  const Key key = key_of(out.key_pem);
  if (!key) throw refuse("key.pem is no private key without a password");
  if (X509_check_private_key(certificate.get(), key.get()) != 1) {
    throw refuse("key.pem is not that of cert.pem");
  }
  if (X509_cmp_current_time(X509_get0_notAfter(certificate.get())) < 0) {
    throw refuse("the certificate ended on " + end_of(certificate.get()));
  }
  if (X509_cmp_current_time(X509_get0_notBefore(certificate.get())) > 0) {
    throw refuse("the certificate holds from a later day on; is the clock right?");
  }
  out.fingerprint = fingerprint_of(certificate.get());
  out.names = dns_names_of(certificate.get());
  return out;
}

TlsKeys self_signed_keys(const std::vector<std::string>& hosts) {
  const Key key = new_key();
  CertificateSpec spec;
  spec.name = "kerf bridge";
  spec.hosts = hosts;
  const Certificate certificate = new_certificate(spec, key.get(), nullptr, nullptr);
  return {pem_of(certificate.get()), pem_of(key.get()), fingerprint_of(certificate.get()),
          dns_names_of(certificate.get())};
}

}  // namespace kerf::bridge
