// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace kerf::bridge {

// OpenIGTLink, send only.

}  // namespace kerf::bridge
