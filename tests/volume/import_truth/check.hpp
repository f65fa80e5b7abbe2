// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "tests/volume/import_truth/numbered.hpp"

namespace kerf::test {

/// All situations, format by format, in the order of the page.
[[nodiscard]] const std::vector<Situation>& situations();

/// The situation `s` with the choices of `seed`, no side longer than `longest`.
struct Case {
  std::size_t s = 0;
  std::uint64_t seed = 0;
  int longest = 20;
  std::string kept_in{};  ///< a copy of its files, if not empty
};

/// The end of a case.
struct Verdict {
  bool read = false;
  std::string wrong;    ///< empty, or why the case failed
  std::string message;  ///< of a refusal, without the folder
  std::string note;     ///< of a reading
};
[[nodiscard]] Verdict verdict_of(const Case& one);

/// The first voxel that has another value or another position than the truth; empty if none has.
[[nodiscard]] std::string difference(const Numbered& truth, const SourceVolume& source);

/// The voxel of `frame` whose centre is at `lps_mm`; `apart_mm` is the distance to it.
[[nodiscard]] VoxelIndex voxel_at(const VolumeFrame& frame, const vec3::Vec& lps_mm,
                                  double& apart_mm);

/// The last part of docs/own-volume.md.
[[nodiscard]] std::string import_page();

}  // namespace kerf::test
