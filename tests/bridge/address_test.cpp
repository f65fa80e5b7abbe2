// SPDX-License-Identifier: Apache-2.0
#include "bridge/net/address.hpp"

#include <string>

#include <doctest/doctest.h>

namespace kerf::address_test {

using namespace kerf::bridge;

TEST_CASE("an address is taken as serve prints it and as a browser shows it") {
  const BridgeAddress one = parse_address("https://10.77.0.1:7412/?token=0123abcdef_-");
  CHECK(one.secure);
  CHECK(one.host == "10.77.0.1");
  CHECK(one.port == "7412");
  CHECK(one.token == "0123abcdef_-");
  CHECK(one.host_and_port() == "10.77.0.1:7412");
  const BridgeAddress two = parse_address("wss://lab-3.example");
  CHECK(two.host == "lab-3.example");
  CHECK(two.port == "7400");
  CHECK(two.token.empty());
  const BridgeAddress three = parse_address("ws://[::1]:65535?token=a");
  CHECK(!three.secure);
  CHECK(three.host == "::1");
  CHECK(three.host_and_port() == "[::1]:65535");
  CHECK(three.token == "a");
  CHECK(three.path.empty());
  CHECK(parse_address("http://127.0.0.1:1/").port == "1");
  const BridgeAddress proxy = parse_address("https://lab.example/rooms/kerf.1/?token=a");
  CHECK(proxy.port == "443");  // a browser shows no usual port
  CHECK(proxy.path == "/rooms/kerf.1");
  CHECK(proxy.origin() == "https://lab.example");
  CHECK(parse_address("http://[::1]/kerf").origin() == "http://[::1]");
  CHECK(parse_address("ws://localhost:80/kerf?token=a").path == "/kerf");
  CHECK(parse_address("wss://a:80").origin() == "https://a:80");
  CHECK(parse_address("ws://localhost:7400/?token=a").host == "localhost");
}

TEST_CASE("an address that is none is refused in one line that keeps the token to itself") {
  for (const char* text : {"",
                           "wss://",
                           "ws://",
                           "10.77.0.1:7400",
                           "ftp://a",
                           "wss://:7400",
                           "wss://a:0",
                           "wss://a:65536",
                           "wss://a:7400x",
                           "wss://a:-1",
                           "wss://a:",
                           "wss://[::1",
                           "wss://[::1]7400",
                           "wss://a b",
                           "wss://a\r\nHost: b",
                           "wss://a/../other?token=secret",
                           "wss://a//other?token=secret",
                           "wss://a/o%20ther?token=secret",
                           "wss://a/other#elsewhere",
                           "wss://a/?token=",
                           "wss://a/?token=sec ret",
                           "wss://a/?token=sec&ret",
                           "wss://a/?token=secret\r\nX: y",
                           "wss://user@a",
                           "ws://10.77.0.1:7400/?token=secret",
                           "ws://127.evil.example/?token=secret",
                           "http://localhost.example/?token=secret",
                           "wss://[a]b/?token=secret"}) {
    CAPTURE(text);
    try {
      static_cast<void>(parse_address(text));
      FAIL("taken");
    } catch (const BridgeError& error) {
      const std::string line = error.what();
      CHECK(line.find("secret") == std::string::npos);
      CHECK(line.find('\n') == std::string::npos);
      CHECK(line.starts_with("join: "));
    }
  }
  CHECK_THROWS_AS(static_cast<void>(parse_address("wss://" + std::string(300, 'a'))), BridgeError);
}

TEST_CASE("the address of a proxy is one that a browser opens, without a token") {
  const BridgeAddress one = parse_public_url("https://lab.example/kerf/");
  CHECK(one.origin() + one.path == "https://lab.example/kerf");
  CHECK(parse_public_url("http://localhost:8080").origin() == "http://localhost:8080");
  for (const char* text :
       {"", "lab.example", "wss://lab.example", "https://", "https://a/?token=secret",
        "https://a?secret", "https://a:0", "http://lab.example/kerf", "https://a/kerf\r\nX: y",
        "https://a/#kerf", "https://secret@a"}) {
    CAPTURE(text);
    try {
      static_cast<void>(parse_public_url(text));
      FAIL("taken");
    } catch (const BridgeError& error) {
      const std::string line = error.what();
      CHECK(line.starts_with("--public-url "));
      CHECK(line.find('\n') == std::string::npos);
    }
  }
}

}  // namespace kerf::address_test
