// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cerrno>
#include <fstream>
#include <sstream>
#include <string>
#include <system_error>

#include <fcntl.h>
#include <sys/socket.h>
#include <unistd.h>

#include "hil/front/usbip/usbip_falcon.hpp"
#include "hil/hil_error.hpp"

namespace kerf {
namespace {

const std::string kHub = "/sys/devices/platform/vhci_hcd.0";
constexpr int kFreePort = 4;   // VDEV_ST_NULL
constexpr int kFullSpeed = 2;  // enum usb_device_speed
constexpr int kDeviceId = 1;   // names it in every message; nobody else is on this cable

[[noreturn]] void refuse(const std::string& rest) {
  throw HilError("--front usbip: " + kHub + rest);
}

/// A line of `status` after its heading: hub, port, state, and what no free port needs.
int free_port() {
  std::ifstream status(kHub + "/status");
  if (!status) refuse(": is not there; as root: modprobe vhci-hcd");
  std::string line, hub;
  std::getline(status, line);
  while (std::getline(status, line)) {
    std::istringstream words(line);
    int port = 0, state = 0;
    if (words >> hub >> port >> state && hub == "hs" && state == kFreePort) return port;
  }
  refuse(": has no free port; end another emulator");
}

}  // namespace

int plug_into_vhci() {
  const std::string line = std::to_string(free_port());
  const int attach = open((kHub + "/attach").c_str(), O_WRONLY | O_CLOEXEC);
  if (attach < 0) {
    refuse("/attach: " + std::generic_category().message(errno) + "; run as root");
  }
  std::array<int, 2> cable{};
  int error = socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, cable.data()) == 0 ? 0 : errno;
  if (error == 0) {
    const std::string wanted = line + ' ' + std::to_string(cable[1]) + ' ' +
                               std::to_string(kDeviceId) + ' ' + std::to_string(kFullSpeed);
    if (write(attach, wanted.data(), wanted.size()) < 0) error = errno;
    close(cable[1]);  // the kernel has its own hold of it
    if (error != 0) close(cable[0]);
  }
  close(attach);
  if (error != 0) {
    refuse("/attach: " + std::generic_category().message(error) +
           "; is another emulator starting?");
  }
  return cable[0];
}

}  // namespace kerf
