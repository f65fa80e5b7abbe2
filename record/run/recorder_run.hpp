// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>

#include "record/run/recorder_options.hpp"

namespace kerf {

/// Records the controller `options.name` into the folder `options.out` until it ends or `stop`:
/// ticks.npy (ticks-2.npy of a second arm), clock.npy, scene.json, manifest.json. Returns the exit
/// code: 0, or 1 under `strict` if ticks were lost. Bad input and a full disk throw.
[[nodiscard]] int run_recorder(const RecorderOptions& options, const std::atomic<bool>& stop);

}  // namespace kerf
