// SPDX-License-Identifier: Apache-2.0
#include "bridge/net/qr_code.hpp"

#include <cstddef>
#include <string>
#include <vector>

#include <doctest/doctest.h>
#include <qrencode.h>

using kerf::bridge::qr_code;

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

TEST_CASE("what no code holds is one line") {
  CHECK(qr_code(std::string(4000, 'x')) == "no QR code: the address is too long for one\n");
}
