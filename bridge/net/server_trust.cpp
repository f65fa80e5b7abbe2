// SPDX-License-Identifier: Apache-2.0
#include "bridge/net/server_trust.hpp"

#include <algorithm>
#include <cstddef>
#include <string_view>
#include <utility>

#include <arpa/inet.h>
#include <openssl/err.h>
#include <openssl/ssl.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>

#include "bridge/net/bridge_error.hpp"

namespace kerf::bridge {
namespace {

using Digest = std::array<std::uint8_t, 32>;

/// 64 hex digits, with or without colons.
[[nodiscard]] std::optional<Digest> parse_digest(std::string_view text) {
  Digest out{};
  std::size_t digits = 0;
  for (const char c : text) {
    if (c == ':') continue;
    const std::size_t value = std::string_view("0123456789abcdef0123456789ABCDEF").find(c);
    if (value == std::string_view::npos || digits == 64) return std::nullopt;
    std::uint8_t& byte = out.at(digits++ / 2);
    byte = static_cast<std::uint8_t>(byte << 4 | static_cast<int>(value & 15));
  }
  if (digits != 64) return std::nullopt;
  return out;
}

[[nodiscard]] std::string text_of(const Digest& digest) {
  std::string out;
  for (const std::uint8_t byte : digest) {
    if (!out.empty()) out += ':';
    out += "0123456789ABCDEF"[byte >> 4];
    out += "0123456789ABCDEF"[byte & 15];
  }
  return out;
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
  fingerprint_ = parse_digest(fingerprint);
  if (!ca.empty()) throw BridgeError("--fingerprint: with --ca; take one of them");
  if (!fingerprint_) {
    throw BridgeError("--fingerprint: no 64 hex digits; take the SHA-256 that serve prints");
  }
}

void ServerTrust::apply_to(ssl_ctx_st* context) {
  SSL_CTX_set_min_proto_version(context, TLS1_3_VERSION);
  SSL_CTX_set_verify(context, SSL_VERIFY_PEER, &ServerTrust::verify);
  if (!ca_.empty() && SSL_CTX_load_verify_locations(context, ca_.c_str(), nullptr) != 1) {
    ERR_clear_error();
    throw BridgeError("--ca " + ca_.string() +
                      ": no certificate to be read; take ca.pem of make-identity");
  }
}

void ServerTrust::begin(ssl_st* connection) {
  refusal_.clear();
  SSL_set_ex_data(connection, index_of_trust(), this);
  X509_VERIFY_PARAM* const rules = SSL_get0_param(connection);
  std::array<unsigned char, sizeof(in6_addr)> address{};
  const bool numeric = inet_pton(AF_INET, host_.c_str(), address.data()) == 1 ||
                       inet_pton(AF_INET6, host_.c_str(), address.data()) == 1;
  if (numeric) {
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
  Digest seen{};
  unsigned length = 0;
  if (certificate == nullptr || X509_digest(certificate, EVP_sha256(), seen.data(), &length) != 1) {
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
  if (fingerprint_) {
    if (*fingerprint_ == seen) return true;
    refusal_ = "its certificate has another fingerprint, " + text_of(seen) +
               "; somebody is in between, or serve was started anew: compare with what it prints";
    return false;
  }
  if (!ca_.empty()) {
    if (verified) return true;
    refusal_ = "--ca " + ca_.string() + " does not vouch for it (" +
               X509_verify_cert_error_string(error) + "); its fingerprint is " + text_of(seen);
    return false;
  }
  refusal_ = "nobody vouches for its certificate; where serve prints the same, add --fingerprint " +
             text_of(seen);
  return false;
}

}  // namespace kerf::bridge
