// SPDX-License-Identifier: Apache-2.0
#include "bridge/net/identity.hpp"

#include "bridge/net/bridge_error.hpp"

namespace kerf::bridge {

int run_make_identity(const IdentityOptions& options) {
  throw BridgeError(options.folder.string() + ": not built yet");
}

}  // namespace kerf::bridge
