// SPDX-License-Identifier: Apache-2.0
#include "lab/run/grid_axes.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <iterator>
#include <optional>
#include <set>
#include <utility>

#include "controller/scene/scene_file.hpp"
#include "hil/hil_error.hpp"
#include "shared/text/text.hpp"
#include "shared/text/toml.hpp"

namespace kerf::grid {
namespace {

[[noreturn]] void refuse_axis(std::string_view text, const char* why) {
  throw HilError("--set " + std::string(text) + ": " + why);
}

/// The values of LO:HI:N; empty if the text is no range.
std::optional<std::vector<std::string>> range_of(std::string_view text, std::string_view values) {
  const std::vector<std::string> parts = split(values, ':');
  if (parts.size() == 2 && number_in(parts[0]) && number_in(parts[1])) {
    refuse_axis(text, "a range without its count; write LO:HI:N, such as 0.2:3:16");
  }
  const std::optional<Range> range = range_in(values);
  if (!range) return std::nullopt;
  const auto [lo, hi, count] = *range;
  if (!(count >= 1 && count <= kMostCells) || count != std::floor(count)) {
    refuse_axis(text, "not 1 to 1000000 values; write LO:HI:N, such as 0.2:3:16");
  }
  if (count == 1 && lo != hi) refuse_axis(text, "one value cannot be both ends; take 2 or more");
  std::vector<std::string> list;
  const auto last = static_cast<int>(count) - 1;
  for (int i = 0; i <= last; ++i) {
    // Twelve digits: a step of a tenth reads as one. The ends are as they were written.
    char digits[32];
    std::snprintf(digits, sizeof digits, "%.12g", lo + (hi - lo) * i / std::max(last, 1));
    list.push_back(i == 0 ? number_text(lo) : i == last ? number_text(hi) : digits);
  }
  return list;
}

std::string meaning_of(const TomlNode& node) {
  if (const auto number = node.number()) return number_text(*number == 0 ? 0 : *number);  // no -0
  if (node.form == TomlNode::Form::value) return written(node.value);
  std::vector<std::string> parts;
  for (const TomlNode& entry : node.entries) parts.push_back(entry.key + "=" + meaning_of(entry));
  if (node.form == TomlNode::Form::table) std::ranges::sort(parts);
  std::string meaning = "[";
  for (const std::string& part : parts) meaning += part + ",";
  return meaning;
}

/// Equal for values that are the same in TOML: 1000 and +1e3, "a" and a, [0,1] and [0, 1]. As for
/// the scene, what TOML cannot read is a text.
std::string meaning_of(const std::string& value) {
  try {
    return meaning_of(parse_toml("v = " + value).entries.at(0));
  } catch (const TomlError&) {
    return written(value);
  }
}

void refuse_twins(std::string_view text, const std::vector<std::string>& values) {
  std::set<std::string> seen;
  for (const std::string& value : values) {
    if (seen.insert(meaning_of(value)).second) continue;
    refuse_axis(text, (value + " stands there twice; name each value once").c_str());
  }
}

/// Refuses options of the emulator that the sweep itself sets.
void refuse_own_option(std::string_view text, std::string option) {
  option.erase(0, option.find('.') + 1);
  std::ranges::replace(option, '-', '_');
  constexpr std::string_view kOwn[] = {"personality", "front",    "socket",  "udp",  "hand",
                                       "hand_socket", "lockstep", "rate",    "stay", "seconds",
                                       "unit_mm",     "report",   "describe"};
  if (std::ranges::find(kOwn, option) == std::end(kOwn)) return;
  refuse_axis(text,
              "the sweep sets it itself; name a key of the scene, such as hand.script, or "
              "another option");
}

}  // namespace

std::vector<std::string> split(std::string_view text, char separator) {
  // Quotes and brackets are those of TOML where a value of TOML begins: a bare text may hold both.
  std::vector<std::string> parts(1);
  int depth = 0;
  char quote = 0, before = separator;  // the last character that is no space
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (quote != 0) {
      parts.back() += before = c;
      if (c == '\\' && quote == '"' && i + 1 < text.size()) {
        parts.back() += text[++i];
      } else if (c == quote) {
        quote = 0;
      }
      continue;
    }
    if (c == separator && depth == 0) {
      parts.emplace_back();
      before = separator;
      continue;
    }
    const bool begins = before == separator || (depth > 0 && std::strchr("[{=,", before));
    if (begins && (c == '"' || c == '\'')) quote = c;
    if ((c == '[' || c == '{') && (begins || depth > 0)) ++depth;
    if ((c == ']' || c == '}') && depth > 0) --depth;
    parts.back() += c;
    if (c != ' ' && c != '\t') before = c;
  }
  return parts;
}

std::optional<Range> range_in(std::string_view text) {
  const std::vector<std::string> parts = split(text, ':');
  if (parts.size() != 3) return std::nullopt;
  const auto lo = number_in(parts[0]), hi = number_in(parts[1]), count = number_in(parts[2]);
  if (!lo || !hi || !count) return std::nullopt;
  return Range{*lo, *hi, *count};
}

Axis parse_axis(std::string_view text) {
  const std::size_t equals = text.find('=');
  if (equals == text.npos || equals == 0) {
    refuse_axis(text, "not KEY=VALUES; write such as force.stiffness_n_per_mm=0.2:3:16");
  }
  Axis axis{std::string(text.substr(0, equals)), {}};
  const std::string_view values = text.substr(equals + 1);
  if (const auto range = range_of(text, values)) {
    axis.values = *range;
  } else {
    axis.values = split(values, ',');
  }
  if (axis.of_emulator()) refuse_own_option(text, axis.key);
  if (std::ranges::any_of(axis.values, &std::string::empty)) {
    refuse_axis(text, "a value is empty; write LO:HI:N or A,B,C");
  }
  refuse_twins(text, axis.values);
  if (!axis.of_emulator()) {
    for (const std::string& value : axis.values) {
      static_cast<void>(parse_setting(axis.key + "=" + value));
    }
  }
  return axis;
}

std::vector<Axis> parse_axes(std::span<const std::string> texts) {
  std::vector<Axis> axes;
  double runs = 1;
  for (const std::string& text : texts) {
    Axis axis = parse_axis(text);
    if (std::ranges::find(axes, axis.key, &Axis::key) != axes.end()) {
      throw HilError("--set " + text + ": the key stands there already; write one list");
    }
    runs *= static_cast<double>(axis.values.size());
    axes.push_back(std::move(axis));
  }
  if (runs > kMostCells) {
    throw HilError("--set: " + number_text(runs) + " runs; at most 1000000 go into one sweep");
  }
  return axes;
}

std::size_t cells_of(std::span<const Axis> axes) {
  std::size_t cells = 1;
  for (const Axis& axis : axes) cells *= axis.values.size();
  return cells;
}

std::vector<std::string> values_of(std::span<const Axis> axes, std::size_t cell) {
  std::vector<std::string> values(axes.size());
  for (std::size_t i = axes.size(); i-- > 0;) {
    values[i] = axes[i].values[cell % axes[i].values.size()];
    cell /= axes[i].values.size();
  }
  return values;
}

}  // namespace kerf::grid
