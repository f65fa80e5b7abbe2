// SPDX-License-Identifier: Apache-2.0
#include "lab/ranges/key_study.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <utility>

#include "lab/ranges/in_parallel.hpp"

namespace kerf::ranges {
namespace {

/// The scene with one key at this text; nothing where its condition cannot be met.
bool set(const SceneKey& key, const std::string& text, KeyTexts& texts) {
  if (!meet_condition(key, texts)) return false;
  texts[std::string(key.name)] = text;
  return true;
}

/// The last value from the plain one toward `end` that the loader takes in the first numbers of the
/// effort; empty where there is none. By bisection: of sizes by their ratio.
std::string last_accepted(const SceneKey& key, double end, const Effort& effort,
                          const std::filesystem::path& file) {
  constexpr int kHalvings = 8;
  const std::optional<PlainNumber> plain = plain_number(key);
  if (!plain) return {};
  const auto accepted = [&](const std::string& text) {
    KeyTexts texts;
    if (!set(key, text, texts)) return false;
    return !load_combination(texts, effort.numerics.front(), file).refused;
  };
  double good = plain->value, bad = end;
  if (!accepted(number_text(*plain, good))) return {};
  for (int i = 0; i < kHalvings; ++i) {
    const bool sizes = good * bad > 0;
    const double middle = sizes ? std::copysign(std::sqrt(good * bad), good) : (good + bad) / 2;
    (accepted(number_text(*plain, middle)) ? good : bad) = middle;
  }
  return number_text(*plain, good);
}

}  // namespace

void Tally::add(const KeyTexts& texts, NumericKind numeric, const Outcome& outcome) {
  ++(outcome.refused ? refused : ran);
  felt += outcome.felt ? 1 : 0;
  cut += outcome.cut ? 1 : 0;
  faulted += outcome.faulted ? 1 : 0;
  ticks += outcome.ticks;
  for (const Violation& violation : outcome.violations)
    broken.push_back({texts, numeric, violation});
}

void Tally::add(const Tally& other) {
  ran += other.ran;
  refused += other.refused;
  felt += other.felt;
  cut += other.cut;
  faulted += other.faulted;
  ticks += other.ticks;
  broken.insert(broken.end(), other.broken.begin(), other.broken.end());
}

std::vector<KeyRow> study_keys(const Effort& effort, const StudyEvents& events) {
  std::vector<KeyRow> rows;
  for (KeyLevels& levels : key_levels()) rows.push_back({std::move(levels), {}, 0, {}});
  const SceneFolder folder;
  const auto study = [&](std::size_t i, const std::filesystem::path& file) {
    KeyRow& row = rows[i];
    const SceneKey& key = *row.levels.key;
    const auto run = [&](const std::string& text) {
      KeyTexts texts;
      if (!set(key, text, texts)) return;
      bool refused = false;
      for (const NumericKind numeric : effort.numerics) {
        const Outcome outcome = run_combination(texts, numeric, file);
        row.ends.add(texts, numeric, outcome);
        refused = refused || outcome.refused;
      }
      if (!refused) row.accepted.push_back(text);
    };
    for (const std::string& text : row.levels.ends) run(text);
    for (const double end : {key.allowed.range.lo, key.allowed.range.hi}) {
      const auto plain = plain_number(key);
      const bool taken =
          !plain || std::ranges::find(row.accepted, number_text(*plain, end)) != row.accepted.end();
      if (taken || plain->whole) continue;
      const std::string nearest = last_accepted(key, end, effort, file);
      if (!nearest.empty()) run(nearest);
    }
    for (const std::string& text : row.levels.beyond) {
      KeyTexts texts;
      if (!set(key, text, texts)) continue;
      const Outcome outcome = load_combination(texts, effort.numerics.front(), file);
      row.beyond_refused += outcome.refused ? 1 : 0;
      for (const Violation& v : outcome.violations)
        row.ends.broken.push_back({texts, effort.numerics.front(), v});
      if (!outcome.refused) {
        row.ends.broken.push_back(
            {texts, effort.numerics.front(), {"beyond", "is no end: the loader takes it"}});
      }
    }
  };
  in_parallel(rows.size(), effort.jobs, folder, study, [&](std::size_t i, double share) {
    for (const Broken& broken : rows[i].ends.broken) events.broken(broken);
    events.progress(share, "ends of every key");
  });
  return rows;
}

}  // namespace kerf::ranges
