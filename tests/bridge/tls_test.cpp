// SPDX-License-Identifier: Apache-2.0
// TLS of both ends with PEM files, which the lines of docs/second-machine.md make.
#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <doctest/doctest.h>
#include <openssl/bio.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <openssl/x509.h>

#include "bridge/net/address.hpp"
#include "bridge/net/certificate.hpp"
#include "tests/bridge/join_words.hpp"
#include "tests/bridge/server_bench.hpp"

namespace kerf::tls_test {

using namespace kerf::bridge;
using namespace kerf::test;

namespace {

/// A CA, a server's certificate for 127.0.0.1 and a viewer's, each with its key.
struct Lab {
  Lab() {
    run(R"(sed -e ':a' -e '/\\$/N; s/\\\n//; ta' )" KERF_TEST_PAGE
        R"( | sed -n '/^ *openssl/{s/192.0.2.7/127.0.0.1/;p}' >lines; [ $(wc -l <lines) = 4 ] && sh -e lines)");
  }
  void run(const std::string& lines) const {
    const std::string command = "cd " + folder.path().string() + " && { " + lines + "\n} >log 2>&1";
    REQUIRE(std::system(command.c_str()) == 0);  // NOLINT(concurrency-mt-unsafe)
  }
  /// NAME.pem by its CA, with the other files of a server.
  void sign(const std::string& name, const std::string& host) const {
    run("openssl req -new -key key.pem -subj /CN=x -addext subjectAltName=" + host +
        " | openssl x509 -req -CA ca.pem -CAkey ca-key.pem -copy_extensions copy -days 2 -out " +
        name + ".pem");
  }
  /// old.pem: a certificate as it would be a day after its end, signed by a key. The programs
  /// `openssl` of Debian 12 and 13 share no option for that.
  void age(const char* certificate, const char* key) const {
    const Bio in = open(certificate, "r"), key_in = open(key, "r"), out = open("old.pem", "w");
    const std::unique_ptr<X509, decltype(&X509_free)> old(
        PEM_read_bio_X509(in.get(), nullptr, nullptr, nullptr), &X509_free);
    const std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)> by(
        PEM_read_bio_PrivateKey(key_in.get(), nullptr, nullptr, nullptr), &EVP_PKEY_free);
    constexpr long kDay = 86400;  // s
    X509_gmtime_adj(X509_getm_notBefore(old.get()), -2 * kDay);
    X509_gmtime_adj(X509_getm_notAfter(old.get()), -kDay);
    REQUIRE(X509_sign(old.get(), by.get(), EVP_sha256()) > 0);
    REQUIRE(PEM_write_bio_X509(out.get(), old.get()) == 1);
  }
  using Bio = std::unique_ptr<BIO, decltype(&BIO_free)>;
  [[nodiscard]] Bio open(const char* file, const char* mode) const {
    return {BIO_new_file((*this / file).c_str(), mode), &BIO_free};
  }
  [[nodiscard]] std::filesystem::path operator/(const char* name) const { return folder / name; }
  TemporaryFolder folder;
};

/// Without the checks that refuse a certificate out of date.
Tls server_tls(const Lab& lab, const char* certificate = "cert.pem") {
  Tls tls = new_tls();
  CHECK(SSL_CTX_use_certificate_chain_file(tls.get(), (lab / certificate).c_str()) == 1);
  CHECK(SSL_CTX_use_PrivateKey_file(tls.get(), (lab / "key.pem").c_str(), SSL_FILETYPE_PEM) == 1);
  return tls;
}

/// A bridge with this TLS, and how a join to it ends.
struct Attempt {
  explicit Attempt(const Tls& tls) : bridge(setup_of(tls)) {
    options.name = "join-test";
    address("wss://", kLook);
  }
  static ServerSetup setup_of(const Tls& tls) {
    ServerSetup setup;
    setup.tls = tls;
    return setup;
  }
  void address(const std::string& scheme, const std::string& token) {
    options.address = scheme + place() + "/?token=" + token;
  }
  [[nodiscard]] std::string place() const { return "127.0.0.1:" + std::to_string(bridge.port()); }

