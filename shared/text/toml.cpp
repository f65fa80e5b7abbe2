// SPDX-License-Identifier: Apache-2.0
#include "shared/text/toml.hpp"

#include <algorithm>
#include <sstream>
#include <type_traits>
#include <utility>

#include "shared/text/text.hpp"

// toml++ without exceptions. Debian's 3.3.0 asserts that a table header begins with a letter of a
// key before it has looked: `[!]` in a file would end the program. The check behind the assertion
// reports that properly, so assertions are off here, in every build type (with NDEBUG they would
// become assumptions).
#pragma push_macro("NDEBUG")
#undef NDEBUG
#define TOML_ASSERT(expr) static_cast<void>(0)
#define TOML_EXCEPTIONS 0
#include <toml++/toml.h>
#pragma pop_macro("NDEBUG")

namespace kerf {
namespace {

constexpr std::size_t kLongestShown = 60;  // characters of a value that a message repeats

TomlNode node_of(const toml::node& from) {
  TomlNode to;
  to.line = from.source().begin.line;
  if (const toml::table* table = from.as_table()) {
    for (const auto& [key, value] : *table) {
      TomlNode& entry = to.entries.emplace_back(node_of(value));
      entry.key = key.str();
      entry.key_line = key.source().begin.line;
      entry.key_column = key.source().begin.column;
    }
    // toml++ sorts by the alphabet.
    std::ranges::stable_sort(to.entries, {}, [](const TomlNode& entry) {
      return std::pair(entry.key_line, entry.key_column);
    });
    to.shown = "{..}";
  } else if (const toml::array* array = from.as_array()) {
    to.form = TomlNode::Form::array;
    for (const toml::node& entry : *array) {
      to.entries.push_back(node_of(entry));
      if (to.shown.size() <= kLongestShown) {
        to.shown += (to.shown.empty() ? "[" : ", ") + to.entries.back().shown;
      }
    }
    to.shown += to.shown.empty() ? "[]" : "]";
  } else {
    to.form = TomlNode::Form::value;
    if (const auto flag = from.as_boolean()) to.value = flag->get();
    if (const auto whole = from.as_integer()) to.value = whole->get();
    if (const auto number = from.as_floating_point()) to.value = number->get();
    if (const auto text = from.as_string()) to.value = text->get();
    to.shown = one_line(written(to.value));
    if (to.shown.empty()) {  // a date or a time
      std::ostringstream text;
      text << toml::node_view(from);
      to.shown = text.str();
    }
  }
  if (to.shown.size() > kLongestShown) to.shown = to.shown.substr(0, kLongestShown) + "...";
  return to;
}

/// `problem; remedy` for text that is not TOML. May hold control characters of the text.
std::string problem_of(const toml::parse_error& error) {
  std::string problem(error.description());
  if (problem.starts_with("Error while parsing ")) problem.erase(0, problem.find(": ") + 2);
  const auto says = [&](const char* what) { return problem.find(what) != problem.npos; };
  if (says("redefine existing")) return problem + "; leave one of the two out";
  // The library's words for these contain no remedy; a number is quoted in them.
  for (const char* range : {"' could not be interpreted as a value", "' is not representable"}) {
    if (!says(range)) continue;
    return problem.substr(1, problem.find(range) - 1) + " is out of the range of numbers; " +
           "use a whole number of 64 bits, or one up to 1e308";
  }
  if (says("invalid utf-8"))
    return "this is no text in UTF-8; name another file, or save it as UTF-8";
  if (says("encountered end-of-file"))
    return "the text ends within a value; close it, or copy it again";
  if (says("maximum nested")) return "lists stand in lists more than 256 deep; write fewer";
  if (says("unescaped control characters"))
    return "text does not end on its line; close its quotes";
  if (says("could not determine value type")) return "this is no value; text stands in quotes";
  return problem + "; correct the TOML syntax here";
}

}  // namespace

const TomlNode* TomlNode::find(std::string_view path) const {
  const std::size_t dot = path.find('.');
  const auto found = std::ranges::find(entries, path.substr(0, dot), &TomlNode::key);
  if (found == entries.end()) return nullptr;
  return dot == path.npos ? &*found : found->find(path.substr(dot + 1));
}

std::optional<double> TomlNode::number() const {
  if (const auto* whole = std::get_if<std::int64_t>(&value)) return static_cast<double>(*whole);
  if (const auto* real = std::get_if<double>(&value)) return *real;
  return std::nullopt;
}

TomlNode parse_toml(std::string_view text) {
  const toml::parse_result parsed = toml::parse(text);
  if (parsed) return node_of(parsed.table());
  const auto at = parsed.error().source().begin;
  throw TomlError(problem_of(parsed.error()), at.line, at.column);
}

std::string written(const TomlValue& value) {
  const auto text = [](const auto& held) -> std::string {
    using T = std::remove_cvref_t<decltype(held)>;
    if constexpr (std::is_same_v<T, std::monostate>) return "";
    if constexpr (std::is_same_v<T, bool>) return held ? "true" : "false";
    if constexpr (std::is_same_v<T, std::int64_t>) return std::to_string(held);
    if constexpr (std::is_same_v<T, double>) return number_text(held);
    if constexpr (std::is_same_v<T, std::string>) return '"' + held + '"';
    if constexpr (std::is_same_v<T, std::vector<double>>) {
      std::string list;
      for (const double number : held) list += (list.empty() ? "" : ", ") + number_text(number);
      return "[" + list + "]";
    }
    if constexpr (std::is_same_v<T, NamedNumbers>) {
      std::string list = "{ name = \"" + held.name + '"';
      for (const auto& [name, number] : held.numbers) {
        list += ", " + name + " = " + number_text(number);
      }
      return list + " }";
    }
  };
  return std::visit(text, value);
}

}  // namespace kerf
