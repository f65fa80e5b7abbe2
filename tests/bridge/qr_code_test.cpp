// SPDX-License-Identifier: Apache-2.0
#include <cstddef>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

#include <doctest/doctest.h>
#include <qrencode.h>

#include "bridge/serve/serve.hpp"
#include "tests/support/temporary_folder.hpp"

namespace kerf::qr_code_test {

using kerf::bridge::qr_code;
using kerf::test::TemporaryFolder;

namespace {

using Modules = std::vector<std::vector<bool>>;  ///< true: black

void swallow(const std::string& what, std::string& text) {
  REQUIRE(text.compare(0, what.size(), what) == 0);
  text.erase(0, what.size());
}

/// What a camera sees of the text, by rows.
Modules modules_of(std::string text) {
  Modules rows;
  while (!text.empty()) {
    swallow("\033[30;107m", text);
    std::vector<bool> above, below;
    while (text[0] != '\033') {
      const bool blank = text[0] == ' ';
      const std::string block = blank ? " " : text.substr(0, 3);
      above.push_back(block == "\u2588" || block == "\u2580");
      below.push_back(block == "\u2588" || block == "\u2584");
      CHECK((blank || above.back() || below.back()));
      swallow(block, text);
    }
    swallow("\033[0m\n", text);
    rows.push_back(above);
    rows.push_back(below);
  }
  return rows;
}

}  // namespace

TEST_CASE("a QR code is the library's, black on white within four modules of white") {
  const std::string address = "https://192.168.178.31:7400/?token=0123456789abcdef0123456789abcdef";
  const Modules seen = modules_of(qr_code(address));
  QRcode* const code = QRcode_encodeString8bit(address.c_str(), 0, QR_ECLEVEL_L);
  REQUIRE(code != nullptr);
  const auto width = static_cast<std::size_t>(code->width);
  REQUIRE(seen.size() >= width + 8);
  for (std::size_t y = 0; y < seen.size(); ++y) {
    REQUIRE(seen[y].size() == width + 8);
    for (std::size_t x = 0; x < width + 8; ++x) {
      const bool inside = x >= 4 && y >= 4 && x < width + 4 && y < width + 4;
      const bool black = inside && (code->data[(y - 4) * width + x - 4] & 1) != 0;
      REQUIRE(seen[y][x] == black);
    }
  }
  QRcode_free(code);
  // The finder of the left upper corner: a ring about a block of 3 by 3.
  for (std::size_t i = 0; i < 7; ++i) {
    CHECK(seen[4][4 + i]);
    CHECK(seen[4 + i][4]);
    CHECK(seen[7][4 + i] == (i != 1 && i != 5));
  }
}

TEST_CASE("a decoder reads the address back") {
  if (std::system("command -v zbarimg >/dev/null") != 0) {  // NOLINT(concurrency-mt-unsafe)
    MESSAGE("skipped: zbarimg is missing; apt-get install zbar-tools");
    return;
  }
  const TemporaryFolder folder;
  constexpr std::size_t kPixels = 4;  // of a module's edge
  for (const std::string address :
       {"https://10.0.0.1:7400/?token=0123456789abcdef",
        "https://[2001:db8:85a3::8a2e:370:7334]:65535/?token=0123456789abcdef0123456789abcdef"}) {
    const Modules seen = modules_of(qr_code(address));
    const std::size_t edge = seen.size() * kPixels, wide = seen[0].size() * kPixels;
    std::ofstream picture(folder / "code.pgm", std::ios::binary);
    picture << "P5 " << wide << ' ' << edge << " 255\n";
    for (std::size_t y = 0; y < edge; ++y) {
      for (std::size_t x = 0; x < wide; ++x) {
        picture.put(seen[y / kPixels][x / kPixels] ? '\0' : '\xff');
      }
    }
    picture.close();
    const std::string text = folder / "text";
    const std::string command =
        "zbarimg -q --raw " + (folder / "code.pgm").string() + " >" + text + " 2>/dev/null";
    CHECK(std::system(command.c_str()) == 0);  // NOLINT(concurrency-mt-unsafe)
    std::string line;
    std::ifstream in(text);
    CHECK(std::getline(in, line));
    CHECK(line == address);
  }
}

TEST_CASE("what no code holds is one line") {
  CHECK(qr_code(std::string(4000, 'x')) == "no QR code: the address is too long for one\n");
}

}  // namespace kerf::qr_code_test
