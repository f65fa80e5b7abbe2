// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/file/header_fields.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <sstream>
#include <system_error>

#include "controller/input/load_error.hpp"
#include "shared/numeric/elementary.hpp"
#include "shared/text/text.hpp"

namespace kerf {
namespace fs = std::filesystem;

std::string lower(std::string text) {
  for (char& c : text) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return text;
}

void refuse_not_finite(const fs::path& path, std::uint64_t count, std::uint64_t first_index,
                       std::uint64_t nx, std::uint64_t ny) {
  std::ostringstream text;
  text << path.string() << ": " << count << (count == 1 ? " voxel is" : " voxels are")
       << " NaN or infinite, the first at (" << first_index % nx << ", " << first_index / nx % ny
       << ", " << first_index / nx / ny << "); replace them with the value of air";
  throw LoadError(text.str());
}

void refuse_unreadable(const fs::path& path, const std::string& reason) {
  std::error_code fault;
  if (fs::file_size(path, fault) == 0 && !fault) {
    throw LoadError(path.string() + ": is empty; copy the file again");
  }
  throw LoadError(one_line(path.string() + ": cannot be read (" + reason +
                           "); check that the file is whole and of the kind its name says"));
}

void refuse_truncated(const std::string& file, std::uint64_t held, std::uint64_t expected) {
  std::ostringstream text;
  text << file << ": " << held << " of " << expected
       << " bytes of voxels; the file is cut off, copy it again";
  throw LoadError(text.str());
}

namespace volume {
namespace {

template <class Number>
std::optional<Number> parsed(std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  Number value{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  const bool all = error == std::errc{} && end == word.data() + word.size();
  return all ? std::optional(value) : std::nullopt;
}

}  // namespace

HeaderLines::HeaderLines(const fs::path& path) {
  constexpr std::uintmax_t kLongest = std::uintmax_t{16} << 20;
  const std::uintmax_t size = fs::file_size(path);
  if (size == 0) refuse_unreadable(path, "");
  text_.resize(std::min(size, kLongest));
  std::ifstream in(path, std::ios::binary);
  in.read(text_.data(), static_cast<std::streamsize>(text_.size()));
  text_.resize(static_cast<std::size_t>(in.gcount()));
}

std::optional<std::string> HeaderLines::next() {
  if (at_ == text_.size()) return std::nullopt;
  const std::size_t end = std::min(text_.find('\n', at_), text_.size());
  std::string line = text_.substr(at_, end - at_);
  at_ = std::min(end + 1, text_.size());
  if (line.ends_with('\r')) line.pop_back();
  return line;
}

std::string stripped(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r\n\v\f";
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return std::string(text.substr(first, text.find_last_not_of(kBlanks) - first + 1));
}

std::string squeezed(std::string_view text, std::string_view without) {
  std::string all = lower(std::string(text));
  std::erase_if(all, [&](char c) { return without.find(c) != std::string_view::npos; });
  return all;
}

std::vector<std::string> words_of(const std::string& text) {
  std::istringstream in(text);
  std::vector<std::string> words;
  for (std::string word; in >> word;) words.push_back(word);
  return words;
}

std::optional<std::int64_t> whole_number(std::string_view word) {
  return parsed<std::int64_t>(word);
}

std::optional<Written> header_number(std::string_view word) {
  const std::optional<double> value = parsed<double>(word);
  if (!value || std::isinf(*value)) return std::nullopt;
  const std::size_t exponent_at = word.find_first_of("eE");
  const std::string_view mantissa = word.substr(0, exponent_at);
  const std::size_t point = mantissa.find('.');
  constexpr std::size_t kFewest = 3;  // digits that look rounded; 0.5 is a value of its own
  const std::size_t first = std::min(mantissa.find_first_of("123456789"), mantissa.size());
  const std::size_t digits = mantissa.size() - first - (point > first ? 1 : 0);
  if (point == std::string_view::npos || digits < kFewest) return Written{*value, 0};
  int exponent = 0;
  if (exponent_at != std::string_view::npos) {
    exponent = parsed<int>(word.substr(exponent_at + 1)).value_or(0);
  }
  const int last_digit = exponent - static_cast<int>(mantissa.size() - point - 1);
  return Written{*value, 0.5 * power_of_tenth(-last_digit)};
}

void HeaderFields::add(std::string_view key, const std::string& text) {
  const auto [field, is_new] = all_.try_emplace(squeezed(key), text);
  if (!is_new && field->second != text) {
    refuse(key, "and also " + one_line(text.substr(0, 80)) + "; keep one of the two lines");
  }
}

bool HeaderFields::has(std::string_view key) const {
  return all_.contains(squeezed(key));
}

std::string HeaderFields::text(std::string_view key) const {
  const auto field = all_.find(squeezed(key));
  return field == all_.end() ? std::string{} : field->second;
}

std::string HeaderFields::needed(std::string_view key) const {
  std::string found = text(key);
  if (found.empty()) refuse(key, "is missing; correct the header");
  return found;
}

std::vector<std::int64_t> HeaderFields::whole_numbers(std::string_view key,
                                                      std::size_t count) const {
  std::vector<std::int64_t> found;
  const std::vector<std::string> words = words_of(needed(key));
  for (const std::string& word : words) {
    if (const auto number = whole_number(word)) found.push_back(*number);
  }
  if (words.size() == count && found.size() == count) return found;
  refuse(key, "is not " + std::to_string(count) + " whole numbers; correct the header");
}

std::int64_t HeaderFields::whole_number_or(std::string_view key, std::int64_t otherwise) const {
  return has(key) ? whole_numbers(key, 1)[0] : otherwise;
}

std::vector<Written> HeaderFields::numbers(std::string_view key, std::size_t count) const {
  std::vector<Written> found;
  const std::vector<std::string> words = words_of(needed(key));
  for (const std::string& word : words) {
    if (const auto number = header_number(word)) found.push_back(*number);
  }
  if (words.size() == count && found.size() == count) return found;
  if (text(key).find(',') != std::string::npos) {
    refuse(key, "has commas in its numbers; write decimal points");
  }
  refuse(key, "is not " + std::to_string(count) + " numbers; correct the header");
}

void HeaderFields::refuse(std::string_view key, const std::string& why) const {
  constexpr std::size_t kShown = 80;
  const std::string found = text(key);
  throw LoadError(path_.string() + ": " + std::string(key) +
                  (found.empty() ? " " : ": " + one_line(found.substr(0, kShown)) + " ") + why);
}

std::optional<LengthUnit> length_unit(const std::string& word) {
  struct Row {
    std::string_view words;  ///< with a bar around each
    LengthUnit unit;
  };
  constexpr Row kRows[] = {
      {"||?|??|???|mm|millimeter|millimeters|millimetre|millimetres|", {1, 1}},
      {"|m|meter|meters|metre|metres|", {1000, 1}},
      {"|dm|decimeter|decimeters|", {100, 1}},
      {"|cm|centimeter|centimeters|centimetre|centimetres|", {10, 1}},
      {"|um|\u00b5m|\u03bcm|micron|microns|micrometer|micrometers|micrometre|micrometres|",
       {1, 1000}},
      {"|nm|nanometer|nanometers|nanometre|nanometres|", {1, 1000000}},
      {"|in|inch|inches|", {25.4, 1}}};
  const std::string barred = "|" + lower(stripped(word)) + "|";
  for (const Row& row : kRows) {
    if (row.words.find(barred) != std::string_view::npos) return row.unit;
  }
  return std::nullopt;
}

}  // namespace volume
}  // namespace kerf
