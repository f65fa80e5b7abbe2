// SPDX-License-Identifier: Apache-2.0
#include "hil/hand_script_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <initializer_list>
#include <iterator>
#include <string>
#include <system_error>

// Debian's toml++ 3.3.0 asserts that a table header begins with a key before it has looked: `[!]`
// would end the program. The check behind the assertion reports it properly.
#define TOML_ASSERT(expr) static_cast<void>(0)
#include <toml++/toml.h>

#include "hil/hil_error.hpp"
#include "shared/wire/omni_constants.hpp"

namespace kerf {
namespace {

constexpr std::size_t kMaxBytes = 1 << 20;
constexpr std::size_t kMaxSteps = 10'000;
constexpr double kMaxSeconds = 3600;
constexpr double kMaxLength = 1000;  // script units: far outside any arm's reach
constexpr double kMaxTurns = 10'000;
constexpr double kMaxUnitMm = 100;
constexpr double kMaxDegrees = 360;

/// A range and how to say it.
struct Range {
  double low;
  double high;
  bool above_low = false;  ///< `low` itself is refused
};
constexpr Range kLength{-kMaxLength, kMaxLength};
constexpr Range kSize{0, kMaxLength};
constexpr Range kSeconds{0, kMaxSeconds, true};

std::string text_of(double value) {
  std::string text = std::to_string(value);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text;
}

/// One table of the file with what is needed to complain about it.
class Table {
 public:
  Table(const toml::table& table, std::string place, std::string name)
      : table_(table), place_(std::move(place)), name_(std::move(name)) {}

  [[noreturn]] void fail(const toml::node& node, const std::string& key,
                         const std::string& why) const {
    const std::string dot = name_.empty() || key.empty() ? "" : ".";
    throw HilError(place_ + ":" + std::to_string(node.source().begin.line) + ": " + name_ + dot +
                   key + why);
  }
  [[noreturn]] void fail(const std::string& why) const { fail(table_, "", why); }

  void allow_only(std::initializer_list<std::string_view> keys) const {
    for (const auto& [key, node] : table_) {
      if (std::find(keys.begin(), keys.end(), key.str()) != keys.end()) continue;
      std::string known;
      for (const auto allowed : keys) known += (known.empty() ? "" : ", ") + std::string(allowed);
      fail(node, std::string(key.str()), ": unknown key; known here: " + known);
    }
  }

  [[nodiscard]] bool has(std::string_view key) const { return table_.contains(key); }

  [[nodiscard]] double number(std::string_view key, double otherwise, Range range) const {
    const toml::node* node = table_.get(key);
    return node == nullptr ? otherwise : checked(*node, std::string(key), range);
  }

  template <std::size_t N>
  [[nodiscard]] std::array<double, N> numbers(std::string_view key, std::array<double, N> otherwise,
                                              Range range) const {
    const toml::node* node = table_.get(key);
    if (node == nullptr) return otherwise;
    const toml::array* list = node->as_array();
    if (list == nullptr || list->size() != N) {
      fail(*node, std::string(key), ": not a list; write " + std::to_string(N) + " numbers");
    }
    std::array<double, N> values{};
    for (std::size_t i = 0; i < N; ++i) values[i] = checked((*list)[i], std::string(key), range);
    return values;
  }

  [[nodiscard]] std::string word(std::string_view key, const std::string& otherwise,
                                 std::initializer_list<std::string_view> words) const {
    const toml::node* node = table_.get(key);
    if (node == nullptr) return otherwise;
    const auto value = node->value<std::string>();
    if (value && std::find(words.begin(), words.end(), *value) != words.end()) return *value;
    std::string known;
    for (const auto allowed : words) known += (known.empty() ? "" : ", ") + std::string(allowed);
    fail(*node, std::string(key), ": unknown value; use one of " + known);
  }

  [[nodiscard]] bool flag(std::string_view key) const {
    const toml::node* node = table_.get(key);
    if (node == nullptr) return false;
    if (!node->is_boolean())
      fail(*node, std::string(key), ": not a truth value; use true or false");
    return node->as_boolean()->get();
  }

 private:
  [[nodiscard]] double checked(const toml::node& node, const std::string& key, Range range) const {
    if (!node.is_number()) fail(node, key, ": not a number; write one");
    const double value = *node.value<double>();
    const bool inside = std::isfinite(value) && value <= range.high &&
                        (range.above_low ? value > range.low : value >= range.low);
    if (!inside) {
      fail(node, key,
           " = " + text_of(value) + " is out of range; use " +
               (range.above_low ? "more than " : "") + text_of(range.low) +
               (range.above_low ? ", at most " : " to ") + text_of(range.high));
    }
    return value;
  }