  /// The one line; "joined" if it goes on.
  [[nodiscard]] std::string ends() const {
    const std::string line = first_words(options);
    if (line.starts_with("joined ")) return "joined";
    CHECK(std::count(line.begin(), line.end(), '\n') == 0);
    if (line.starts_with(place() + ": ")) return line.substr(place().size() + 2);
    return line;
  }
  TestBridge bridge;
  JoinOptions options;
};

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace

TEST_SUITE_BEGIN("network");

TEST_CASE("a server shows its certificate over TLS 1.3 alone") {
  const Lab lab;
  ServerSetup setup;
  setup.tls = new_tls();
  show_certificate(setup.tls.get(), lab / "cert.pem", lab / "key.pem");
  CHECK(fingerprint_of(setup.tls.get()).size() == 32 * 3 - 1);
  const TestController controller;
  const TestBridge bridge(setup);
  const std::string ca = lab / "ca.pem";
  RawClient good(bridge.port());
  REQUIRE(good.start_tls(TLS1_3_VERSION, ca.c_str()));
  CHECK(has(good.ask("/?token=" + kLook), "; Secure"));
  CHECK(has(good.upgrade("/bridge?token=" + kLook), "101 "));
  CHECK(good.message().has_value());
  RawClient other_name(bridge.port());
  CHECK(!other_name.start_tls(TLS1_3_VERSION, ca.c_str(), "127.0.0.2"));
  RawClient old(bridge.port());
  CHECK(!old.start_tls(TLS1_2_VERSION));
  RawClient plain(bridge.port());
  CHECK(has(plain.ask("/?token=" + kLook), "This port speaks TLS only"));
  RawClient cut_short(bridge.port());
  cut_short.send_bytes(std::string("\x16\x03\x01\x02\x00\x01", 6));
}

TEST_CASE("a browser may use the names of the certificate") {
  const Lab lab;
  lab.sign("named", "DNS:lab-pc,IP:127.0.0.1,DNS:lab-pc.example");
  CHECK(dns_names_of(server_tls(lab, "named.pem").get()) ==
        std::vector<std::string>{"lab-pc", "lab-pc.example"});
  const Tls own = new_tls();
  show_self_signed(own.get(), own_hosts());
  CHECK(std::ranges::count(dns_names_of(own.get()), "localhost") == 1);
}

TEST_CASE("join verifies the server's certificate: its CA, host, time or fingerprint") {
  const Lab lab, foreign;
  lab.sign("other-host", "IP:127.0.0.2");
  lab.sign("named", "DNS:lab-pc");
  lab.age("cert.pem", "ca-key.pem");
  lab.run("cat cert.pem ca.pem >chain.pem; cat " + (foreign / "ca.pem").string() +
          " ca.pem >cas.pem");
  const TestController controller;
  const std::string ca = lab / "ca.pem", strange = foreign / "ca.pem";
  const std::string own = fingerprint_of(server_tls(lab).get());
  const std::string old = fingerprint_of(server_tls(lab, "old.pem").get());
  const std::string expired =
      "its certificate: certificate has expired; set the clock, or make another there";
  struct Case {
    const char* shown;
    std::string ca, fingerprint, ends;
  };
  for (const Case& one : std::vector<Case>{
           {"cert.pem", ca, "", "joined"},
           {"chain.pem", ca, "", "joined"},
           {"cert.pem", lab / "cas.pem", "", "joined"},
           {"cert.pem", "", own, "joined"},
           {"cert.pem", strange, "", "--ca " + strange + " does not vouch for it ("},
           {"cert.pem", "", "",
            "no authority that this machine knows signed its certificate; if serve prints the "
            "same, add "
            "--fingerprint " +
                own},
           {"cert.pem", "", old, "its certificate has another fingerprint, " + own},
           {"other-host.pem", ca, "",
            "--ca " + ca + " does not vouch for it (IP address mismatch)"},
           {"named.pem", ca, "", "--ca " + ca + " does not vouch for it (IP address mismatch)"},
           {"old.pem", ca, "", expired},
           {"old.pem", "", old, expired}}) {
    CAPTURE(one.shown);
    CAPTURE(one.ends);
    Attempt attempt(server_tls(lab, one.shown));
    attempt.options.ca = one.ca;
    attempt.options.fingerprint = one.fingerprint;
    const std::string line = attempt.ends();
    CHECK_MESSAGE(line.starts_with(one.ends), line);
  }
  Attempt attempt(server_tls(lab));
  attempt.options.ca = ca;
  attempt.address("wss://", "look-0123456789abcdeF");
  CHECK(attempt.ends() == "it does not know the token; take the wss:// address it prints");
  attempt.address("ws://", kLook);
  CHECK(attempt.ends() == "takes no unencrypted viewers; take wss://");
}

TEST_CASE("with --client-ca a viewer needs a certificate of that CA, and its token") {
  const Lab lab, foreign;
  lab.age("viewer.pem", "viewer-key.pem");
  const TestController controller;
  const Tls tls = server_tls(lab);
  require_client_certificate(tls.get(), lab / "ca.pem");
  Attempt attempt(tls);
  attempt.options.ca = lab / "ca.pem";
  for (int i = 0; i < 20; ++i) {  // the reason arrives before the connection ends
    CHECK(attempt.ends() ==
          "asks for a certificate that its --client-ca has signed; give --cert and --key");
  }
  attempt.options.certificate = foreign / "viewer.pem";
  attempt.options.key = foreign / "viewer-key.pem";
  // The Boost of Debian 13 adds the library's name, "(SSL routines)".
  CHECK(attempt.ends().starts_with("refuses the certificate of --cert (tlsv1 alert unknown ca"));
  attempt.options.certificate = lab / "viewer.pem";
  attempt.options.key = lab / "viewer-key.pem";
  CHECK(attempt.ends() == "joined");
  attempt.address("wss://", "look-0123456789abcdeF");
  CHECK(attempt.ends() == "it does not know the token; take the wss:// address it prints");
  attempt.options.certificate = lab / "old.pem";
  CHECK(has(attempt.ends(), "the certificate ended on"));
}

TEST_CASE("a fingerprint is 64 hex digits, with colons or without, and excludes a CA") {
  const Lab lab;
  const TestController controller;
  const Tls tls = server_tls(lab);
  Attempt attempt(tls);
  std::string bare = fingerprint_of(tls.get());
  std::erase(bare, ':');
  std::ranges::transform(bare, bare.begin(), [](unsigned char c) { return std::tolower(c); });
  attempt.options.fingerprint = bare;
  CHECK(attempt.ends() == "joined");
  const std::string plain(64, 'a');
  CHECK_NOTHROW(CertificateCheck("host", "", ""));
  CHECK_NOTHROW(CertificateCheck("host", "", "AB:cd:" + plain.substr(4)));
  for (const std::string& none :
       {plain.substr(1), plain + "0", plain + "00", plain.substr(1) + "g"}) {
    CHECK_THROWS_AS(CertificateCheck("host", "", none), BridgeError);
  }
  CHECK_THROWS_AS(CertificateCheck("host", "ca.pem", plain), BridgeError);
}

TEST_SUITE_END();

}  // namespace kerf::tls_test
