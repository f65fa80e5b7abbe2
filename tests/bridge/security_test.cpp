// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <fstream>
#include <string>

#include <doctest/doctest.h>

#include "bridge/net/address.hpp"
#include "bridge/net/tokens.hpp"
#include "tests/support/temporary_folder.hpp"

namespace kerf::security_test {

using namespace kerf::bridge;
using namespace kerf::test;

namespace {

namespace fs = std::filesystem;

void write(const fs::path& file, const std::string& text) {
  std::ofstream(file) << text;
  fs::permissions(file, fs::perms(0600));
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

TEST_SUITE_BEGIN("network");

TEST_CASE("tokens come from files that nobody else reads") {
  const TemporaryFolder folder;
  const fs::path file = folder / "tokens";
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

TEST_SUITE_END();

}  // namespace kerf::security_test
