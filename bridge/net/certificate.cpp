// SPDX-License-Identifier: Apache-2.0

#include "bridge/net/certificate.hpp"

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <system_error>
#include <utility>

#include <openssl/crypto.h>
#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/rand.h>
#include <openssl/ssl.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>
#include <sys/stat.h>
#include <unistd.h>

#include "bridge/net/address.hpp"

namespace kerf::bridge {
namespace {

constexpr const char* kHelp = "docs/second-machine.md has the lines of openssl";

void require(bool done, const char* step) {
  if (!done) throw BridgeError(std::string("certificate: ") + step + " failed; try again");
}

/// `--cert FILE: `, after a check that OpenSSL can read the file: it would wait for a pipe that no
/// program writes to.
std::string readable(const char* option, const std::filesystem::path& file) {
  const std::string location = std::string(option) + " " + file.string() + ": ";
  if (access(file.c_str(), R_OK) != 0) {
    throw BridgeError(location + std::strerror(errno) + "; name a PEM file");
  }
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) {
    throw BridgeError(
        location +
        (std::filesystem::is_directory(file, error) ? "is a folder" : "is no regular file") +
        "; name a PEM file");
  }
  return location;
}

/// In capitals, a colon between bytes; at most a digest.
std::string hex_of(const unsigned char* bytes, std::size_t count) {
  std::array<char, 3 * EVP_MAX_MD_SIZE> text{};
  OPENSSL_buf2hexstr_ex(text.data(), text.size(), nullptr, bytes, count, ':');
  return text.data();
}

/// OpenSSL's first reason since the last call.
std::string openssl_reason() {
  const char* const reason = ERR_reason_error_string(ERR_peek_error());
  ERR_clear_error();
  return reason == nullptr ? "no reason given" : reason;
}

std::string text_of(const ASN1_TIME* time) {
  const std::unique_ptr<BIO, decltype(&BIO_free)> bio(BIO_new(BIO_s_mem()), &BIO_free);
  ASN1_TIME_print(bio.get(), time);
  char* text = nullptr;
  const long bytes = BIO_get_mem_data(bio.get(), &text);
  return {text, static_cast<std::size_t>(bytes)};
}

/// Trusts the certificates of a PEM file, at least one.
void load_ca(SSL_CTX* tls, const char* option, const std::filesystem::path& file) {
  const std::string location = readable(option, file);
  if (SSL_CTX_load_verify_file(tls, file.c_str()) == 1) return;
  throw BridgeError(location + "no certificate in PEM form (" + openssl_reason() + "); " + kHelp);
}

}  // namespace

Tls new_tls() {
  Tls tls(SSL_CTX_new(TLS_method()), &SSL_CTX_free);
  require(tls != nullptr, "TLS");
  SSL_CTX_set_min_proto_version(tls.get(), TLS1_3_VERSION);
  // No early data, and no tickets: a viewer that comes again shows what it has again.
  SSL_CTX_set_num_tickets(tls.get(), 0);
  return tls;
}

void show_certificate(SSL_CTX* tls, const std::filesystem::path& certificate,
                      const std::filesystem::path& key) {
  const std::string location = readable("--cert", certificate);
  const std::string key_location = readable("--key", key);
  struct stat status {};
  if (stat(key.c_str(), &status) == 0 && (status.st_mode & (S_IRWXG | S_IRWXO)) != 0) {
    throw BridgeError(key_location + "is open to other users; chmod 600 it");
  }
  ERR_clear_error();
  if (SSL_CTX_use_certificate_chain_file(tls, certificate.c_str()) != 1) {
    throw BridgeError(location + "no certificate in PEM form (" + openssl_reason() + "); " + kHelp);
  }
  // No user is there who could type a password.
  SSL_CTX_set_default_passwd_cb(tls, [](char*, int, int, void*) { return -1; });
  const std::unique_ptr<BIO, decltype(&BIO_free)> file(BIO_new_file(key.c_str(), "r"), &BIO_free);
  const std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)> own(
      PEM_read_bio_PrivateKey(file.get(), nullptr, SSL_CTX_get_default_passwd_cb(tls), nullptr),
      &EVP_PKEY_free);
  if (own == nullptr) {
    ERR_clear_error();
    throw BridgeError(key_location +
                      "no private key in PEM form, or one with a password; openssl pkey "
                      "-in FILE -out FILE writes one without");
  }
  X509* const shown = SSL_CTX_get0_certificate(tls);
  if (X509_check_private_key(shown, own.get()) != 1) {
    ERR_clear_error();
    throw BridgeError(key_location + "is not the key of the first certificate in " +
                      certificate.string() + "; give the two files that were made together");
  }
  require(SSL_CTX_use_PrivateKey(tls, own.get()) == 1, "taking its key");
  if (X509_cmp_current_time(X509_get0_notAfter(shown)) < 0) {
    throw BridgeError(location + "the certificate ended on " + text_of(X509_get0_notAfter(shown)) +
                      "; make another: " + kHelp);
  }
  if (X509_cmp_current_time(X509_get0_notBefore(shown)) > 0) {
    throw BridgeError(location + "the certificate holds from " +
                      text_of(X509_get0_notBefore(shown)) + " on; is the clock right?");
  }
}

