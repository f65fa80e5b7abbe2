// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

namespace kerf {

/// An array of a compiled scene.
struct ArrayBytes {
  std::string name;
  std::uint64_t bytes = 0;
  bool taken = false;  ///< in memory already when the scene is planned
};

}  // namespace kerf
