// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "controller/volume/file/foreign_volume.hpp"
#include "controller/volume/file/header_fields.hpp"

namespace kerf::volume {

/// Size, spacing, origin and axes of a NRRD of `sizes`, in LPS and mm; the note says what the
/// header leaves open. Throws LoadError for more than one value per voxel, not three axes in space,
/// an unknown space or unit, and what contradicts itself. The sizes are not checked against the
/// limits.
[[nodiscard]] UntrustedHeader nrrd_claim(const HeaderFields& fields,
                                         const std::vector<std::int64_t>& sizes);

}  // namespace kerf::volume
