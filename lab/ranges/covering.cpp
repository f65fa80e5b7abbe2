// SPDX-License-Identifier: Apache-2.0
#include "lab/ranges/covering.hpp"

#include <algorithm>
#include <numeric>
#include <random>
#include <utility>

namespace kerf::ranges {

PairTable::PairTable(const std::vector<int>& level_counts) {
  for (const int levels : level_counts) {
    offset_.push_back(all_);
    pairs_ += all_ * static_cast<std::size_t>(levels);
    all_ += static_cast<std::size_t>(levels);
  }
  seen_.resize(all_ * all_);
}

std::size_t PairTable::at(std::size_t f, int a, std::size_t g, int b) const {
  if (f > g) {
    std::swap(f, g);
    std::swap(a, b);
  }
  return (offset_[f] + static_cast<std::size_t>(a)) * all_ + offset_[g] +
         static_cast<std::size_t>(b);
}

bool PairTable::has(std::size_t f, int a, std::size_t g, int b) const {
  return seen_[at(f, a, g, b)];
}

int PairTable::added_by(const Levels& row, std::size_t factor, int level) const {
  int added = 0;
  for (std::size_t g = 0; g < row.size(); ++g) {
    if (g != factor && row[g] >= 0 && !has(factor, level, g, row[g])) ++added;
  }
  return added;
}

int PairTable::take(const Levels& row) {
  int added = 0;
  for (std::size_t f = 0; f < row.size(); ++f) {
    for (std::size_t g = f + 1; g < row.size(); ++g) {
      if (row[f] < 0 || row[g] < 0) continue;
      const std::size_t place = at(f, row[f], g, row[g]);
      if (seen_[place]) continue;
      seen_[place] = true;
      ++added;
    }
  }
  covered_ += static_cast<std::size_t>(added);
  return added;
}

std::vector<Levels> covering_rows(
    const std::vector<int>& level_counts, std::size_t first, const std::vector<bool>& rare,
    std::uint64_t seed,
    const std::function<bool(const Levels& row, std::size_t factor, int level)>& may) {
  constexpr int kTries = 8;  // rows in vain before the end
  PairTable table(level_counts);
  std::mt19937_64 random(seed);
  const auto below = [&](std::size_t end) { return static_cast<std::size_t>(random() % end); };
  std::vector<Levels> rows;
  std::vector<std::size_t> order(level_counts.size());
  for (int vain = 0; vain < kTries;) {
    std::iota(order.begin(), order.end(), std::size_t{0});
    const auto shuffle = [&](std::size_t from, std::size_t to) {
      for (std::size_t i = to; i > from + 1; --i) {
        std::swap(order[i - 1], order[from + below(i - from)]);
      }
    };
    shuffle(0, first);
    shuffle(first, order.size());
    Levels row(level_counts.size(), -1);
    for (const std::size_t factor : order) {
      int best = -1, most = -1;
      const int levels = level_counts[factor];
      const std::size_t chances = rare[factor] ? 8 : 2;
      if (levels == 0 || below(chances) != 0) continue;
      const int from = static_cast<int>(below(static_cast<std::size_t>(levels)));  // ties
      for (int i = 0; i < levels; ++i) {
        const int level = (from + i) % levels;
        if (!may(row, factor, level)) continue;
        const int added = table.added_by(row, factor, level);
        if (added <= most) continue;
        most = added;
        best = level;
      }
      row[factor] = best;
    }
    vain = table.take(row) > 0 ? 0 : vain + 1;
    if (vain == 0) rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace kerf::ranges
