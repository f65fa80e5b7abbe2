// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace kerf::ranges {

/// One level of each factor; -1: the factor is left out.
using Levels = std::vector<int>;

/// The factors of rows.
struct Factors {
  std::vector<int> level_counts;
  std::vector<bool> rare;    ///< by factor: stands in an eighth of the rows, else in half
  std::size_t deciding = 0;  ///< so many come first: the levels of others depend on them
  /// Which levels a factor may have beside those of a row.
  std::function<bool(const Levels& row, std::size_t factor, int level)> may;
};

/// Rows of levels in which every two levels of two factors stand together at least once, if any row
/// may have both.
///
/// Greedy (Cohen, Dalal, Fredman, Patton 1997): each row takes its factors in an order of its own,
/// leaves some out, and gives each other one the level that brings the most new pairs. Pairs that
/// are missing in the end get a row each. The same seed gives the same rows.
[[nodiscard]] std::vector<Levels> covering_rows(const Factors& factors, std::uint64_t seed);

/// Which pairs of levels were seen. Levels are counted from 0; -1 is none.
class PairTable {
 public:
  explicit PairTable(const std::vector<int>& level_counts);
  [[nodiscard]] std::size_t pairs() const { return pairs_; }
  [[nodiscard]] std::size_t covered() const { return covered_; }
  [[nodiscard]] bool has(std::size_t f, int a, std::size_t g, int b) const;
  /// How many pairs a level adds to a row.
  [[nodiscard]] int added_by(const Levels& row, std::size_t factor, int level) const;
  /// All pairs of a row; returns how many are new.
  int take(const Levels& row);

 private:
  [[nodiscard]] std::size_t at(std::size_t f, int a, std::size_t g, int b) const;

  std::vector<std::size_t> offset_;  ///< of each factor's first level among all
  std::size_t all_ = 0, pairs_ = 0, covered_ = 0;
  std::vector<bool> seen_;
};

}  // namespace kerf::ranges
