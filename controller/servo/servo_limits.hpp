// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace kerf {

// What the servo's fixed arrays hold; a scene file with more is refused.
inline constexpr std::size_t kMaxVolumes = 8;  ///< as many as the segment has descriptors for
inline constexpr std::size_t kMaxTools = 16;

}  // namespace kerf