  const toml::table& table_;
  std::string place_;
  std::string name_;
};

HandStep step_of(const Table& table) {
  table.allow_only({"move_mm", "hold", "circle_mm", "zigzag_mm", "seconds", "ease", "turns",
                    "sink_mm", "button", "orientation_deg", "repeat"});
  HandStep step;
  int kinds = 0;
  const auto is = [&](std::string_view key, HandStep::Kind kind) {
    if (!table.has(key)) return false;
    step.kind = kind;
    ++kinds;
    return true;
  };
  const bool move = is("move_mm", HandStep::Kind::move);
  const bool hold = is("hold", HandStep::Kind::hold);
  const bool circle = is("circle_mm", HandStep::Kind::circle);
  const bool zigzag = is("zigzag_mm", HandStep::Kind::zigzag);
  if (kinds != 1) {
    table.fail(": has " + std::to_string(kinds) +
               " motions; give exactly one of move_mm, hold, circle_mm, zigzag_mm");
  }
  if (hold && table.has("seconds")) table.fail(": hold and seconds; hold is the time already");
  if (!(circle || zigzag) && (table.has("turns") || table.has("sink_mm"))) {
    table.fail(": turns or sink_mm without a pattern; they belong to circle_mm and zigzag_mm");
  }

  if (move) step.to = table.numbers<3>("move_mm", {}, kLength);
  if (circle) step.size[0] = table.number("circle_mm", 0, kSize);
  if (zigzag) step.size = table.numbers<2>("zigzag_mm", {}, kSize);
  step.seconds = table.number(hold ? "hold" : "seconds", 1.0, kSeconds);
  step.turns = table.number("turns", 1.0, {0, kMaxTurns, true});
  step.sink = table.number("sink_mm", 0.0, kLength);
  step.ease = table.word("ease", "smooth", {"smooth", "linear"}) == "linear"
                  ? HandStep::Ease::linear
                  : HandStep::Ease::smooth;
  if (table.has("button")) {
    const double button = table.number("button", 0, {1, 2});
    if (button != std::floor(button)) table.fail(": button is not whole; use 1 or 2");
    step.button = static_cast<int>(button);
  }
  if (table.has("orientation_deg")) {
    step.orientation_rad = table.numbers<3>("orientation_deg", {}, {-kMaxDegrees, kMaxDegrees});
    for (double& angle : *step.orientation_rad) angle *= omni::kPi / 180;
  }
  return step;
}

}  // namespace

HandScript parse_hand_script(std::string_view text, const std::string& place) {
  toml::table file;
  try {
    file = toml::parse(text);
  } catch (const toml::parse_error& error) {
    throw HilError(place + ":" + std::to_string(error.source().begin.line) + ": " +
                   std::string(error.description()) + "; correct the TOML");
  }
  const Table top(file, place, "");
  top.allow_only({"unit_mm", "start_mm", "step"});
  HandScript script;
  script.unit_mm = top.number("unit_mm", script.unit_mm, {0, kMaxUnitMm, true});
  script.start = top.numbers<3>("start_mm", script.start, kLength);

  const toml::node* node = file.get("step");
  const toml::array* steps = node == nullptr ? nullptr : node->as_array();
  if (steps == nullptr || steps->empty() || !steps->is_array_of_tables()) {
    throw HilError(place + ": no steps; add at least one [[step]]");
  }
  if (steps->size() > kMaxSteps) {
    throw HilError(place + ": " + std::to_string(steps->size()) + " steps; use at most " +
                   std::to_string(kMaxSteps));
  }
  for (const toml::node& element : *steps) {
    const Table table(*element.as_table(), place, "step");
    script.steps.push_back(step_of(table));
    if (!table.flag("repeat")) continue;
    if (script.repeat_from) table.fail(": a second repeat; only one step starts the repeat");
    script.repeat_from = script.steps.size() - 1;
  }
  return script;
}

HandScript read_hand_script(const std::filesystem::path& file) {
  const std::string place = file.string();
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) {
    throw HilError(place + ": not a file; name a hand script such as scenes/hands/touch.toml");
  }
  std::ifstream in(file, std::ios::binary);
  std::string text(kMaxBytes + 1, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(in.gcount()));
  if (in.bad() || (!in.eof() && text.size() <= kMaxBytes)) {
    throw HilError(place + ": cannot be read; check its rights");
  }
  if (text.size() > kMaxBytes) throw HilError(place + ": more than 1 MiB; use a shorter script");
  return parse_hand_script(text, place);
}

}  // namespace kerf
