// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>

#include "controller/volume/file/foreign_volume.hpp"
#include "shared/numeric/linear_algebra.hpp"

// Axes of a volume as letters: where its columns, rows and slices lead in a body.

namespace kerf {

/// Directions in LPS from three letters, one of each pair: L or R (left, right of the body), P or A
/// (back, front), S or I (top, bottom). An axis leads toward its letter, as in NRRD and nibabel; in
/// any case. Throws LoadError, which begins with `place`.
[[nodiscard]] std::array<vec3::Vec, 3> axes_from(const std::string& place,
                                                 const std::string& letters);

/// Sets the axes of a file that names none from `letters`; without letters returns, on one line,
/// which usual ones are taken: if they are wrong the volume is turned or mirrored. Throws LoadError
/// for letters that are none, and for a file that has axes of its own.
[[nodiscard]] std::string take_axes(const std::string& place, const std::string& letters,
                                    volume::UntrustedHeader& claim);

}  // namespace kerf
