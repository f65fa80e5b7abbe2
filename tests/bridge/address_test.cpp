// SPDX-License-Identifier: Apache-2.0
#include "bridge/net/address.hpp"

#include <string>

#include <doctest/doctest.h>

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
  CHECK(parse_address("http://127.0.0.1:1/").port == "1");
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
                           "wss://a/other?token=secret",
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
