// SPDX-License-Identifier: Apache-2.0
#include "hil/script/hand_script_file.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "hil/script/script_table.hpp"
#include "shared/wire/omni.hpp"

namespace kerf {
namespace {

constexpr std::array<std::string_view, 2> kEaseWords{"smooth", "linear"};
constexpr std::size_t kMaxSteps = 10'000;
constexpr double kMaxLength = 1000;  // script units: far outside any arm's reach
constexpr double kMaxTurns = 10'000;
constexpr double kMaxUnitMm = 100;
constexpr double kMaxDegrees = 360;

constexpr ScriptRange kLength{-kMaxLength, kMaxLength};
constexpr ScriptRange kSize{0, kMaxLength};
constexpr ScriptRange kSeconds{0, kMaxScriptSeconds, true};

HandStep step_of(const ScriptTable& table) {
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
  step.ease = table.word("ease", "smooth", kEaseWords) == "linear" ? HandStep::Ease::linear
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

/// Plant parameters of `[device]` and `[hand]`.
PlantValues plant_of(const ScriptTable& top, const std::string& location) {
  PlantValues values;
  for (const std::string_view name : {"device", "hand"}) {
    const TomlNode* node = top.table(name);
    if (node == nullptr) continue;
    const ScriptTable table(*node, location, std::string(name));
    std::vector<std::string_view> known;
    for (std::size_t i = 0; i < values.size(); ++i) {
      const PlantKey& row = kPlantKeys[i];
      if (row.table != name) continue;
      known.push_back(row.key);
      if (!table.has(row.key)) continue;
      const ScriptRange range{row.low, row.high};
      values[i] = row.whole ? table.whole(row.key, 0, range) : table.number(row.key, 0, range);
    }
    table.allow_only(known);
  }
  return values;
}

}  // namespace

HandScript parse_hand_script(std::string_view text, const std::string& location) {
  const TomlNode file = parse_script(text, location);
  const ScriptTable top(file, location, "");
  top.allow_only({"unit_mm", "start_mm", "device", "hand", "step"});
  HandScript script;
  if (top.has("unit_mm")) script.unit_mm = top.number("unit_mm", 1, {0, kMaxUnitMm, true});
  script.start = top.numbers<3>("start_mm", script.start, kLength);

  script.plant = plant_of(top, location);
  for (const TomlNode& step : top.tables("step", kMaxSteps)) {
    const ScriptTable table(step, location, "step");
    script.steps.push_back(step_of(table));
    if (!table.flag("repeat")) continue;
    if (script.repeat_from) table.fail(": a second repeat; only one step starts the repeat");
    script.repeat_from = script.steps.size() - 1;
  }
  return script;
}

HandScript read_hand_script(const std::filesystem::path& file) {
  return parse_hand_script(read_script(file, "scenes/hands/touch.toml"), file.string());
}

}  // namespace kerf
