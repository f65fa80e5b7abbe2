// SPDX-License-Identifier: Apache-2.0
#include "hil/script/toml_table.hpp"

#include <cmath>
#include <fstream>
#include <ios>
#include <system_error>

namespace kerf {
namespace {

constexpr std::size_t kMaxBytes = 1 << 20;

std::string text_of(double value) {
  std::string text = std::to_string(value);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text;
}

}  // namespace

double TomlTable::checked(const toml::node& node, const std::string& key, TomlRange range) const {
  if (!node.is_number()) fail(node, key, ": not a number; write one");
  const double value = *node.value<double>();
  const bool inside = std::isfinite(value) && value <= range.high &&
                      (range.above_low ? value > range.low : value >= range.low);
  if (!inside) {
    fail(node, key,
         " = " + text_of(value) + " is out of range; use " + (range.above_low ? "more than " : "") +
             text_of(range.low) + (range.above_low ? ", at most " : " to ") + text_of(range.high));
  }
  return value;
}

toml::table parse_toml(std::string_view text, const std::string& place) {
  toml::parse_result parsed = toml::parse(text);
  if (parsed) return std::move(parsed).table();
  const toml::parse_error& error = parsed.error();
  throw HilError(place + ":" + std::to_string(error.source().begin.line) + ": " +
                 toml_problem(error));
}

const toml::array& tables_of(const toml::table& file, std::string_view key, std::size_t most,
                             const std::string& place) {
  const toml::node* node = file.get(key);
  const toml::array* tables = node == nullptr ? nullptr : node->as_array();
  const std::string name(key);
  if (tables == nullptr || tables->empty() || !tables->is_array_of_tables()) {
    throw HilError(place + ": no " + name + "s; add at least one [[" + name + "]]");
  }
  if (tables->size() > most) {
    throw HilError(place + ": " + std::to_string(tables->size()) + " " + name + "s; use at most " +
                   std::to_string(most));
  }
  return *tables;
}

std::string read_small_file(const std::filesystem::path& file, const std::string& example) {
  const std::string place = file.string();
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) {
    throw HilError(place + ": not a file; name one such as " + example);
  }
  std::ifstream in(file, std::ios::binary);
  std::string text(kMaxBytes + 1, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(in.gcount()));
  if (in.bad() || (!in.eof() && text.size() <= kMaxBytes)) {
    throw HilError(place + ": cannot be read; check its rights");
  }
  if (text.size() > kMaxBytes) throw HilError(place + ": more than 1 MiB; use a shorter one");
  return text;
}

}  // namespace kerf
