// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace kerf::bridge {

// What one viewer has, and what it is sent next: passes, frames, credit. No network here.

}  // namespace kerf::bridge
