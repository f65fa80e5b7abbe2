// SPDX-License-Identifier: Apache-2.0
#include "bridge/net/server_trust.hpp"

#include <cstddef>
#include <filesystem>
#include <string_view>
#include <system_error>
#include <utility>

#include <openssl/err.h>
#include <openssl/ssl.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>

#include "bridge/net/bridge_error.hpp"
#include "bridge/net/certificate.hpp"
#include "bridge/net/host_names.hpp"

namespace kerf::bridge {
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

ServerTrust::ServerTrust(std::string host, const std::filesystem::path& ca,
                         const std::string& fingerprint)
    : host_(std::move(host)), ca_(ca) {
  if (fingerprint.empty()) return;
  fingerprint_ = fingerprint_in(fingerprint);
  if (!ca.empty()) throw BridgeError("--fingerprint: with --ca; take one of them");
  if (fingerprint_.empty()) {
    throw BridgeError("--fingerprint: no 64 hex digits; take the SHA-256 that serve prints");
  }
}

void ServerTrust::apply_to(ssl_ctx_st* context) {
  SSL_CTX_set_min_proto_version(context, TLS1_3_VERSION);
  SSL_CTX_set_verify(context, SSL_VERIFY_PEER, &ServerTrust::verify);
  if (ca_.empty()) return;
  std::error_code fault;  // nobody may write into a pipe, which OpenSSL would wait for
  if (!std::filesystem::is_regular_file(ca_, fault) ||
      SSL_CTX_load_verify_locations(context, ca_.c_str(), nullptr) != 1) {
    ERR_clear_error();
    throw BridgeError("--ca " + ca_.string() +
                      ": no certificate to be read; take ca.pem of make-identity");
  }
}

void ServerTrust::begin(ssl_st* connection) {
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

int ServerTrust::verify(int verified, x509_store_ctx_st* chain) {
  const auto* const connection = static_cast<const SSL*>(
      X509_STORE_CTX_get_ex_data(chain, SSL_get_ex_data_X509_STORE_CTX_idx()));
  auto* const trust = static_cast<ServerTrust*>(SSL_get_ex_data(connection, index_of_trust()));
  return trust->believe(verified != 0, chain) ? 1 : 0;
}

bool ServerTrust::believe(bool verified, x509_store_ctx_st* chain) {
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

}  // namespace kerf::bridge
