// SPDX-License-Identifier: Apache-2.0
#include "bridge/net/identity.hpp"

#include <algorithm>
#include <iostream>
#include <system_error>

#include "bridge/net/bridge_error.hpp"
#include "bridge/net/certificate.hpp"
#include "bridge/net/host_names.hpp"
#include "shared/posix/new_file.hpp"
#include "shared/text/file_text.hpp"
#include "shared/text/words.hpp"

namespace kerf::bridge {
namespace {

constexpr int kCaDays = 3650;

struct Authority {
  Certificate certificate;
  Key key;
  bool is_new = false;
};

/// The CA of the folder, made where there is none.
Authority authority_in(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / "ca.pem", key_file = folder / "ca-key.pem";
  if (std::filesystem::exists(file) || std::filesystem::exists(key_file)) {
    Authority out{certificate_of(text_in(file)), key_of(text_in(key_file))};
    if (!out.certificate || !out.key ||
        X509_check_private_key(out.certificate.get(), out.key.get()) != 1) {
      throw BridgeError(folder.string() +
                        ": ca.pem and ca-key.pem are no CA and its key; take another folder");
    }
    if (X509_cmp_current_time(X509_get0_notAfter(out.certificate.get())) < 0) {
      throw BridgeError(folder.string() + ": the CA ended on " + end_of(out.certificate.get()) +
                        "; take another folder");
    }
    return out;
  }
  Authority out{nullptr, new_key(), true};
  CertificateSpec spec;
  spec.name = "kerf lab CA";
  spec.days = kCaDays;
  out.certificate = new_certificate(spec, out.key.get(), nullptr, nullptr);
  return out;
}

}  // namespace

int run_make_identity(const IdentityOptions& options) {
  require_hosts(options.hosts);  // before anything is made
  for (auto host = options.hosts.begin(); host != options.hosts.end(); ++host) {
    if (std::find(options.hosts.begin(), host, *host) == host) continue;
    throw BridgeError(one_line("--host " + *host + ": stands there twice; name each host once"));
  }
  const std::filesystem::path& folder = options.folder;
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    throw BridgeError(folder.string() + ": " + error.message() + "; choose another folder");
  }
  const Authority authority = authority_in(folder);
  CertificateSpec spec;
  spec.hosts = options.hosts.empty() ? own_hosts() : options.hosts;
  spec.name = spec.hosts.front().substr(0, 64);  // X.509's most
  spec.days = options.days;
  const Key key = new_key();
  const Certificate certificate =
      new_certificate(spec, key.get(), authority.certificate.get(), authority.key.get());
  const Certificate replaced = certificate_of(text_in(folder / "cert.pem"));
  // The program's umask makes them 0600.
  if (authority.is_new) {
    write_new_file(folder / "ca-key.pem", pem_of(authority.key.get()));
    write_new_file(folder / "ca.pem", pem_of(authority.certificate.get()));
  }
  write_new_file(folder / "key.pem", pem_of(key.get()));
  write_new_file(folder / "cert.pem",
                 pem_of(certificate.get()) + pem_of(authority.certificate.get()));
  std::cout << escaped(folder.string()) << ": certificate for";
  for (const std::string& host : spec.hosts) std::cout << ' ' << host;
  std::cout << ", until " << end_of(certificate.get()) << '\n';
  std::cout << "SHA-256 " << fingerprint_of(certificate.get()) << '\n'
            << (authority.is_new ? "a new CA: " : "by the CA: ")
            << "give ca.pem to browsers and to "
            << "kerf bridge join; ca-key.pem stays here\n";
  if (replaced) {
    std::cout << "the one before, " << fingerprint_of(replaced.get()) << ", is replaced\n";
  }
  return 0;
}

}  // namespace kerf::bridge
