// SPDX-License-Identifier: Apache-2.0
#include "controller/scene/scene_text.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <numeric>
#include <utility>
#include <vector>

#include "controller/scene/scene_error.hpp"

namespace kerf {
namespace {

/// Insertions, deletions and exchanges that turn one word into the other.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i + 1);
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t exchanged = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({exchanged, diagonal + 1, row[j] + 1});
    }
  }
  return row.back();
}

std::string_view first_word(std::string_view key) {
  return key.substr(0, key.find('_'));
}

}  // namespace

std::string short_text(double value) {
  constexpr int kDigits = 6;
  std::array<char, 32> buffer{};
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value,
                                 std::chars_format::general, kDigits);
  return {buffer.data(), end.ptr};
}

void refuse(std::string_view place, std::string_view what) {
  throw SceneError(one_line(std::string(place) + std::string(what)));
}

std::string_view nearest(std::string_view word, std::span<const std::string_view> known) {
  for (const std::string_view name : known) {
    if (first_word(name) == first_word(word)) return name;
  }
  std::string_view best;
  // Half of the letters must be right, else the guess would only mislead.
  std::size_t best_distance = word.size() / 2 + 1;
  for (const std::string_view name : known) {
    const std::size_t distance = edit_distance(word, name);
    if (distance < best_distance) {
      best = name;
      best_distance = distance;
    }
  }
  return best;
}

}  // namespace kerf
