// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "controller/scene/scene.hpp"
#include "lab/ranges/combination.hpp"
#include "lab/ranges/key_levels.hpp"

namespace kerf::ranges {

/// How much a run does.
struct Effort {
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

  void add(const KeyTexts& texts, NumericKind numeric, const Outcome& outcome);
  void add(const Tally& other);
};

/// One key of the table, alone in an otherwise plain scene.
struct KeyRow {
  KeyLevels levels;
  std::vector<std::string> accepted;  ///< ends that the loader takes in this scene
  std::size_t beyond_refused = 0;     ///< of what lies beyond the ends, in all numbers
  Tally ends;
};

struct PairRows;

/// What a study calls while it runs. One thread at a time.
struct StudyEvents {
  std::function<void(double share, const std::string& what)> progress;  ///< 0..1, at work on what
  std::function<void(const Broken&)> broken;                            ///< at once
  std::function<void(const PairRows&)> part;  ///< what there is after each hundred rows
};

/// Each end of each key alone, and what lies just beyond, in all numbers.
[[nodiscard]] std::vector<KeyRow> study_keys(const Effort& effort, const StudyEvents& events);

}  // namespace kerf::ranges
