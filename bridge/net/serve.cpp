// SPDX-License-Identifier: Apache-2.0
#include "bridge/net/serve.hpp"

#include "bridge/net/bridge_error.hpp"

namespace kerf::bridge {

int run_serve(const ServeOptions& options, const std::atomic<bool>&) {
  throw BridgeError("--listen " + options.listen + ": not built yet");
}

}  // namespace kerf::bridge
