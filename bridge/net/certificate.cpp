// SPDX-License-Identifier: Apache-2.0
#include "bridge/net/certificate.hpp"

#include <array>
#include <cstdint>

#include <openssl/bio.h>
#include <openssl/pem.h>
#include <openssl/rand.h>
#include <openssl/x509v3.h>

#include "bridge/net/bridge_error.hpp"
#include "bridge/net/host_names.hpp"
#include "shared/text/words.hpp"

namespace kerf::bridge {
namespace {

constexpr long kDayS = 24L * 60 * 60;
constexpr std::size_t kShown = 80;  // of a host in a message

struct FreeBio {
  void operator()(BIO* bio) const noexcept { BIO_free(bio); }
};
using Bio = std::unique_ptr<BIO, FreeBio>;

void require(bool done, const char* what) {
  if (!done) throw BridgeError(std::string("certificate: ") + what + " failed; try again");
}

std::string text_of(const Bio& bio) {
  char* text = nullptr;
  const long bytes = BIO_get_mem_data(bio.get(), &text);
  return {text, static_cast<std::size_t>(bytes)};
}

Bio reader_of(const std::string& text) {
  return Bio(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
}

void add_extension(X509* certificate, X509* issuer, int kind, const std::string& value) {
  X509V3_CTX context;
  X509V3_set_ctx_nodb(&context);
  X509V3_set_ctx(&context, issuer, certificate, nullptr, nullptr, 0);
  X509_EXTENSION* const extension = X509V3_EXT_conf_nid(nullptr, &context, kind, value.c_str());
  require(extension != nullptr, "an extension");
  const int added = X509_add_ext(certificate, extension, -1);
  X509_EXTENSION_free(extension);
  require(added == 1, "an extension");
}

void say_what_for(X509* certificate, X509* issuer, const CertificateSpec& spec) {
  const bool ca = spec.hosts.empty();
  add_extension(certificate, issuer, NID_basic_constraints,
                ca ? "critical,CA:TRUE,pathlen:0" : "critical,CA:FALSE");
  add_extension(certificate, issuer, NID_key_usage,
                ca ? "critical,keyCertSign,cRLSign" : "critical,digitalSignature");
  add_extension(certificate, issuer, NID_subject_key_identifier, "hash");
  if (ca) return;
  add_extension(certificate, issuer, NID_ext_key_usage, "serverAuth");
  require_hosts(spec.hosts);
  std::string hosts;
  for (const std::string& host : spec.hosts) {
    hosts += (hosts.empty() ? "" : ",") + std::string(is_address(host) ? "IP:" : "DNS:") + host;
  }
  add_extension(certificate, issuer, NID_subject_alt_name, hosts);
}

}  // namespace

void require_hosts(const std::vector<std::string>& hosts) {
  for (const std::string& host : hosts) {
    if (const std::string why = why_no_host(host); !why.empty()) {
      throw BridgeError(one_line("--host " + host.substr(0, kShown) + ": " + why));
    }
  }
}

Key new_key() {
  Key key(EVP_EC_gen("P-256"));
  require(key != nullptr, "a new key");
  return key;
}

Certificate new_certificate(const CertificateSpec& spec, EVP_PKEY* key, X509* issuer,
                            EVP_PKEY* issuer_key) {
  Certificate out(X509_new());
  require(out != nullptr && X509_set_version(out.get(), X509_VERSION_3) == 1, "a new one");
  std::uint64_t serial = 0;
  require(RAND_bytes(reinterpret_cast<unsigned char*>(&serial), sizeof serial) == 1, "a number");
  ASN1_INTEGER_set_uint64(X509_get_serialNumber(out.get()), serial >> 1 | 1);  // positive
  X509_gmtime_adj(X509_getm_notBefore(out.get()), -kDayS);
  X509_gmtime_adj(X509_getm_notAfter(out.get()), spec.days * kDayS);
  X509_NAME* const subject = X509_get_subject_name(out.get());
  require(X509_NAME_add_entry_by_txt(subject, "CN", MBSTRING_UTF8,
                                     reinterpret_cast<const unsigned char*>(spec.name.c_str()), -1,
                                     -1, 0) == 1,
          "its name");
  X509* const above = issuer == nullptr ? out.get() : issuer;
  require(X509_set_issuer_name(out.get(), X509_get_subject_name(above)) == 1 &&
              X509_set_pubkey(out.get(), key) == 1,
          "its key");
  say_what_for(out.get(), above, spec);
  require(X509_sign(out.get(), issuer_key == nullptr ? key : issuer_key, EVP_sha256()) != 0,
          "the signature");
  return out;
}

std::string pem_of(X509* certificate) {
  const Bio bio(BIO_new(BIO_s_mem()));
  require(PEM_write_bio_X509(bio.get(), certificate) == 1, "writing");
  return text_of(bio);
}

std::string pem_of(EVP_PKEY* key) {
  const Bio bio(BIO_new(BIO_s_secmem()));
  require(PEM_write_bio_PrivateKey(bio.get(), key, nullptr, nullptr, 0, nullptr, nullptr) == 1,
          "writing its key");
  return text_of(bio);
}

Certificate certificate_of(const std::string& pem) {
  return Certificate(PEM_read_bio_X509(reader_of(pem).get(), nullptr, nullptr, nullptr));
}

Key key_of(const std::string& pem) {
  // A key behind a password is none: nobody is there to ask.
  const auto no_password = [](char*, int, int, void*) { return -1; };
  return Key(PEM_read_bio_PrivateKey(reader_of(pem).get(), nullptr, no_password, nullptr));
}

std::string fingerprint_of(const X509* certificate) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest;
  unsigned bytes = 0;
  if (X509_digest(certificate, EVP_sha256(), digest.data(), &bytes) != 1) return {};
  std::string text;
  for (unsigned i = 0; i < bytes; ++i) {
    if (i != 0) text += ':';
    text += "0123456789ABCDEF"[digest[i] >> 4];
    text += "0123456789ABCDEF"[digest[i] & 15];
  }
  return text;
}

std::vector<std::string> dns_names_of(X509* certificate) {
  std::vector<std::string> out;
  auto* const names = static_cast<GENERAL_NAMES*>(
      X509_get_ext_d2i(certificate, NID_subject_alt_name, nullptr, nullptr));
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

std::string end_of(const X509* certificate) {
  const Bio bio(BIO_new(BIO_s_mem()));
  ASN1_TIME_print(bio.get(), X509_get0_notAfter(certificate));
  return text_of(bio);
}

}  // namespace kerf::bridge
