// SPDX-License-Identifier: Apache-2.0
#include <string>

#include <doctest/doctest.h>

#include "shared/text/text.hpp"

namespace kerf::words_test {

TEST_CASE("control characters stand as in C, all else stays") {
  CHECK(escaped("/home/a b/Zähne.nrrd") == "/home/a b/Zähne.nrrd");
  CHECK(escaped("a\nb\r\tc") == "a\\nb\\x0d\\x09c");
  CHECK(escaped("\x1b[31mred\x7f") == "\\x1b[31mred\\x7f");
  CHECK(escaped(std::string("a\0b", 3)) == "a\\x00b");
}

TEST_CASE("the control characters of UTF-8 too, and nothing is read beyond the end") {
  CHECK(escaped("\xc2\x9b[31m") == "\xc2\\x9b[31m");
  CHECK(escaped("\xc2\xa0\xc3\x9b") == "\xc2\xa0\xc3\x9b");
  CHECK(escaped("\xc2").size() == 1);
  CHECK(escaped("").empty());
}

TEST_CASE("what is quoted of a file is cut where nobody would read on") {
  CHECK(one_line("a\nb") == "a\\nb");
  CHECK(one_line(std::string(1000, 'x')).size() == 400);
  const std::string tabs = one_line("x" + std::string(400, '\t'));
  CHECK(tabs.size() == 397);  // of 400 bytes, four for each tab, and no part of one
  CHECK(tabs.ends_with("\\x09"));
  CHECK(one_line(tabs) == tabs);
}

}  // namespace kerf::words_test
