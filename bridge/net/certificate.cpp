// SPDX-License-Identifier: Apache-2.0

#include "bridge/net/certificate.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <iostream>
#include <string_view>
#include <system_error>
#include <utility>

#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/rand.h>
#include <openssl/ssl.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>
#include <sys/stat.h>

#include "bridge/net/address.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/text/text.hpp"

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
  // A key behind a password counts as none: there is no user to ask.
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

namespace {

/// 64 hex digits, with or without colons, as `fingerprint_of` has them; empty for anything else.
[[nodiscard]] std::string fingerprint_in(std::string_view text) {
  std::string out;
  std::size_t digits = 0;
  for (const char c : text) {
    if (c == ':') continue;
    const std::size_t value = std::string_view("0123456789abcdef0123456789ABCDEF").find(c);
    if (value == std::string_view::npos) return {};
    if (digits != 0 && digits % 2 == 0) out += ':';
    out += "0123456789ABCDEF"[value & 15];
    ++digits;
  }
  return digits == 64 ? out : std::string();
}

[[nodiscard]] int index_of_trust() {
  static const int index = SSL_get_ex_new_index(0, nullptr, nullptr, nullptr, nullptr);
  return index;
}

}  // namespace

CertificateCheck::CertificateCheck(std::string host, const std::filesystem::path& ca,
                                   const std::string& fingerprint)
    : host_(std::move(host)), ca_(ca) {
  if (fingerprint.empty()) return;
  fingerprint_ = fingerprint_in(fingerprint);
  if (!ca.empty()) throw BridgeError("--fingerprint: with --ca; take one of them");
  if (fingerprint_.empty()) {
    throw BridgeError("--fingerprint: no 64 hex digits; take the SHA-256 that serve prints");
  }
}

void CertificateCheck::apply_to(SSL_CTX* context) {
  SSL_CTX_set_min_proto_version(context, TLS1_3_VERSION);
  SSL_CTX_set_verify(context, SSL_VERIFY_PEER, &CertificateCheck::verify);
  if (ca_.empty()) return;
  std::error_code fault;  // a pipe may never be written to, and OpenSSL would wait for it
  if (!std::filesystem::is_regular_file(ca_, fault) ||
      SSL_CTX_load_verify_locations(context, ca_.c_str(), nullptr) != 1) {
    ERR_clear_error();
    throw BridgeError("--ca " + ca_.string() +
                      ": no certificate to be read; take ca.pem of make-identity");
  }
}

void CertificateCheck::begin(SSL* connection) {
  refusal_.clear();
  SSL_set_ex_data(connection, index_of_trust(), this);
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
  auto* const trust = static_cast<CertificateCheck*>(SSL_get_ex_data(connection, index_of_trust()));
  return trust->believe(verified != 0, chain) ? 1 : 0;
}

bool CertificateCheck::believe(bool verified, X509_STORE_CTX* chain) {
  const int error = X509_STORE_CTX_get_error(chain);
  const X509* const certificate = X509_STORE_CTX_get0_cert(chain);  // the server's own
  const std::string seen = certificate == nullptr ? std::string() : fingerprint_of(certificate);
  if (seen.empty()) {
    refusal_ = "its certificate cannot be read; make another";
    return false;
  }
  const bool in_time =
      error != X509_V_ERR_CERT_HAS_EXPIRED && error != X509_V_ERR_CERT_NOT_YET_VALID;
  if (!in_time) {
    refusal_ = std::string("its certificate: ") + X509_verify_cert_error_string(error) +
               "; set the clock, or make-identity there again";
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
      "nobody vouches for its certificate; where serve or make-identity prints the same, add "
      "--fingerprint " +
      seen;
  return false;
}

namespace {

constexpr int kCaDays = 3650;

struct Authority {
  Certificate certificate;
  Key key;
  bool is_new = false;
};

/// The CA of the folder, made if there is none.
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
