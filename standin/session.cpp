// SPDX-License-Identifier: Apache-2.0
#include "standin/session.hpp"

#include <algorithm>
#include <cstdio>

#include "shared/text/text.hpp"

namespace kerf::standin {
namespace {

/// Bytes of the UTF-8 character at the start of `text`; 0 if that is none.
std::size_t character_at(std::string_view text) noexcept {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char lead = byte(0);
  if (lead < 0x80) return 1;
  const std::size_t bytes = lead < 0xc2   ? 0
                            : lead < 0xe0 ? 2
                            : lead < 0xf0 ? 3
                            : lead < 0xf5 ? 4
                                          : 0;
  if (bytes == 0 || text.size() < bytes) return 0;
  for (std::size_t i = 1; i < bytes; ++i) {
    if ((byte(i) & 0xc0) != 0x80) return 0;
  }
  // Too long for its number, half of a pair of UTF-16, or above the last number.
  const bool is_wrong = (lead == 0xe0 && byte(1) < 0xa0) || (lead == 0xed && byte(1) > 0x9f) ||
                        (lead == 0xf0 && byte(1) < 0x90) || (lead == 0xf4 && byte(1) > 0x8f);
  return is_wrong ? 0 : bytes;
}

}  // namespace

void complain(const std::string& library, std::string_view line) noexcept {
  std::string shown;
  while (!line.empty()) {
    const std::size_t bytes = character_at(line);
    if (bytes > 0) {
      shown += escaped(line.substr(0, bytes));
    } else {
      constexpr std::string_view kDigits = "0123456789abcdef";
      const auto byte = static_cast<unsigned char>(line.front());
      shown.append("\\x").append({kDigits[byte >> 4], kDigits[byte & 0xf]});
    }
    line.remove_prefix(std::max<std::size_t>(bytes, 1));
  }
  std::fprintf(stderr, "kerf stand-in %s: %s\n", library.c_str(), shown.c_str());
}

}  // namespace kerf::standin
