// SPDX-License-Identifier: Apache-2.0
#include "controller/scene/scene_text.hpp"

#include <algorithm>
#include <array>
#include <charconv>

#include "controller/scene/scene_error.hpp"

namespace kerf {
namespace {

bool is_control(char c) {
  return static_cast<unsigned char>(c) < 0x20 || c == 0x7f;
}

}  // namespace

std::string number_text(double value) {
  std::array<char, 32> buffer{};
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  return {buffer.data(), end.ptr};
}

std::string short_text(double value) {
  constexpr int kDigits = 6;
  std::array<char, 32> buffer{};
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value,
                                 std::chars_format::general, kDigits);
  return {buffer.data(), end.ptr};
}

std::string one_line(std::string_view text) {
  constexpr std::size_t kLongestLine = 400;
  std::string line(text.substr(0, kLongestLine));
  std::replace_if(line.begin(), line.end(), is_control, ' ');
  return line;
}

void refuse(std::string_view place, std::string_view what) {
  throw SceneError(one_line(std::string(place) + std::string(what)));
}

}  // namespace kerf
