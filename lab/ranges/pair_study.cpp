// SPDX-License-Identifier: Apache-2.0
#include "lab/ranges/pair_study.hpp"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "lab/ranges/covering.hpp"
#include "lab/ranges/in_parallel.hpp"

namespace kerf::ranges {
namespace {

/// The keys of the pairs. Those that others depend on come first.
struct KeyFactors {
  std::vector<const KeyRow*> rows;
  std::vector<int> level_counts;
  /// Where nothing is felt at some end, else hardly any row would feel; and where the ends take
  /// more than twice the ticks of most, as that of 8 kHz does.
  std::vector<bool> rare;
  std::size_t deciding = 0;

  explicit KeyFactors(const std::vector<KeyRow>& keys) {
    const auto decides = [&](const KeyRow& row) {
      return std::ranges::any_of(keys, [&](const KeyRow& other) {
        return other.levels.key->only_with.key == row.levels.key->name;
      });
    };
    std::vector<std::size_t> ticks;
    for (const KeyRow& row : keys) {
      if (row.ends.ran > 0) ticks.push_back(row.ends.ticks / row.ends.ran);
    }
    std::ranges::sort(ticks);
    const std::size_t usual_ticks = ticks.empty() ? 0 : ticks[ticks.size() / 2];
    for (const bool first : {true, false}) {
      for (const KeyRow& row : keys) {
        // The numbers are chosen for the run as a whole.
        if (row.levels.key->name == "servo.numeric" || decides(row) != first) continue;
        rows.push_back(&row);
        level_counts.push_back(static_cast<int>(row.accepted.size()));
        rare.push_back(row.ends.felt < row.ends.ran ||
                       2 * usual_ticks * row.ends.ran < row.ends.ticks);
      }
      if (first) deciding = rows.size();
    }
  }

