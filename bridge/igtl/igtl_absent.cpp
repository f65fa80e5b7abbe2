// SPDX-License-Identifier: Apache-2.0
// In place of the others if libopenigtlink was missing when kerf was built.
#include <stdexcept>

#include "bridge/igtl/igtl_output.hpp"

namespace kerf::bridge {

struct IgtlOutput::State {};

IgtlOutput::IgtlOutput(const IgtlOptions& options) {
  throw std::runtime_error("--openigtlink " + std::to_string(options.port) +
                           ": this kerf-bridge was built without OpenIGTLink; install "
                           "libopenigtlink-dev and build again");
}
IgtlOutput::~IgtlOutput() = default;

std::uint16_t IgtlOutput::port() const noexcept {
  return 0;
}

}  // namespace kerf::bridge
