// SPDX-License-Identifier: Apache-2.0
// What `join` says where it cannot work: one line, at once.
#include "bridge/net/join.hpp"

#include <algorithm>
#include <atomic>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "bridge/net/bridge_error.hpp"
#include "bridge/net/certificate.hpp"
#include "bridge/net/identity.hpp"
#include "bridge/net/tls_keys.hpp"
#include "tests/bridge/server_bench.hpp"

using namespace kerf;
using namespace kerf::bridge;
using namespace kerf::test;

namespace {

namespace fs = std::filesystem;

/// A lab: a CA, and certificates by it.
struct Lab {
  Lab() {
    IdentityOptions options;
    options.folder = folder.path;
    options.hosts = {"127.0.0.1"};
    run_make_identity(options);
  }
  [[nodiscard]] std::string text(const char* name) const {
    std::ifstream in(folder.path / name);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  /// Of a server `host`, for so many days from now.
  [[nodiscard]] TlsKeys keys(const char* host, int days) const {
    const Certificate ca = certificate_of(text("ca.pem"));
    const Key ca_key = key_of(text("ca-key.pem")), key = new_key();
    const CertificateSpec spec{.name = host, .hosts = {host}, .days = days};
    const Certificate own = new_certificate(spec, key.get(), ca.get(), ca_key.get());
    return {pem_of(own.get()) + pem_of(ca.get()), pem_of(key.get()), fingerprint_of(own.get()), {}};
  }
  TestFolder folder;
};

/// A bridge with these keys, and how a join ends that looks at it.
struct Attempt {
  explicit Attempt(const TlsKeys& keys) : bridge(setup_of(keys)) {
    options.name = "join-test";
    address("wss://", kLook);
  }
  static ServerSetup setup_of(const TlsKeys& keys) {
    ServerSetup setup;
    setup.tls = keys;
    return setup;
  }
  void address(const std::string& scheme, const std::string& token) {
    options.address = scheme + place() + "/?token=" + token;
  }
  [[nodiscard]] std::string place() const { return "127.0.0.1:" + std::to_string(bridge.port()); }

  /// The one line; "joined" where it goes on.
  [[nodiscard]] std::string ends() const {
    std::atomic<bool> stop{false};
    struct Watch : std::stringbuf {  // ends the join as soon as it says something
      explicit Watch(std::atomic<bool>& flag) : stop(flag) {}
      int sync() override {
        stop = true;
        return 0;
      }
      std::atomic<bool>& stop;
    } watch(stop);
    std::ostream said(&watch);
    try {
      run_join(options, stop, said);
    } catch (const BridgeError& error) {
      const std::string line = error.what();
      CHECK(std::count(line.begin(), line.end(), '\n') == 0);
      CHECK(line.starts_with(place() + ": "));
      return line.substr(place().size() + 2);
    }
    return watch.str().find(" joined ") != std::string::npos ? "joined" : watch.str();
  }
  TestBridge bridge;
  JoinOptions options;
};

}  // namespace

TEST_CASE(
    "join believes the lab's CA for the host and the time of a certificate, and else says why") {
  const Lab lab, foreign;
  const fs::path ca = lab.folder.path / "ca.pem";
  const TestController controller;
  {
    Attempt good(lab.keys("127.0.0.1", 2));
    good.options.ca = ca;
    CHECK(good.ends() == "joined");
    good.options.ca = foreign.folder.path / "ca.pem";
    CHECK(good.ends().starts_with("--ca " + good.options.ca.string() + " does not vouch for it ("));
    good.options.ca.clear();
    CHECK(good.ends().starts_with("nobody vouches for its certificate; "));
    const std::string told = lab.keys("127.0.0.1", 2).fingerprint;  // of another one
    good.options.fingerprint = told;
    CHECK(good.ends().starts_with("its certificate has another fingerprint, "));
    good.options.fingerprint.clear();
    good.options.ca = ca;
    good.address("wss://", "look-0123456789abcdeF");
    CHECK(good.ends() == "the token is not one of its own; take the address it prints");
    good.address("ws://", kLook);
    CHECK(good.ends() == "takes no unencrypted viewers; take wss://");
  }
  {
    Attempt other_host(lab.keys("127.0.0.2", 2));
    other_host.options.ca = ca;
    const std::string line = other_host.ends();
    CHECK(line.starts_with("--ca " + ca.string() + " does not vouch for it (IP address mismatch)"));
  }
  {
    Attempt named(lab.keys("lab-pc", 2));
    named.options.ca = ca;
    CHECK(named.ends().find("does not vouch for it (IP address mismatch)") != std::string::npos);
  }
  for (const bool by_fingerprint : {false, true}) {
    const TlsKeys keys = lab.keys("127.0.0.1", -1);
    Attempt expired(keys);
    if (by_fingerprint) {
      expired.options.fingerprint = keys.fingerprint;
    } else {
      expired.options.ca = ca;
    }
    CHECK(expired.ends() ==
          "its certificate: certificate has expired; set the clock, or make-identity there again");
  }
}

TEST_CASE("join takes a fingerprint however it is written") {
  const Lab lab;
  const TestController controller;
  const TlsKeys keys = lab.keys("127.0.0.1", 2);
  Attempt attempt(keys);
  std::string bare;
  for (const char c : keys.fingerprint) {
    if (c != ':') bare += static_cast<char>(c >= 'A' ? c - 'A' + 'a' : c);
  }
  for (const std::string& text : {keys.fingerprint, bare}) {
    attempt.options.fingerprint = text;
    CHECK(attempt.ends() == "joined");
  }
}
