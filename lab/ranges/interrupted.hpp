// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "shared/posix/stop_signals.hpp"

namespace kerf::ranges {

/// Thrown out of a study whose program was asked to end.
struct Interrupted {};

inline void end_if_asked() {
  if (stop_requested()) throw Interrupted();
}

}  // namespace kerf::ranges
