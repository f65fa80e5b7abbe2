// SPDX-License-Identifier: Apache-2.0
#include "tests/studies/ranges/key_study.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tests/studies/ranges/combination.hpp"
#include "tests/studies/ranges/covering.hpp"

namespace kerf::ranges {
namespace {

/// `work(i, file)` for all i below `count` on so many threads, each with a scene file of its own;
/// then `done(i, share of all)`, one thread at a time. Throws Interrupted after a signal that asks
/// for the end.
void in_parallel(std::size_t count, std::size_t jobs, const SceneFolder& folder,
                 const std::function<void(std::size_t, const std::filesystem::path&)>& work,
                 const std::function<void(std::size_t, double share)>& done) {
  std::size_t ended = 0;
  grid::Run run(jobs);
  run.all(count, [&](std::size_t i, std::size_t thread) {
    end_if_asked();
    work(i, folder.path() / ("scene" + std::to_string(thread) + ".toml"));
    const std::scoped_lock hold(run.results());
    done(i, static_cast<double>(++ended) / static_cast<double>(count));
  });
  end_if_asked();
}

/// The scene with one key at this text; empty if its condition cannot be met.
bool set(const SceneKey& key, const std::string& text, KeyTexts& texts) {
  if (!meet_condition(key, texts)) return false;
  texts[std::string(key.name)] = text;
  return true;
}

/// The last value from the plain one toward `end` that the loader takes in the first numbers of the
/// effort; empty if there is none. By bisection: of sizes by their ratio.
std::string last_accepted(const SceneKey& key, double end, const StudySize& effort,
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

/// The keys of the pairs. Those that others depend on come first.
struct KeyFactors {
  std::vector<const KeyRow*> rows;
  std::vector<int> level_counts;
  /// If some end has no contact, else hardly any row would have contact; and if the ends take
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
  /// The factors of covering rows, in which a key stands only if its condition is met. Refers to
  /// this object.
  [[nodiscard]] Factors of_rows() const {
    return {.level_counts = level_counts,
            .rare = rare,
            .deciding = deciding,
            .may = [this](const Levels& row, std::size_t factor, int) {
              return counts(*rows[factor]->levels.key, texts(row));
            }};
  }
  /// Gives up the key that a refusal names, else a key by chance of `turn`. Returns false if
  /// nothing is left.
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
SceneOutcome run_row(const KeyFactors& factors, NumericKind numeric,
                     const std::filesystem::path& file, Levels& row) {
  for (std::size_t turn = 0;; ++turn) {
    SceneOutcome outcome = run_combination(factors.texts(row), numeric, file);
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

/// A pair by itself; empty if the two cannot stand together.
bool pair_texts(const KeyFactors& factors, const Pair& pair, KeyTexts& texts) {
  Levels row(factors.rows.size(), -1);
  row[pair.f] = pair.a;
  row[pair.g] = pair.b;
  texts = factors.texts(row);
  const SceneKey &one = *factors.rows[pair.f]->levels.key, &two = *factors.rows[pair.g]->levels.key;
  return meet_condition(one, texts) && meet_condition(two, texts) && counts(one, texts);
}

}  // namespace

void Tally::add(const KeyTexts& texts, NumericKind numeric, const SceneOutcome& outcome) {
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

std::vector<KeyRow> study_keys(const StudySize& effort, const StudyEvents& events) {
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
        const SceneOutcome outcome = run_combination(texts, numeric, file);
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
      const SceneOutcome outcome = load_combination(texts, effort.numerics.front(), file);
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

PairRows study_pairs(const std::vector<KeyRow>& keys, const StudySize& effort,
                     const StudyEvents& events) {
  const KeyFactors factors(keys);
  const Factors all = factors.of_rows();
  const SceneFolder folder;
  PairRows out;
  PairTable table(factors.level_counts);
  out.pairs = table.pairs();
  // In parts, so that a run that is ended early has reported its findings.
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
        const SceneOutcome outcome = run_row(factors, numeric, file, rows[i]);
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
        const SceneOutcome outcome = run_combination(texts, numeric, file);
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
    const SceneOutcome outcome =
        run_combination(texts, broken.numeric, folder.path() / "scene.toml");
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
