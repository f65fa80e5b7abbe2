// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

namespace kerf {

/// Two classes of a histogram: below `bin`, and from there on.
struct OtsuSplit {
  double bin = 0;                      ///< between two bins where a whole range parts equally
  double low_mean = 0, high_mean = 0;  ///< of the classes, in bins
};

/// Otsu's threshold (IEEE Trans. SMC 9, 1979): the one with the largest variance between the two
/// classes, in the middle of the range where several part them equally. Where all is in one bin,
/// the middle of the histogram; the means are 0 then.
[[nodiscard]] OtsuSplit otsu_split(std::span<const double> counts);

}  // namespace kerf
