// SPDX-License-Identifier: Apache-2.0
#include "tests/studies/ranges/key_levels.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <type_traits>
#include <utility>
#include <variant>

#include "controller/law/registry/law_registry.hpp"

namespace kerf::ranges {
namespace {

std::string number(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.17g", value);
  std::string shown = text;
  if (shown.find_first_of(".en") == std::string::npos) shown += ".0";
  return shown;
}

/// `first`, then `others` up to the list's length.
std::string list_text(std::size_t length, const std::string& first, const std::string& others) {
  std::string text = "[" + first;
  for (std::size_t i = 1; i < length; ++i) text += ", " + others;
  return text + "]";
}

/// The form of a slot's value: its length if it is a list, and whether its numbers are whole.
struct Form {
  bool is_switch = false, has_numbers = false, whole = false;
  std::size_t length = 0;  ///< of a list; 0: one value
};

struct FormOf {
  Form operator()(const bool*) const { return {.is_switch = true}; }
  Form operator()(const int*) const { return {.has_numbers = true, .whole = true}; }
  Form operator()(const double*) const { return {.has_numbers = true}; }
  Form operator()(const Denoise*) const { return {.has_numbers = true, .whole = true}; }
  Form operator()(const VoxelGrid*) const {
    return {.has_numbers = true, .whole = true, .length = 3};
  }
  template <std::size_t N>
  Form operator()(const std::array<double, N>*) const {
    return {.has_numbers = true, .length = N};
  }
  template <class T>
  Form operator()(const std::optional<T>*) const {
    return (*this)(static_cast<const T*>(nullptr));
  }
  template <class T>
  Form operator()(const T*) const {
    return {};
  }
};

void add(std::string text, std::vector<std::string>& list) {
  if (std::ranges::find(list, text) == list.end()) list.push_back(std::move(text));
}

void add_numbers(const Form& form, const Range& range, KeyLevels& levels) {
  const auto shown = [&](double value) {
    return form.whole ? std::to_string(static_cast<long long>(value)) : number(value);
  };
  const std::string lo = shown(range.lo), hi = shown(range.hi);
  const bool has_zero = range.lo <= 0 && range.hi >= 0;
  // A thousandth beyond is above any rounding of the text.
  const auto step = [&](double end) {
    return form.whole ? 1.0 : std::max(std::abs(end), 1e-6) / 1000;
  };
  std::vector<std::string> outside{shown(range.lo - step(range.lo)),
                                   shown(range.hi + step(range.hi))};
  if (!form.whole) {
    for (const char* text : {"inf", "-inf", "nan"}) outside.emplace_back(text);
  } else {
    outside.insert(outside.end(), {"2147483647", "-2147483648", "9223372036854775807"});
  }
  if (form.length == 0) {
    add(lo, levels.ends);
    add(hi, levels.ends);
    levels.beyond = outside;
    return;
  }
  const std::string middle = has_zero ? shown(0) : lo;
  for (const auto& [first, others] :
       {std::pair{lo, lo}, {hi, hi}, {lo, hi}, {hi, lo}, {hi, middle}}) {
    // 512^3 samples of a phantom take minutes to make; 512 along one axis is the same end.
    const bool huge = form.whole && others == hi;
    if (!huge) add(list_text(form.length, first, others), levels.ends);
  }
  for (const std::string& text : outside) levels.beyond.push_back(list_text(form.length, text, lo));
}

std::string quoted(std::string_view word) {
  return '"' + std::string(word) + '"';
}

/// A law by its name, with these of its settings.
std::string law_text(const LawRow& row, const std::string& settings) {
  return "{ name = " + quoted(row.name) + settings + " }";
}

/// Every law of the kind that this program knows: with default settings, with each setting at its
/// lowest and at its highest value, and with all settings at the lowest or all at the highest. Out
/// of range: values just beyond, inf, -inf, nan, and an unknown name.
void add_laws(LawKind kind, KeyLevels& levels) {
  for (const LawRow* row : known_laws(kind)) {
    add(law_text(*row, ""), levels.ends);
    std::string all_low, all_high;
    for (const LawSetting& setting : row->settings) {
      const std::string set = ", " + std::string(setting.name) + " = ";
      const double step = std::max(setting.hi - setting.lo, 1e-6) / 1000;
      for (const double end : {setting.lo, setting.hi}) {
        add(law_text(*row, set + number(end)), levels.ends);
      }
      for (const double beyond : {setting.lo - step, setting.hi + step}) {
        levels.beyond.push_back(law_text(*row, set + number(beyond)));
      }
      for (const char* text : {"inf", "-inf", "nan"}) {
        levels.beyond.push_back(law_text(*row, set + text));
      }
      all_low += set + number(setting.lo);
      all_high += set + number(setting.hi);
    }
    add(law_text(*row, all_low), levels.ends);
    add(law_text(*row, all_high), levels.ends);
  }
  if (!levels.ends.empty()) levels.beyond.emplace_back("{ name = \"nonsense\" }");
}

/// Keys beside a key, if the scene sets them nowhere else: several keys make one
/// thing. An empty value leaves the base's own out.
struct Companion {
  const char *key, *value;  ///< null: with any value
  const char *beside, *text;
};
constexpr Companion kCompanions[] = {
    {"volume.file", "\"phantom\"", "volume.size", "[32, 32, 21]"},
    {"tool.size_vox", nullptr, "tool.radius_mm", ""},
    {"tool.shape", "\"stl\"", "tool.radius_mm", ""},
    {"tool.shape", "\"stl\"", "tool.file", "\"bur.stl\""},
    {"tool.length_mm", nullptr, "tool.shape", "\"cylinder\""},
    {"tool.shaft_radius_mm", nullptr, "tool.shaft_length_mm", "4.0"},
    {"tool.shaft_length_mm", nullptr, "tool.shaft_radius_mm", "0.5"},
    {"tool.handpiece_radius_mm", nullptr, "tool.shaft_radius_mm", "0.5"},
    {"tool.handpiece_radius_mm", nullptr, "tool.shaft_length_mm", "4.0"},
    {"tool.handpiece_length_mm", nullptr, "tool.handpiece_radius_mm", "1.0"},
    {"tool.handpiece_length_mm", nullptr, "tool.shaft_radius_mm", "0.5"},
    {"tool.handpiece_length_mm", nullptr, "tool.shaft_length_mm", "4.0"},
};

/// Values in the plain scene of keys without a default of their own.
constexpr std::pair<std::string_view, const char*> kPlain[] = {
    {"volume.override_spacing_mm", "0.25"},
    {"tool.scale", "1.0"},
    {"tool.pitch_mm", "0.25"},
    {"tool.size_vox", "8"},
    {"tool.length_mm", "2.0"},
    {"volume.denoise", "1"},
    {"volume.iso", "0.5"},
    {"device.offset_mm", "0.0"},
};

/// Ends that lie within a row's range, because of a rule of their own (scene_file.cpp).
constexpr std::pair<std::string_view, const char*> kInnerEnds[] = {
    {"device.torque_scale", "[0.001, -0.001, 0.001]"},
    {"volume.pose.orientation", "[1.0, 0.0, 0.0, 0.0]"},
    {"volume.pose.orientation", "[0.5, -0.5, 0.5, 0.5]"},
    {"volume.override_spacing_mm", "[0.125, 0.25, 0.5]"},
};

/// The scene that the keys change.
const KeyTexts& base() {
  static const KeyTexts kTexts{{"volume.file", "\"solid.nrrd\""},
                               {"tool.shape", "\"ball\""},
                               {"tool.radius_mm", "1.0"},
                               {"material.name", "\"enamel\""},
                               {"device.torque_scale", "[0.342, 0.342, 0.342]"}};
  return kTexts;
}

/// The value that decides a condition: the scene's, the base's, or the default.
std::string value_of_key(std::string_view name, const KeyTexts& texts) {
  for (const KeyTexts* list : {&texts, &base()}) {
    const auto at = list->find(name);
    if (at != list->end()) return at->second;
  }
  // The paper's force brings its own cut (scene_file.cpp: choose_cut).
  if (name == "cut.model" && value_of_key("force.model", texts) == quoted("paper")) {
    return quoted("overlap");
  }
  SceneParts parts;
  const auto row = std::ranges::find(scene_keys(), name, &SceneKey::name);
  return written(value_of(*row, parts));
}

}  // namespace

std::string number_text(const PlainNumber& form, double value) {
  const std::string text =
      form.whole ? std::to_string(static_cast<long long>(value)) : number(value);
  return form.length == 0 ? text : list_text(form.length, text, text);
}

std::optional<PlainNumber> plain_number(const SceneKey& key) {
  SceneParts parts;
  const Form form = std::visit(FormOf{}, key.at(parts));
  if (!form.has_numbers) return std::nullopt;
  std::string text;
  for (const Companion& with : kCompanions) {
    if (key.name == with.beside && with.text[0] != '\0') text = with.text;
  }
  for (const auto& [name, plain] : kPlain) {
    if (key.name == name) text = plain;
  }
  if (const auto at = base().find(key.name); at != base().end()) text = at->second;
  if (text.empty()) text = written(value_of(key, parts));
  const std::size_t begin = text.find_first_of("-0123456789");
  if (begin == std::string::npos || text.find('"') != std::string::npos) return std::nullopt;
  return PlainNumber{std::strtod(text.c_str() + begin, nullptr), form.whole, form.length};
}

std::vector<KeyLevels> key_levels(SceneKeys keys) {
  SceneParts parts;
  std::vector<KeyLevels> list;
  for (const SceneKey& key : keys) {
    KeyLevels levels{&key, {}, {}};
    const SceneSlot slot = key.at(parts);
    const Form form = std::visit(FormOf{}, slot);
    if (const auto* law = std::get_if<LawChoice*>(&slot)) add_laws((*law)->kind, levels);
    if (form.is_switch) levels.ends = {"true", "false"};
    if (form.has_numbers) add_numbers(form, key.allowed.range, levels);
    for (const std::string_view word : key.allowed.words) add(quoted(word), levels.ends);
    if (!key.allowed.words.empty() && !form.has_numbers)
      levels.beyond.push_back(quoted("nonsense"));
    for (const auto& [name, text] : kInnerEnds) {
      if (key.name == name) add(text, levels.ends);
    }
    for (const SceneKey& other : keys) {
      if (other.only_with.key == key.name) add(quoted(other.only_with.word), levels.ends);
    }
    if (!levels.ends.empty()) list.push_back(std::move(levels));
  }
  return list;
}

bool counts(const SceneKey& key, const KeyTexts& texts) {
  const SceneCondition& condition = key.only_with;
  if (condition.key.empty()) return true;
  return (value_of_key(condition.key, texts) == quoted(condition.word)) == condition.is;
}

bool meet_condition(const SceneKey& key, KeyTexts& texts) {
  if (counts(key, texts)) return true;
  const SceneCondition& condition = key.only_with;
  if (texts.contains(condition.key)) return false;
  if (condition.is) {
    texts[std::string(condition.key)] = quoted(condition.word);
    return true;
  }
  // Any other word that does it.
  const auto row = std::ranges::find(scene_keys(), condition.key, &SceneKey::name);
  for (const std::string_view word : row->allowed.words) {
    if (word == condition.word || word == "none") continue;
    texts[std::string(condition.key)] = quoted(word);
    return true;
  }
  return false;
}

std::string scene_text(const KeyTexts& texts) {
  KeyTexts all = base();
  for (const Companion& with : kCompanions) {
    const auto at = texts.find(with.key);
    if (at != texts.end() && (with.value == nullptr || at->second == with.value)) {
      all[with.beside] = with.text;
    }
  }
  for (const auto& [key, text] : texts) all[key] = text;
  std::string out;
  for (const SceneTableRow& table : scene_tables()) {
    std::string lines;
    for (const auto& [key, text] : all) {
      if (text.empty() || key.substr(0, key.find('.')) != table.name) continue;
      lines += key.substr(key.find('.') + 1) + " = " + text + "\n";
    }
    if (lines.empty()) continue;
    const std::string name(table.name);
    out += (table.limit > 0 ? "[[" + name + "]]\n" : "[" + name + "]\n") + lines;
  }
  return out;
}

}  // namespace kerf::ranges
