// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace kerf {

// What the servo's fixed arrays hold and the segment has descriptors for; a scene file with more is
// refused.
inline constexpr std::size_t kMaxVolumes = 8;
inline constexpr std::size_t kMaxTools = 16;

}  // namespace kerf
