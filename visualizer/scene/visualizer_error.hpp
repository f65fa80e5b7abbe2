// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>

namespace kerf {

/// Anything that ends the visualizer: one line that names the location, the value and the way out.
class VisualizerError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace kerf
