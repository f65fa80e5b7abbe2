// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/file/header_fields.hpp"

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <sstream>
#include <string_view>
#include <system_error>
#include <vector>

#include "controller/scene/scene_error.hpp"
#include "controller/volume/file/volume_header.hpp"
#include "shared/text/words.hpp"

namespace kerf {
namespace fs = std::filesystem;
namespace {

/// As NrrdIO knows them; `block` has no numbers.
constexpr std::string_view kNrrdTypes =
    "signed char|int8|int8_t|uchar|unsigned char|uint8|uint8_t|short|short int|signed short|"
    "signed short int|int16|int16_t|ushort|unsigned short|unsigned short int|uint16|uint16_t|int|"
    "signed int|int32|int32_t|uint|unsigned int|uint32|uint32_t|longlong|long long|long long int|"
    "signed long long|signed long long int|int64|int64_t|ulonglong|unsigned long long|"
    "unsigned long long int|uint64|uint64_t|float|double";
constexpr std::string_view kNrrdEncodings = "raw|txt|text|ascii|hex|gz|gzip";
constexpr std::string_view kMetaTypes =
    "met_char|met_uchar|met_short|met_ushort|met_int|met_uint|met_long|met_ulong|met_long_long|"
    "met_ulong_long|met_float|met_double";

bool among(std::string_view list, const std::string& word) {
  return ("|" + std::string(list) + "|").find("|" + word + "|") != std::string::npos;
}

std::vector<std::string> words_of(const std::string& text) {
  std::istringstream in(text);
  std::vector<std::string> words;
  for (std::string word; in >> word;) words.push_back(word);
  return words;
}

template <class Number>
bool is_number(std::string_view text) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc{} && end == text.data() + text.size();
}

template <class Number>
bool all_numbers(const std::vector<std::string>& words) {
  return std::ranges::all_of(words,
                             [](const std::string& word) { return is_number<Number>(word); });
}

/// `(1,0,0)`: its numbers, where it has nothing else.
std::optional<std::size_t> numbers_of_vector(std::string text) {
  if (text.size() < 2 || text.front() != '(' || text.back() != ')') return std::nullopt;
  std::ranges::replace(text, ',', ' ');
  const auto words = words_of(text.substr(1, text.size() - 2));
  return all_numbers<double>(words) ? std::optional(words.size()) : std::nullopt;
}

/// `(1,0,0) (0,1,0) none`: such vectors alone, of `length` numbers each. A blank after a comma is
/// nothing.
bool are_vectors(const std::string& text, std::size_t length) {
  std::string tight;
  bool inside = false;
  for (const char c : text) {
    if (c == '(') inside = true;
    if (c == ')') inside = false;
    if (!(inside && c == ' ')) tight += c;
  }
  return std::ranges::all_of(words_of(tight), [&](const std::string& word) {
    return word == "none" || numbers_of_vector(word) == length;
  });
}

/// The header's fields, and the refusal of one.
struct Fields {
  const fs::path& path;
  const HeaderFields& all;

  /// Whether it is there and not as `fits` wants it.
  template <class Fits>
  void check(const char* key, const Fits& fits, const std::string& wanted) const {
    const auto field = all.find(key);
    if (field == all.end() || fits(field->second)) return;
    throw SceneError(path.string() + ": " + key + ": " + one_line(field->second.substr(0, 80)) +
                     " is not " + wanted + "; correct the header");
  }

  /// The axes, as `key` tells or as many as `sizes` has.
  void check_axes(const char* key, const char* sizes) const {
    check(
        key, [](const auto& t) { return is_number<std::uint8_t>(t); }, "a number of axes");
    const auto axes = all.find(key);
    const auto fits = [&](const std::string& text) {
      const auto words = words_of(text);
      const bool all_there = axes == all.end() || std::to_string(words.size()) == axes->second;
      return all_there && all_numbers<std::int64_t>(words);
    };
    check(sizes, fits,
          axes == all.end() ? "a whole number for each axis" : axes->second + " whole numbers");
  }
};

}  // namespace

void check_nrrd_fields(const fs::path& path, const HeaderFields& all) {
  const Fields fields{path, all};
  const auto is_type = [](const std::string& t) { return among(kNrrdTypes, lower(t)); };
  const auto is_encoding = [](const std::string& t) { return among(kNrrdEncodings, lower(t)); };
  fields.check_axes("dimension", "sizes");
  fields.check("type", is_type, "a type of numbers, such as uint16 or float");
  const auto encoding = all.find("encoding");
  if (encoding != all.end() && among("bz2|bzip2", lower(encoding->second))) {
    throw SceneError(path.string() +
                     ": encoding: bzip2 cannot be unpacked; save it as gzip or raw");
  }
  fields.check("encoding", is_encoding, "one of raw, text, hex, gzip");
  const auto all_are_numbers = [](const auto& t) { return all_numbers<double>(words_of(t)); };
  fields.check("spacings", all_are_numbers, "a number for each axis");
  const auto space = all.find("space dimension");
  const auto are_directions = [&](const std::string& t) {
    return are_vectors(t, space == all.end() || space->second == "3" ? 3 : 2);
  };
  fields.check("space directions", are_directions, "vectors such as (1,0,0) (0,1,0) (0,0,1)");
  const auto quoted = [](const std::string& t) {
    return t.starts_with('"') && std::ranges::count(t, '"') % 2 == 0;
  };
  fields.check("space units", quoted, "units in quotes, such as \"mm\" \"mm\" \"mm\"");
}

void check_meta_fields(const fs::path& path, const HeaderFields& all) {
  const Fields fields{path, all};
  const auto is_type = [](const std::string& t) { return among(kMetaTypes, lower(t)); };
  fields.check_axes("ndims", "dimsize");
  fields.check("elementtype", is_type, "a type of numbers, such as MET_SHORT");
}

}  // namespace kerf
