// SPDX-License-Identifier: Apache-2.0
#include "shared/text/toml.hpp"

#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "shared/text/text.hpp"

namespace kerf::toml_test {

TEST_CASE("a tree keeps the order, the places and the types of its file") {
  const TomlNode file = parse_toml("b = 2\n[t]\na = 0.5\nflag = true\n[[list]]\nword = 'x'\n");
  std::vector<std::string> keys;
  for (const TomlNode& entry : file.entries) keys.push_back(entry.key);
  CHECK(keys == std::vector<std::string>{"b", "t", "list"});
  CHECK(file.find("t.a")->line == 3);
  CHECK(file.find("b")->number() == 2.0);
  CHECK(file.find("t.a")->number() == 0.5);
  CHECK_FALSE(file.find("t.flag")->number());
  CHECK(std::get<bool>(file.find("t.flag")->value));
  CHECK(file.find("list")->form == TomlNode::Form::array);
  CHECK(file.find("list")->entries[0].find("word")->shown == "\"x\"");
  CHECK(file.find("t.none") == nullptr);
}

TEST_CASE("what is no TOML says where, and a header of a sign ends no program") {
  try {
    static_cast<void>(parse_toml("a = 1\nb = = 2\n"));
    FAIL("accepted");
  } catch (const TomlError& error) {
    CHECK(error.line == 2);
    CHECK(error.column > 1);
  }
  CHECK_THROWS_AS(static_cast<void>(parse_toml("[!]")), TomlError);
}

TEST_CASE("long values and strange characters stay on one readable line") {
  const TomlNode file = parse_toml("a = \"x\\ny\"\nb = [" + std::string(200, ' ') + "1, 2]\n" +
                                   "c = '" + std::string(500, 'z') + "'");
  CHECK(file.find("a")->shown == "\"x\\ny\"");
  CHECK(file.find("b")->shown == "[1, 2]");
  CHECK(file.find("c")->shown == '"' + std::string(59, 'z') + "...");
  CHECK(listed(std::vector<std::string>{"a", "b"}) == "a, b");
}

}  // namespace kerf::toml_test
