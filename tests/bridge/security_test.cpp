// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <doctest/doctest.h>
#include <openssl/ssl.h>
#include <sys/stat.h>

#include "bridge/net/address.hpp"
#include "bridge/net/certificate.hpp"
#include "bridge/net/tokens.hpp"
#include "tests/bridge/server_bench.hpp"

using namespace kerf;
using namespace kerf::bridge;
using namespace kerf::test;

namespace {

namespace fs = std::filesystem;

struct IdentityFolder {
  IdentityFolder() {
    umask(077);
    IdentityOptions options;
    options.folder = folder.path / "identity";
    options.hosts = {"127.0.0.1", "lab-pc", "::1"};
    run_make_identity(options);
    path = options.folder;
  }
  TestFolder folder;
  fs::path path;
};

void write(const fs::path& file, const std::string& text) {
  std::ofstream(file) << text;
}

template <class Call>
std::string refusal(Call call) {
  try {
    call();
  } catch (const BridgeError& error) {
    return error.what();
  }
  return "not refused";
}

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace

TEST_CASE("an identity is private, and its CA vouches for the machine's names") {
  const IdentityFolder identity;
  for (const char* name : {"ca-key.pem", "key.pem"}) {
    CHECK((fs::status(identity.path / name).permissions() & fs::perms(0077)) == fs::perms::none);
  }
  const TlsKeys keys = load_tls_keys(identity.path);
  CHECK(keys.names == std::vector<std::string>{"lab-pc"});
  CHECK(keys.fingerprint.size() == 32 * 3 - 1);
  ServerSetup setup;
  setup.tls = keys;
  const TestController controller;
  const TestBridge bridge(setup);
  const std::string ca = (identity.path / "ca.pem").string();
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

TEST_CASE("a second machine gets its certificate of the same CA") {
  const IdentityFolder identity;
  const auto ca = fs::last_write_time(identity.path / "ca.pem");
  const std::string before = load_tls_keys(identity.path).fingerprint;
  IdentityOptions options;
  options.folder = identity.path;
  options.hosts = {"127.0.0.1"};
  run_make_identity(options);
  CHECK(fs::last_write_time(identity.path / "ca.pem") == ca);
  CHECK(load_tls_keys(identity.path).fingerprint != before);
}

TEST_CASE("an identity that does not hold is refused with its reason") {
  const IdentityFolder identity;
  const auto load = [&identity] { return refusal([&] { (void)load_tls_keys(identity.path); }); };
  CHECK(load() == "not refused");
  fs::permissions(identity.path / "key.pem", fs::perms(0640));
  CHECK(has(load(), "chmod 600"));
  fs::permissions(identity.path / "key.pem", fs::perms(0600));
  const Key other = new_key();
  write(identity.path / "key.pem", pem_of(other.get()));
  CHECK(has(load(), "is not that of cert.pem"));
  CertificateSpec spec;
  spec.name = "old", spec.hosts = {"127.0.0.1"}, spec.days = -1;
  write(identity.path / "cert.pem",
        pem_of(new_certificate(spec, other.get(), nullptr, nullptr).get()));
  CHECK(has(load(), "the certificate ended on"));
  write(identity.path / "cert.pem", "nonsense");
  CHECK(has(load(), "no certificate"));
  fs::remove(identity.path / "cert.pem");
  CHECK(has(load(), "make-identity"));
  IdentityOptions options;
  options.folder = identity.path;
  options.hosts = {"a,DNS:b"};
  CHECK(has(refusal([&] { run_make_identity(options); }), "no name and no address"));
}

TEST_CASE("a certificate is made for names and addresses only, and what is neither is told") {
  const TestFolder folder;
  const auto make = [&folder](const std::string& host) {
    IdentityOptions options;
    options.folder = folder.path / "identity";
    options.hosts = {"10.0.0.1", host};
    const std::string line = refusal([&] { run_make_identity(options); });
    CHECK(std::count_if(line.begin(), line.end(), [](unsigned char c) { return c < ' '; }) == 0);
    return line;
  };
  CHECK(has(make(""), "--host : is empty"));
  for (const char* strange :
       {" ", "lab pc", "lab\npc", "lab/pc", "lab,pc", "lab;pc", "a=b", "lab_pc!", "läb"}) {
    CHECK(has(make(strange), "no name and no address"));
  }
  CHECK(has(make("*"), "wildcard"));
  CHECK(has(make("*.lab.example"), "wildcard"));
  CHECK(has(make("https://lab-pc"), "URL"));
  CHECK(has(make("lab-pc:7400"), "a port does not belong here"));
  CHECK(has(make("[::1]"), "without brackets"));
  CHECK(has(make("fe80::1::2"), "no IPv6 address"));
  CHECK(has(make("10.0.0.256"), "no IPv4 address"));
  CHECK(has(make("10.0.0"), "no IPv4 address"));
  CHECK(has(make(".lab"), "before or after a dot"));
  CHECK(has(make("lab."), "before or after a dot"));
  CHECK(has(make("lab..pc"), "before or after a dot"));
  CHECK(has(make("-lab"), "at an end of a part"));
  CHECK(has(make("lab-.pc"), "at an end of a part"));
  const std::string label(63, 'a');
  CHECK(has(make(label + 'a'), "longer than 63"));
  const std::string longest = label + '.' + label + '.' + label + '.' + std::string(61, 'a');
  CHECK(has(make(longest + 'a'), "longer than 253"));
  CHECK(make(std::string(100'000, 'a')).size() < 200);
  CHECK(!fs::exists(folder.path / "identity"));
  for (const std::string& host : {longest, label, std::string("a"), std::string("lab_pc-3.example"),
                                  std::string("::1"), std::string("3com.example")}) {
    CHECK(make(host) == "not refused");
    CHECK(load_tls_keys(folder.path / "identity").chain_pem.size() > 0);
  }
}

TEST_CASE("tokens come from files that nobody else reads") {
  const TestFolder folder;
  const fs::path file = folder.path / "tokens";
  const auto add = [&file] {
    return refusal([&] {
      Tokens tokens;
      tokens.add_file(file, "--token-file", Right::look);
    });
  };
  CHECK(has(add(), "--token-file"));
  fs::create_directory(file);
  CHECK(has(add(), "is a folder"));
  fs::remove(file);
  write(file, "# who may look\n\n  \n");
  CHECK(has(add(), "no token"));
  write(file, "short\n");
  CHECK(has(add(), "no token; take 16"));
  write(file, "0123456789abcdef # ana\r\n0123456789-ABC_DEF\n");
  fs::permissions(file, fs::perms(0604));
  CHECK(has(add(), "chmod 600"));
  fs::permissions(file, fs::perms(0600));
  CHECK(add() == "not refused");
  Tokens tokens;
  tokens.add_file(file, "--token-file", Right::look);
  CHECK(tokens.first() == "0123456789abcdef");
  CHECK(tokens.right_of("0123456789-ABC_DEF") == Right::look);
  CHECK(tokens.right_of("0123456789abcdeF") == Right::none);
  CHECK(tokens.right_of("") == Right::none);
  tokens.add("0123456789abcdef", Right::command);  // in both files
  CHECK(tokens.right_of("0123456789abcdef") == Right::command);
  CHECK(new_token().size() == 32);
  CHECK(new_token() != new_token());
}

TEST_CASE("targets, cookies and hosts come apart as browsers put them together") {
  CHECK(query_value("/?token=abc", "token") == "abc");
  CHECK(query_value("/?a=1&token=abc&b", "token") == "abc");
  CHECK(query_value("/?xtoken=abc", "token").empty());
  CHECK(query_value("/?token=", "token").empty());
  CHECK(query_value("/token=abc", "token").empty());
  CHECK(path_of("/a?b?c") == "/a");
  CHECK(cookie_value("a=1; kerf7400=xyz; b=2", "kerf7400") == "xyz");
  CHECK(cookie_value("kerf74000=xyz", "kerf7400").empty());
  CHECK(cookie_value("", "kerf7400").empty());
  CHECK(host_name("lab-pc:7400") == "lab-pc");
  CHECK(host_name("lab-pc") == "lab-pc");
  CHECK(host_name("[::1]:7400") == "::1");
  CHECK(host_name("[::1").empty());
  CHECK(is_own_host("10.1.2.3", {}));
  CHECK(is_own_host("fe80::1", {}));
  CHECK(is_own_host("LAB-pc", {"lab-PC"}));
  CHECK(!is_own_host("10.1.2.3.evil.example", {}));
  CHECK(!is_own_host("", {"lab-pc"}));
  CHECK(is_own_origin("", "a:1", true));
  CHECK(is_own_origin("https://a:1", "a:1", true));
  CHECK(!is_own_origin("http://a:1", "a:1", true));
  CHECK(!is_own_origin("https://a:12", "a:1", true));
}
