// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>

namespace kerf {

/// What is wrong with a scene, a volume or a tool, as one line: `place: value; way out`.
///
/// The only exception of the loading code. `main` adds the program's name, prints the line and
/// returns 2.
class SceneError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace kerf
