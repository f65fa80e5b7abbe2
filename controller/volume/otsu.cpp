// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/otsu.hpp"

namespace kerf {

OtsuSplit otsu_split(std::span<const double> counts) {
  double total = 0.0, total_sum = 0.0;
  for (std::size_t bin = 0; bin < counts.size(); ++bin) {
    total += counts[bin];
    total_sum += counts[bin] * static_cast<double>(bin);
  }
  // Both ends of the range of best thresholds; counts are whole, so equal parts compare equal.
  double best = 0.0, below = 0.0, below_sum = 0.0;
  std::size_t first = counts.size() / 2, last = first;
  OtsuSplit split;
  for (std::size_t bin = 1; bin < counts.size(); ++bin) {  // classes: [0, bin) and [bin, end)
    below += counts[bin - 1];
    below_sum += counts[bin - 1] * static_cast<double>(bin - 1);
    if (below == 0.0 || below == total) continue;
    const double low = below_sum / below, high = (total_sum - below_sum) / (total - below);
    const double between = below * (total - below) * (low - high) * (low - high);
    if (between > best) {
      best = between;
      first = bin;
      split.low_mean = low;
      split.high_mean = high;
    }
    if (between == best) last = bin;
  }
  split.bin = static_cast<double>(first + last) / 2.0;
  return split;
}

}  // namespace kerf
