// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace kerf {

/// The picture that gnuplot draws on its standard output for a script with `set terminal svg`.
/// Writes no file. Throws `RecordError` where there is no gnuplot, no memory, or no whole picture.
[[nodiscard]] std::string gnuplot_svg(const std::string& script);

}  // namespace kerf
