// SPDX-License-Identifier: Apache-2.0
#include "lab/stability/axes.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <sstream>
#include <string_view>
#include <utility>

#include "hil/device/falcon.hpp"
#include "hil/device/plant_params.hpp"
#include "hil/device/wooden.hpp"
#include "hil/hil_error.hpp"
#include "lab/run/grid_run.hpp"
#include "shared/text/text.hpp"
#include "shared/wire/falcon.hpp"
#include "shared/wire/woodenhaptics.hpp"

namespace kerf::zwidth {
namespace {

constexpr std::array<AxisKind, kAxisCount> kKinds{{
    {"loop", "", "kerf", 0, 0, "ideal kerf",
     "ideal: of the theory (two-sided linear wall, backward difference, double, no friction, "
     "encoder "
     "steps or limits); kerf: the servo as it is. Sets what is not given"},
    {"device", "", "omni", 0, 0, "omni falcon woodenhaptics",
     "mass, friction and encoder of the emulated one, or of a file of kerf identify "
     "(device.toml), with its delay. Sets what is not given"},
    {"damping", "N s/mm", "0.002", 0, 2, "", "damping of the wall, B"},
    {"rate", "Hz", "1000", 250, 32000, "", "rate of the servo"},
    {"delay", "periods", "1", 0, 64, "",
     "delay from reading to force; fractions of a period are allowed"},
    {"quantum", "mm", "", 0, 10, "", "step of the encoders at the tip"},
    {"friction", "N", "", 0, 100, "", "Coulomb friction of the device"},
    {"viscous", "N s/mm", "", 0, 2, "", "damping of the device itself, b"},
    {"mass", "kg", "", 0.001, 100, "", "mass of the device at the tip"},
    {"estimator", "", "", 0, 0, "",
     "estimator of the hand's velocity: foaw, difference, or one of your own"},
    {"filter", "ms", "0", 0, 1000, "", "time constant of the low-pass behind difference"},
    {"hand", "", "none", 0, 0, "",
     "hand that holds the device: none, light, firm or KG/NS_PER_MM/N_PER_MM"},
    {"mode", "Hz", "0", 0, 4000, "", "structural mode, of the whole arm alone (--arm)"},
    {"numeric", "", "", 0, 0, "fixed double", "number type of the wall"},
    {"law", "", "", 0, 0, "",
     "force of the wall: coupling (kerf's), linear (never pulls), two_sided, paper (--arm: K sets "
     "its "
     "p0), or one of your own with a setting stiffness_n_per_mm"},
    {"stabiliser", "", "none", 0, 0, "",
     "none, passivity, energy_bounding or one of your own; settings of a law as "
     "NAME/setting=value/..."},
    {"limits", "", "", 0, 0, "on off", "peak and slew of a scene; the motors stay cool"},
    {"push", "N", "any", 0.01, 100, "any",
     "push of the hand, above friction. any: 0.5, and a search from 0.05 to 0.9 of the peak"},
    {"hit", "mm/s", "any", 0, 2000, "any",
     "speed of the hand at its start. any: 0, 50, 200, and a search up to 500"},
    {"start", "mm", "any", 0, 10, "any",
     "distance of the hand before the wall at its start. any: 0.1, and a search up to 2"},
}};

[[noreturn]] void fail(const AxisKind& kind, const std::string& text, const std::string& way_out) {
  throw HilError(std::string("--") + kind.name + ": " + (text.empty() ? "an empty value" : text) +
                 " " + way_out);
}

std::vector<std::string> split(const std::string& text, char at) {
  std::vector<std::string> parts;
  std::istringstream in(text);
  for (std::string part; std::getline(in, part, at);) parts.push_back(part);
  if (!text.empty() && text.back() == at) parts.emplace_back();
  return parts;
}

bool has_word(const std::string& words, const std::string& word) {
  const auto list = split(words, ' ');
  return std::ranges::find(list, word) != list.end();
}

constexpr int kMostValues = 1000;

/// from:to:count, in rising order; empty for a text that is not three numbers. Throws HilError for
/// a range with equal ends, or a count that is not 2 to kMostValues.
std::optional<grid::Range> ordered_range(const std::string& option, const std::string& text) {
  auto range = grid::range_in(text);
  const bool fits = range && range->count == std::floor(range->count) && range->count >= 2 &&
                    range->count <= kMostValues && range->lo != range->hi;
  if (!range) return std::nullopt;
  if (!fits) {
    throw HilError("--" + option + ": " + text +
                   ": no range; give two different ends and a count of 2 to " +
                   std::to_string(kMostValues));
  }
  if (range->lo > range->hi) std::swap(range->lo, range->hi);
  return range;
}

/// Mass, damping, stiffness. The pen-holds are chosen, not measured: light lets the device swing
/// most, firm is the emulator's.
std::optional<SampledHand> hand_of(const std::string& text) {
  if (text == "none") return SampledHand{};
  if (text == "light") return SampledHand{0.02, 0.0005, 0.05};
  if (text == "firm") {
    const PlantParams params;
    return SampledHand{params.hand_mass_kg, params.hand_damping_ns_per_mm,
                       params.hand_stiffness_n_per_mm};
  }
  const auto parts = split(text, '/');
  if (parts.size() != 3) return std::nullopt;
  const auto mass = number_in(parts[0]), damping = number_in(parts[1]),
             stiffness = number_in(parts[2]);
  if (!mass || !damping || !stiffness) return std::nullopt;
  if (*mass < 0 || *mass > 10 || *damping < 0 || *damping > 1 || *stiffness < 0 || *stiffness > 10)
    return std::nullopt;
  return SampledHand{*mass, *damping, *stiffness};
}

/// The walls of the theory, and kerf's; other names are laws of the registry.
constexpr std::array<std::string_view, 4> kLawWords = {"coupling", "linear", "two_sided", "paper"};

/// name/setting=value/..., checked.
LawChoice law_choice(AxisId axis, LawKind kind, const std::string& text) {
  const auto parts = split(text, '/');
  LawChoice choice{kind, parts.empty() ? text : parts.front(), {}};
  const auto refuse = [&](const std::string& what) {
    throw HilError(std::string("--") + kKinds[index_of(axis)].name + ": " + text + what);
  };
  for (std::size_t i = 1; i < parts.size(); ++i) {
    const std::size_t equals = parts[i].find('=');
    const auto value =
        equals == std::string::npos ? std::nullopt : number_in(parts[i].substr(equals + 1));
    if (!value) refuse(": a setting is NAME=NUMBER; give such as passivity/mass_kg=0.1");
    choice.settings.emplace_back(parts[i].substr(0, equals), *value);
  }
  try {
    const LawRow& row = find_law(kind, choice.name);
    static_cast<void>(law_values(row, choice));
    const bool stiff = std::ranges::find(row.settings, "stiffness_n_per_mm", &LawSetting::name) !=
                       row.settings.end();
    if (kind == LawKind::force && !stiff) {
      refuse(": has no setting stiffness_n_per_mm, which a map varies; give it one");
    }
  } catch (const LawError& error) {
    throw HilError(std::string("--") + kKinds[index_of(axis)].name + ": " + choice.name +
                   error.what() +
                   (kind == LawKind::force
                        ? "; or take coupling, linear, two_sided or paper, which have no settings"
                        : ""));
  }
  return choice;
}

/// Sets those settings of the law that the text leaves out.
void fill_in(LawChoice& choice, std::string_view setting, double value) {
  const auto& known = find_law(choice.kind, choice.name).settings;
  const auto row = std::ranges::find(known, setting, &LawSetting::name);
  const auto given =
      std::ranges::find(choice.settings, setting, &std::pair<std::string, double>::first);
  if (row == known.end() || given != choice.settings.end()) return;
  choice.settings.emplace_back(setting, std::clamp(value, row->lo, row->hi));
}

void check(AxisId axis, const std::string& value) {
  const AxisKind& kind = kKinds[index_of(axis)];
  if (axis == AxisId::hand) {
    if (!hand_of(value))
      fail(kind, value, "is no hand; use none, light, firm or such as 0.1/0.003/0.2");
  } else if (axis == AxisId::estimator) {
    static_cast<void>(law_choice(axis, LawKind::velocity, value));
  } else if (axis == AxisId::stabiliser) {
    if (value != "none") static_cast<void>(law_choice(axis, LawKind::stabiliser, value));
  } else if (axis == AxisId::law) {
    if (std::ranges::find(kLawWords, value) == kLawWords.end())
      static_cast<void>(law_choice(axis, LawKind::force, value));
  } else if (kind.lowest == kind.highest) {
    if (!has_word(kind.words, value))
      fail(kind, value, std::string("is unknown; known: ") + kind.words);
  } else {
    const auto number = number_in(value);
    if (has_word(kind.words, value)) return;
    if (!number || *number < kind.lowest || *number > kind.highest) {
      fail(kind, value,
           "is no number from " + number_text(kind.lowest) + " to " + number_text(kind.highest) +
               (*kind.unit ? std::string(" ") + kind.unit : "") +
               (*kind.words ? std::string(", nor \"") + kind.words + "\"" : "") +
               "; give one, a list (0,1,2) or a range (0:3:4: from, to, count up to " +
               std::to_string(kMostValues) + ")");
    }
  }
}

/// An axis' value without one of its own.
std::string standard_of(const Assignment& values, AxisId axis) {
  const bool ideal = values[index_of(AxisId::loop)] == "ideal";
  const std::string& device = values[index_of(AxisId::device)];
  PlantParams plant;
  double step_mm = 0.055;  // the Omni's data sheet
  if (device == "falcon") {
    plant = FalconParams();
    step_mm = falcon::kRadPerCount * falcon::kThighMm;
  } else if (device == "woodenhaptics") {
    plant = WoodenParams();
    step_mm = wooden::kRadPerCount[1] * (wooden::kUpperLinkMm + wooden::kForearmMm);
  }
  // To a micrometre: it is no more exact.
  constexpr double kMicrons = 1000;
  switch (axis) {
    case AxisId::quantum:
      return ideal ? "0" : number_text(std::round(step_mm * kMicrons) / kMicrons);
    case AxisId::friction:
      return ideal ? "0" : format("%.9g", plant.coulomb_n);
    case AxisId::viscous:
      return format("%.9g", plant.viscous_ns_per_mm);
    case AxisId::mass:
      return format("%.9g", plant.tip_mass_kg);
    case AxisId::estimator:
      return ideal ? "difference" : "foaw";
    case AxisId::numeric:
      return ideal ? "double" : "fixed";
    case AxisId::law:
      return ideal ? "two_sided" : "coupling";
    case AxisId::limits:
      return ideal ? "off" : "on";
    default:
      return kKinds[index_of(axis)].standard;
  }
}

template <class Enum>
Enum word_of(AxisId axis, const std::string& value) {
  const auto words = split(kKinds[index_of(axis)].words, ' ');
  return static_cast<Enum>(std::ranges::find(words, value) - words.begin());
}

}  // namespace

const std::array<AxisKind, kAxisCount>& axis_kinds() {
  return kKinds;
}

AxisValues axis_values(AxisId axis, const std::string& text) {
  const AxisKind& kind = kKinds[index_of(axis)];
  const bool numbers = kind.lowest != kind.highest;
  AxisValues values;
  if (const auto range = numbers ? ordered_range(kind.name, text) : std::nullopt) {
    for (int i = 0; i < range->count; ++i) {
      const double share = static_cast<double>(i) / (range->count - 1);
      values.push_back(format("%.9g", range->lo + (range->hi - range->lo) * share));
    }
  } else {
    values = split(text, ',');
  }
  if (values.empty()) fail(kind, text, "; give one, a list or a range (from:to:count)");
  for (const std::string& value : values) check(axis, value);
  const auto place = [](const std::string& value) {
    constexpr double kWord = std::numeric_limits<double>::infinity();  // a word comes last
    return number_in(value).value_or(kWord);
  };
  const auto same = [&](const std::string& a, const std::string& b) {
    return numbers ? place(a) == place(b) : a == b;
  };
  if (numbers) std::ranges::stable_sort(values, std::less<>(), place);
  for (auto value = values.begin(); value != values.end(); ++value) {
    const auto twin = std::find_if(value + 1, values.end(),
                                   [&](const std::string& other) { return same(*value, other); });
    if (twin == values.end()) continue;
    fail(
        kind, text,
        "has " + *value + " twice" + (*twin == *value ? "" : ", as " + *twin) + "; name each once");
  }
  return values;
}

double seven_digits(double value) {
  return *number_in(format("%.7g", value));
}

std::vector<double> ratio_values(const RatioOption& option, const std::string& text) {
  std::vector<double> values;
  const auto refuse = [&](const std::string& what) {
    throw HilError("--" + std::string(option.name) + ": " + text + ": " + what + "; use such as " +
                   option.example);
  };
  if (const auto range = ordered_range(option.name, text)) {
    if (range->lo <= 0) refuse("its ends are not above 0");
    for (int i = 0; i < range->count; ++i) {
      const double share = static_cast<double>(i) / (range->count - 1);
      values.push_back(range->lo * std::pow(range->hi / range->lo, share));
    }
  } else {
    for (const std::string& part : split(text, ',')) {
      const auto value = number_in(part);
      if (!value) refuse(part + " is no number");
      values.push_back(*value);
    }
  }
  if (values.empty()) refuse("no value");
  std::ranges::sort(values);
  if (!(values.front() >= option.lowest && values.back() <= option.highest)) {
    refuse("not within " + number_text(option.lowest) + " and " + number_text(option.highest) +
           " " + option.unit);
  }
  for (double& value : values) value = seven_digits(value);
  if (std::ranges::adjacent_find(values) != values.end()) {
    refuse("a value twice, to seven digits");
  }
  return values;
}

std::vector<double> stiffness_values(const std::string& text) {
  // N/mm: steps of fixed point; below its 128
  return ratio_values({"stiffness", "0.05:50:40 (from, to, count) or 0.5,1,2", "N/mm", 1e-4, 127},
                      text);
}

std::vector<Assignment> combinations(const AxisTable& table) {
  std::vector<Assignment> all(1);
  for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
    if (table[axis].empty()) continue;
    std::vector<Assignment> next;
    for (const Assignment& one : all) {
      for (const std::string& value : table[axis]) {
        next.push_back(one);
        next.back()[axis] = value;
      }
    }
    all = std::move(next);
  }
  return all;
}

