// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "controller/scene/scene.hpp"
#include "lab/run/grid_run.hpp"
#include "shared/posix/stop_signals.hpp"
#include "tests/studies/ranges/combination.hpp"
#include "tests/studies/ranges/key_levels.hpp"

/// Studies of all keys at their ends: each alone, and all pairs.
namespace kerf::ranges {

/// Throws `Interrupted` if a signal asked for the end.
inline void end_if_asked() {
  if (stop_requested()) throw Interrupted();
}

/// The size of a study.
struct StudySize {
  std::vector<NumericKind> numerics;
  std::size_t combinations = 0;  ///< of keys at their ends, at least
  std::uint64_t seed = 1;
  std::size_t jobs = 1;  ///< threads
};

/// A scene that broke a rule, with the keys that it needs for that.
struct Broken {
  KeyTexts texts;
  NumericKind numeric;
  Violation violation;
};

/// Counts of scenes.
struct Tally {
  std::size_t ran = 0, refused = 0, felt = 0, cut = 0, faulted = 0, ticks = 0;
  std::vector<Broken> broken;

  void add(const KeyTexts& texts, NumericKind numeric, const SceneOutcome& outcome);
  void add(const Tally& other);
};

/// One key of the table, alone in an otherwise plain scene.
struct KeyRow {
  KeyLevels levels;
  std::vector<std::string> accepted;  ///< ends that the loader takes in this scene
  std::size_t beyond_refused = 0;     ///< of the values beyond the ends, in all numbers
  Tally ends;
};

/// All pairs of ends of two keys.
struct PairRows {
  std::size_t arrays = 0;
  std::size_t pairs = 0, together = 0;  ///< of one array's pairs; that stood together in a run
  std::size_t never = 0;                ///< that contradict each other, or are refused together
  Tally tally;
};

/// Called while a study runs, by one thread at a time.
struct StudyEvents {
  std::function<void(double share, const std::string& what)> progress;  ///< 0..1, and the work
  std::function<void(const Broken&)> broken;                            ///< at once
  std::function<void(const PairRows&)> part;  ///< the rows so far, after each hundred
};

/// Each end of each key alone, and the values just beyond, in all numbers.
[[nodiscard]] std::vector<KeyRow> study_keys(const StudySize& effort, const StudyEvents& events);

/// Covering arrays of the accepted ends, one after the other until there are as many combinations
/// as the effort says. A row that the loader refuses gives up the key that the refusal names, until
/// it loads; pairs that were lost so are tried by themselves after the first array.
[[nodiscard]] PairRows study_pairs(const std::vector<KeyRow>& keys, const StudySize& effort,
                                   const StudyEvents& events);

/// Takes keys out of a scene as long as it still breaks the rule.
[[nodiscard]] Broken shrunk(Broken broken);

}  // namespace kerf::ranges
