// SPDX-License-Identifier: Apache-2.0
#include "tests/studies/ranges/covering.hpp"

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

namespace {

class Builder {
 public:
  Builder(const Factors& factors, std::uint64_t seed)
      : factors_(factors), table_(factors.level_counts), random_(seed), order_(count()) {}

  std::vector<Levels> rows() {
    constexpr int kTries = 8;  // rows in vain before pairs are looked for one by one
    for (int vain = 0; vain < kTries;) vain = take(filled(decided())) ? 0 : vain + 1;
    for (std::size_t f = 0; f < count(); ++f) {
      for (std::size_t g = f + 1; g < count(); ++g) {
        for (int a = 0; a < factors_.level_counts[f]; ++a) {
          for (int b = 0; b < factors_.level_counts[g]; ++b) {
            if (!table_.has(f, a, g, b)) add_pair(f, a, g, b);
          }
        }
      }
    }
    return std::move(rows_);
  }

 private:
  [[nodiscard]] std::size_t count() const { return factors_.level_counts.size(); }
  std::size_t below(std::size_t end) { return static_cast<std::size_t>(random_() % end); }
  bool take(Levels row) {
    const bool is_new = table_.take(row) > 0;
    if (is_new) rows_.push_back(std::move(row));
    return is_new;
  }

  /// A row with any levels of the deciding factors.
  Levels decided() {
    Levels row(count(), -1);
    for (std::size_t f = 0; f < factors_.deciding; ++f) set_best(f, row);
    return row;
  }
  /// The rest of the row in an order of its own.
  Levels filled(Levels row) {
    std::iota(order_.begin(), order_.end(), std::size_t{0});
    for (std::size_t i = order_.size(); i > factors_.deciding + 1; --i) {
      std::swap(order_[i - 1], order_[factors_.deciding + below(i - factors_.deciding)]);
    }
    for (std::size_t i = factors_.deciding; i < order_.size(); ++i) {
      if (row[order_[i]] < 0) set_best(order_[i], row);
    }
    return row;
  }
  /// The level that brings most, or none: see the header.
  void set_best(std::size_t factor, Levels& row) {
    const int levels = factors_.level_counts[factor];
    const std::size_t chances = factors_.rare[factor] ? 8 : 2;
    if (levels == 0 || below(chances) != 0) return;
    int most = -1;
    const auto from = static_cast<int>(below(static_cast<std::size_t>(levels)));  // of ties
    for (int i = 0; i < levels; ++i) {
      const int level = (from + i) % levels;
      const int added = table_.added_by(row, factor, level);
      if (added <= most || !factors_.may(row, factor, level)) continue;
      most = added;
      row[factor] = level;
    }
  }
  /// A row with this pair, if one is found with it.
  void add_pair(std::size_t f, int a, std::size_t g, int b) {
    constexpr int kTries = 32;
    for (int i = 0; i < kTries; ++i) {
      Levels row = decided();
      row[f] = row[g] = -1;
      if (!factors_.may(row, f, a)) continue;
      row[f] = a;
      if (!factors_.may(row, g, b)) continue;
      row[g] = b;
      bool holds = true;  // a level of a deciding factor may rule others out
      for (std::size_t k = 0; k < factors_.deciding; ++k) {
        holds = holds && (row[k] < 0 || factors_.may(row, k, row[k]));
      }
      if (!holds || !factors_.may(row, f, a)) continue;
      static_cast<void>(take(filled(std::move(row))));
      return;
    }
  }

  const Factors& factors_;
  PairTable table_;
  std::mt19937_64 random_;
  std::vector<std::size_t> order_;
  std::vector<Levels> rows_;
};

}  // namespace

std::vector<Levels> covering_rows(const Factors& factors, std::uint64_t seed) {
  return Builder(factors, seed).rows();
}

}  // namespace kerf::ranges
