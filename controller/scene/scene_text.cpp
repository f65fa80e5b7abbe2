// SPDX-License-Identifier: Apache-2.0
#include "controller/scene/scene_text.hpp"

#include <algorithm>
#include <array>
#include <charconv>

#include "controller/scene/scene_error.hpp"

namespace kerf {

std::string short_text(double value) {
  constexpr int kDigits = 6;
  std::array<char, 32> buffer{};
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value,
                                 std::chars_format::general, kDigits);
  return {buffer.data(), end.ptr};
}

std::string range_text(double lo, double hi) {
  const auto plain = [](double value) -> std::string {
    std::array<char, 400> buffer{};  // digits of the largest double, and more
    const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value,
                                   std::chars_format::fixed);
    return {buffer.data(), end.ptr};
  };
  return plain(lo) + " to " + plain(hi);
}

bool is_usable_text(std::string_view text) {
  return !text.empty() && text.size() <= kLongestText && one_line(text) == text;
}

void refuse(std::string_view place, std::string_view what) {
  throw SceneError(one_line(std::string(place) + std::string(what)));
}

}  // namespace kerf