void check_filter(const Assignment& values) {
  const std::string estimator = value_of(values, AxisId::estimator);
  if (value_of(values, AxisId::filter) == "0" || estimator == "difference") return;
  throw HilError("--filter: " + estimator +
                 (estimator.starts_with("difference/")
                      ? " sets its low-pass itself; leave one of the two out"
                      : " has no low-pass behind it; add --estimator difference, or leave it out"));
}

std::string value_of(const Assignment& values, AxisId axis) {
  const std::string& given = values[index_of(axis)];
  return given.empty() ? standard_of(values, axis) : given;
}

std::string laws_of(const Assignment& values) {
  std::string text;
  for (const AxisId axis : {AxisId::law, AxisId::estimator, AxisId::stabiliser}) {
    text += (text.empty() ? "" : ", ") + std::string(axis_kinds()[index_of(axis)].name) + ' ' +
            value_of(values, axis);
  }
  return text;
}

LoopCase subject_of(const Assignment& values) {
  const auto text = [&](AxisId axis) { return value_of(values, axis); };
  const auto number = [&](AxisId axis) { return number_in(text(axis)).value_or(0); };
  LoopCase subject;
  SampledLoop& loop = subject.loop;
  loop.mass_kg = number(AxisId::mass);
  loop.viscous_ns_per_mm = number(AxisId::viscous);
  loop.period_s = 1 / number(AxisId::rate);
  loop.delay_s = number(AxisId::delay) * loop.period_s;
  loop.coulomb_n = number(AxisId::friction);
  loop.quantum_mm = number(AxisId::quantum);
  loop.hand = hand_of(text(AxisId::hand)).value_or(SampledHand{});
  subject.damping_ns_per_mm = number(AxisId::damping);
  subject.estimator = law_choice(AxisId::estimator, LawKind::velocity, text(AxisId::estimator));
  if (subject.estimator.name == "difference") {
    fill_in(subject.estimator, "tau_ms", number(AxisId::filter));
    loop.velocity_filter_s = subject.estimator.settings.front().second / 1000;  // its only one
  }
  const std::string law = text(AxisId::law);
  const auto word = std::ranges::find(kLawWords, law);
  subject.law = static_cast<Law>(word - kLawWords.begin());
  if (subject.law == Law::own) subject.force_law = law_choice(AxisId::law, LawKind::force, law);
  if (text(AxisId::stabiliser) != "none") {
    subject.stabiliser =
        law_choice(AxisId::stabiliser, LawKind::stabiliser, text(AxisId::stabiliser));
    fill_in(subject.stabiliser, "mass_kg", loop.mass_kg);
    fill_in(subject.stabiliser, "damping_ns_per_mm", loop.viscous_ns_per_mm);
  }
  subject.numeric = word_of<NumericKind>(AxisId::numeric, text(AxisId::numeric));
  subject.limits = text(AxisId::limits) == "on";
  subject.device = word_of<Personality>(AxisId::device, text(AxisId::device));
  subject.mode_hz = number(AxisId::mode);
  subject.press.given = {number_in(text(AxisId::push)), number_in(text(AxisId::hit)),
                         number_in(text(AxisId::start))};  // any: none
  return subject;
}

std::size_t axis_named(const char* option, std::string_view name) {
  if (name == "stiffness") return kAxisCount;
  for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
    if (name == kKinds[axis].name) return axis;
  }
  throw HilError(std::string(option) + ": " + std::string(name) +
                 " is no axis; --help lists them, and stiffness is one");
}

}  // namespace kerf::zwidth
