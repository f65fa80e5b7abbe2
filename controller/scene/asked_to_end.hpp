// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "controller/scene/scene_error.hpp"
#include "shared/posix/stop_signals.hpp"

namespace kerf {

/// For work of load time that takes long: throws a SceneError where a signal asked the program to
/// end. `place`: what is at work, mostly a file.
inline void end_if_asked(const std::string& place) {
  if (!stop_requested()) return;
  throw SceneError(place + ": reading it was stopped by a signal; start again");
}

}  // namespace kerf