void show_self_signed(SSL_CTX* tls, const std::vector<std::string>& hosts) {
  constexpr long kDayS = 24L * 60 * 60;
  const std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)> key(EVP_EC_gen("P-256"),
                                                                &EVP_PKEY_free);
  const std::unique_ptr<X509, decltype(&X509_free)> own(X509_new(), &X509_free);
  std::uint64_t serial = 0;
  require(key != nullptr && own != nullptr && X509_set_version(own.get(), X509_VERSION_3) == 1 &&
              RAND_bytes(reinterpret_cast<unsigned char*>(&serial), sizeof serial) == 1,
          "a new key");
  ASN1_INTEGER_set_uint64(X509_get_serialNumber(own.get()), serial >> 1 | 1);  // positive
  X509_gmtime_adj(X509_getm_notBefore(own.get()), -kDayS);                     // clocks differ
  X509_gmtime_adj(X509_getm_notAfter(own.get()), 825 * kDayS);
  X509_NAME* const name = X509_get_subject_name(own.get());
  X509_NAME_add_entry_by_txt(name, "CN", MBSTRING_UTF8,
                             reinterpret_cast<const unsigned char*>("kerf bridge"), -1, -1, 0);
  X509_set_issuer_name(own.get(), name);
  X509_set_pubkey(own.get(), key.get());
  std::string names;
  for (const std::string& host : hosts) {
    names += (names.empty() ? "" : ",") + std::string(is_address(host) ? "IP:" : "DNS:") + host;
  }
  const std::pair<int, const char*> extensions[] = {{NID_basic_constraints, "critical,CA:FALSE"},
                                                    {NID_key_usage, "critical,digitalSignature"},
                                                    {NID_ext_key_usage, "serverAuth"},
                                                    {NID_subject_alt_name, names.c_str()}};
  for (const auto& [kind, value] : extensions) {
    const std::unique_ptr<X509_EXTENSION, decltype(&X509_EXTENSION_free)> extension(
        X509V3_EXT_conf_nid(nullptr, nullptr, kind, value), &X509_EXTENSION_free);
    require(extension != nullptr && X509_add_ext(own.get(), extension.get(), -1) == 1,
            "an extension");
  }
  require(X509_sign(own.get(), key.get(), EVP_sha256()) != 0 &&
              SSL_CTX_use_certificate(tls, own.get()) == 1 &&
              SSL_CTX_use_PrivateKey(tls, key.get()) == 1,
          "the signature");
}

void require_client_certificate(SSL_CTX* tls, const std::filesystem::path& ca) {
  load_ca(tls, "--client-ca", ca);
  // Their names are sent, so that a browser offers the certificate that fits.
  SSL_CTX_set_client_CA_list(tls, SSL_load_client_CA_file(ca.c_str()));
  SSL_CTX_set_verify(tls, SSL_VERIFY_PEER | SSL_VERIFY_FAIL_IF_NO_PEER_CERT, nullptr);
}

std::string fingerprint_of(const X509* certificate) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest;
  unsigned bytes = 0;
  if (X509_digest(certificate, EVP_sha256(), digest.data(), &bytes) != 1) return {};
  return hex_of(digest.data(), bytes);
}

std::string fingerprint_of(const SSL_CTX* tls) {
  return fingerprint_of(SSL_CTX_get0_certificate(tls));
}