  [[nodiscard]] KeyTexts texts(const Levels& row) const {
    KeyTexts out;
    for (std::size_t f = 0; f < row.size(); ++f) {
      if (row[f] < 0) continue;
      out[std::string(rows[f]->levels.key->name)] =
          rows[f]->accepted[static_cast<std::size_t>(row[f])];
    }
    return out;
  }
  /// Gives up what a refusal names, else a key by chance of `turn`. False when nothing is left.
  bool give_up(const std::string& refusal, std::size_t turn, Levels& row) const {
    std::vector<std::size_t> set;
    for (std::size_t f = 0; f < row.size(); ++f) {
      if (row[f] >= 0) set.push_back(f);
    }
    if (set.empty()) return false;
    const auto named = std::ranges::find_if(set, [&](std::size_t f) {
      return refusal.find(rows[f]->levels.key->name) != std::string::npos;
    });
    row[named != set.end() ? *named : set[turn % set.size()]] = -1;
    drop_unmet(row);
    return true;
  }
  /// Keys whose condition went with another key go too.
  void drop_unmet(Levels& row) const {
    const KeyTexts now = texts(row);
    for (std::size_t f = 0; f < row.size(); ++f) {
      if (row[f] >= 0 && !counts(*rows[f]->levels.key, now)) row[f] = -1;
    }
  }
};

/// One row, made smaller until it loads.
Outcome run_row(const KeyFactors& factors, NumericKind numeric, const std::filesystem::path& file,
                Levels& row) {
  for (std::size_t turn = 0;; ++turn) {
    Outcome outcome = run_combination(factors.texts(row), numeric, file);
    if (!outcome.refused || !outcome.violations.empty()) return outcome;
    if (!factors.give_up(outcome.refusal, turn, row)) return outcome;
  }
}

struct Pair {
  std::size_t f, g;
  int a, b;
};

std::vector<Pair> pairs_missing(const KeyFactors& factors, const PairTable& table) {
  std::vector<Pair> missing;
  for (std::size_t f = 0; f < factors.rows.size(); ++f) {
    for (std::size_t g = f + 1; g < factors.rows.size(); ++g) {
      for (int a = 0; a < factors.level_counts[f]; ++a) {
        for (int b = 0; b < factors.level_counts[g]; ++b) {
          if (!table.has(f, a, g, b)) missing.push_back({f, g, a, b});
        }
      }
    }
  }
  return missing;
}

/// A pair by itself; nothing where the two cannot stand together.
bool pair_texts(const KeyFactors& factors, const Pair& pair, KeyTexts& texts) {
  Levels row(factors.rows.size(), -1);
  row[pair.f] = pair.a;
  row[pair.g] = pair.b;
  texts = factors.texts(row);
  const SceneKey &one = *factors.rows[pair.f]->levels.key, &two = *factors.rows[pair.g]->levels.key;
  return meet_condition(one, texts) && meet_condition(two, texts) && counts(one, texts);
}

}  // namespace

PairRows study_pairs(const std::vector<KeyRow>& keys, const Effort& effort,
                     const StudyEvents& events) {
  const KeyFactors factors(keys);
  const Factors all{.level_counts = factors.level_counts,
                    .rare = factors.rare,
                    .deciding = factors.deciding,
                    .may = [&](const Levels& row, std::size_t factor, int) {
                      return counts(*factors.rows[factor]->levels.key, factors.texts(row));
                    }};
  const SceneFolder folder;
  PairRows out;
  PairTable table(factors.level_counts);
  out.pairs = table.pairs();
  // In parts, so that a run that is ended early has told what it found.
  constexpr std::size_t kPart = 100;
  const auto run = [&](std::size_t count, const auto& one) {
    for (std::size_t from = 0; from < count; from += kPart) {
      std::vector<Tally> tallies(std::min(kPart, count - from));
      in_parallel(
          tallies.size(), effort.jobs, folder,
          [&](std::size_t i, const std::filesystem::path& file) {
            one(from + i, file, tallies[i]);
          },
          [&](std::size_t i, double) {
            for (const Broken& broken : tallies[i].broken) events.broken(broken);
            events.progress(std::min(1.0, static_cast<double>(out.tally.ran) /
                                              static_cast<double>(effort.combinations)),
                            "pairs of ends, array " + std::to_string(out.arrays));
          });
      for (const Tally& tally : tallies) out.tally.add(tally);
      events.part(out);
    }
  };
  while (out.tally.ran < effort.combinations) {
    std::vector<Levels> rows = covering_rows(all, effort.seed + out.arrays);
    const std::size_t numbers = effort.numerics.size();
    rows.resize(std::min(rows.size(), (effort.combinations - out.tally.ran) / numbers + 1));
    ++out.arrays;
    run(rows.size(), [&](std::size_t i, const std::filesystem::path& file, Tally& tally) {
      for (const NumericKind numeric : effort.numerics) {
        const Outcome outcome = run_row(factors, numeric, file, rows[i]);
        tally.add(factors.texts(rows[i]), numeric, outcome);
      }
    });
    for (const Levels& row : rows) table.take(row);
    if (out.arrays != 1 || out.tally.ran >= effort.combinations) continue;
    const std::vector<Pair> missing = pairs_missing(factors, table);
    std::vector<char> seen(missing.size(), 0);
    run(missing.size(), [&](std::size_t i, const std::filesystem::path& file, Tally& tally) {
      KeyTexts texts;
      if (!pair_texts(factors, missing[i], texts)) return;
      for (const NumericKind numeric : effort.numerics) {
        const Outcome outcome = run_combination(texts, numeric, file);
        tally.add(texts, numeric, outcome);
        seen[i] = outcome.refused ? 0 : 1;
      }
    });
    out.together = static_cast<std::size_t>(std::ranges::count(seen, 1));
    out.never = missing.size() - out.together;
  }
  out.together += table.covered();
  return out;
}

Broken shrunk(Broken broken) {
  const SceneFolder folder;
  const auto breaks = [&](const KeyTexts& texts) {
    const Outcome outcome = run_combination(texts, broken.numeric, folder.path() / "scene.toml");
    return std::ranges::find(outcome.violations, broken.violation.rule, &Violation::rule) !=
           outcome.violations.end();
  };
  for (bool smaller = true; smaller;) {
    smaller = false;
    for (const auto& [key, text] : KeyTexts(broken.texts)) {
      KeyTexts fewer = broken.texts;
      fewer.erase(key);
      if (!breaks(fewer)) continue;
      broken.texts = std::move(fewer);
      smaller = true;
    }
  }
  return broken;
}

}  // namespace kerf::ranges
