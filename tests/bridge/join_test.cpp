// SPDX-License-Identifier: Apache-2.0
// What `join` says where it cannot work: one line, at once.
#include "bridge/join/join.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <string>

#include <arpa/inet.h>
#include <doctest/doctest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "bridge/net/address.hpp"
#include "bridge/net/certificate.hpp"
#include "tests/bridge/join_words.hpp"
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

/// A port that is taken, so that nobody else takes it, and at which nobody listens.
class ClosedPort {
 public:
  ClosedPort() : fd_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t bytes = sizeof address;
    bind(fd_, reinterpret_cast<const sockaddr*>(&address), bytes);
    getsockname(fd_, reinterpret_cast<sockaddr*>(&address), &bytes);
    port_ = ntohs(address.sin_port);
  }
  ~ClosedPort() { close(fd_); }
  ClosedPort(const ClosedPort&) = delete;
  ClosedPort& operator=(const ClosedPort&) = delete;
  [[nodiscard]] std::string place() const { return "127.0.0.1:" + std::to_string(port_); }

 private:
  int fd_;
  unsigned port_ = 0;
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
    const std::string line = first_words(options);
    if (line.starts_with("joined ")) return "joined";
    CHECK(std::count(line.begin(), line.end(), '\n') == 0);
    CHECK(line.starts_with(place() + ": "));
    return line.substr(place().size() + 2);
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
    CHECK(good.ends() == "the token is not one of its own; take the wss:// address it prints");
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

TEST_CASE("join tells at once what keeps it from a picture, and gives up where it is asked to") {
  const TestBridge bridge;  // without a controller
  const std::string place = "127.0.0.1:" + std::to_string(bridge.port());
  const auto with = [&place](const std::string& token) {
    JoinOptions options;
    options.name = "join-test";
    options.address = "ws://" + place + token;
    return options;
  };
  CHECK(first_words(with("/?token=" + kLook)) == place + ": has no controller yet; trying again");
  CHECK(first_words(with("")) ==
        place + ": asks for a token; take all of the wss:// address it prints, in quotes");
  CHECK(first_words(with("/?token=wrong-0123456789")) ==
        place + ": the token is not one of its own; take the wss:// address it prints");
  JoinOptions patient = with("/?token=" + kLook);
  patient.wait_s = 0.1;
  CHECK(last_words(patient).ends_with("; gave up after 0.1 s (--wait)"));
  const ClosedPort closed;
  JoinOptions dead = with("");
  dead.address = "ws://" + closed.place();
  CHECK(first_words(dead) == closed.place() + ": Connection refused; trying again");
  dead.wait_s = 0.2;
  CHECK(last_words(dead).ends_with("; gave up after 0.2 s (--wait)"));
}

TEST_CASE("join takes its token from a file that nobody else reads") {
  const TestController controller;
  const TestBridge bridge;
  const TestFolder folder;
  JoinOptions options;
  options.name = "join-test";
  options.address = "ws://127.0.0.1:" + std::to_string(bridge.port());
  options.token_file = folder.path / "token";
  CHECK(first_words(options).starts_with("--token-file " + options.token_file.string() + ": "));
  std::ofstream(options.token_file) << "# of the lab\n" << kLook << '\n';
  fs::permissions(options.token_file, fs::perms(0644));
  CHECK(first_words(options).ends_with("is open to other users; chmod 600 it"));
  fs::permissions(options.token_file, fs::perms(0600));
  CHECK(first_words(options).starts_with("joined "));
  options.address += "/?token=" + kLook;
  CHECK(first_words(options).ends_with("the address has a token; give one of both"));
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
