// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace kerf {

/// Name of a controller's segment, and of the controller that a reader looks for, where nobody says
/// another (`--name`).
inline constexpr const char* kUsualName = "kerf";

}  // namespace kerf
