// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace kerf::bridge {

// The far side: what frames and records of a server become, a local segment.

}  // namespace kerf::bridge