std::vector<std::string> dns_names_of(const SSL_CTX* tls) {
  std::vector<std::string> out;
  auto* const names = static_cast<GENERAL_NAMES*>(
      X509_get_ext_d2i(SSL_CTX_get0_certificate(tls), NID_subject_alt_name, nullptr, nullptr));
  for (int i = 0; i < sk_GENERAL_NAME_num(names); ++i) {
    const GENERAL_NAME* const name = sk_GENERAL_NAME_value(names, i);
    if (name->type != GEN_DNS) continue;
    const auto* const text = ASN1_STRING_get0_data(name->d.dNSName);
    out.emplace_back(reinterpret_cast<const char*>(text),
                     static_cast<std::size_t>(ASN1_STRING_length(name->d.dNSName)));
  }
  GENERAL_NAMES_free(names);
  return out;
}

namespace {

/// 64 hex digits, with or without colons, as `fingerprint_of` has them; empty for anything else.
[[nodiscard]] std::string fingerprint_in(const std::string& text) {
  std::array<unsigned char, 32> digest;
  std::size_t bytes = 0;
  const bool is_hex =
      OPENSSL_hexstr2buf_ex(digest.data(), digest.size(), &bytes, text.c_str(), ':') == 1;
  ERR_clear_error();
  return is_hex && bytes == digest.size() ? hex_of(digest.data(), bytes) : std::string();
}

[[nodiscard]] int index_of_check() {
  static const int kIndex = SSL_get_ex_new_index(0, nullptr, nullptr, nullptr, nullptr);
  return kIndex;
}

}  // namespace

CertificateCheck::CertificateCheck(std::string host, std::filesystem::path ca,
                                   const std::string& fingerprint)
    : host_(std::move(host)), ca_(std::move(ca)) {
  if (fingerprint.empty()) return;
  fingerprint_ = fingerprint_in(fingerprint);
  if (!ca_.empty()) throw BridgeError("--fingerprint: with --ca; take one of them");
  if (fingerprint_.empty()) {
    throw BridgeError("--fingerprint: no 64 hex digits; take the SHA-256 that serve prints");
  }
}

void CertificateCheck::apply_to(SSL_CTX* tls) {
  SSL_CTX_set_verify(tls, SSL_VERIFY_PEER, &CertificateCheck::verify);
  if (!ca_.empty()) load_ca(tls, "--ca", ca_);
}

void CertificateCheck::begin(SSL* connection) {
  refusal_.clear();
  SSL_set_ex_data(connection, index_of_check(), this);
  X509_VERIFY_PARAM* const rules = SSL_get0_param(connection);
  if (is_address(host_)) {
    X509_VERIFY_PARAM_set1_ip_asc(rules, host_.c_str());
  } else {
    X509_VERIFY_PARAM_set1_host(rules, host_.c_str(), host_.size());
    SSL_set_tlsext_host_name(connection, host_.c_str());
  }
}

int CertificateCheck::verify(int verified, X509_STORE_CTX* chain) {
  const auto* const connection = static_cast<const SSL*>(
      X509_STORE_CTX_get_ex_data(chain, SSL_get_ex_data_X509_STORE_CTX_idx()));
  auto* const check = static_cast<CertificateCheck*>(SSL_get_ex_data(connection, index_of_check()));
  return check->accepts(verified != 0, chain) ? 1 : 0;
}

bool CertificateCheck::accepts(bool verified, X509_STORE_CTX* chain) {
  const int error = X509_STORE_CTX_get_error(chain);
  const X509* const certificate = X509_STORE_CTX_get0_cert(chain);  // the server's own
  const std::string seen = certificate == nullptr ? std::string() : fingerprint_of(certificate);
  if (seen.empty()) {
    refusal_ = "its certificate cannot be read; make another";
    return false;
  }
  if (error == X509_V_ERR_CERT_HAS_EXPIRED || error == X509_V_ERR_CERT_NOT_YET_VALID) {
    refusal_ = std::string("its certificate: ") + X509_verify_cert_error_string(error) +
               "; set the clock, or make another there";
    return false;
  }
  if (!fingerprint_.empty()) {
    if (fingerprint_ == seen) return true;
    refusal_ = "its certificate has another fingerprint, " + seen +
               "; somebody is in between, or serve was started anew: compare with what it prints";
    return false;
  }
  if (!ca_.empty()) {
    if (verified) return true;
    refusal_ = "--ca " + ca_.string() + " does not vouch for it (" +
               X509_verify_cert_error_string(error) + "); its fingerprint is " + seen;
    return false;
  }
  refusal_ =
      "no authority that this machine knows signed its certificate; if serve prints the same, add "
      "--fingerprint " +
      seen;
  return false;
}

}  // namespace kerf::bridge
