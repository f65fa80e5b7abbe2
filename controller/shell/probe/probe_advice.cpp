// SPDX-License-Identifier: Apache-2.0
#include "controller/shell/probe/probe_advice.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <system_error>
#include <thread>

#include <sys/mman.h>
#include <sys/resource.h>

#include "controller/shell/real_time.hpp"
#include "shared/posix/cores.hpp"

namespace kerf {
namespace {

namespace fs = std::filesystem;

constexpr const char* kRules = "60-kerf.rules";
constexpr std::size_t kServoMemoryBytes = std::size_t{1} << 30;  // of a large scene

/// Where the kernel lists the bus of a device, and how to look for it by hand.
struct Bus {
  const char* sysfs;
  const char* missing;  ///< what to do where the kernel has no such bus
  const char* absent;   ///< where it has, and the device is not on it
};

Bus bus_of(Personality personality) {
  switch (personality) {
    case Personality::omni:
      return {"sys/bus/firewire",
              "sudo modprobe firewire-ohci (is there a card? lspci | grep 1394)",
              "connect and power it, then: sudo dmesg | grep firewire"};
    case Personality::falcon:
      return {"sys/bus/usb", "sudo modprobe xhci-pci (is there a controller? lspci | grep USB)",
              "connect and power it, then: lsusb -d 0403:cb48"};
    case Personality::woodenhaptics:
      break;
  }
  return {"sys/class/hidraw", "sudo modprobe usbhid",
          "connect and power it, then: lsusb -d 1234:0006; lsusb -d 16c0:0486"};
}

bool rules_installed(const fs::path& root) {
  constexpr std::array kFolders{"etc/udev/rules.d", "usr/local/lib/udev/rules.d",
                                "usr/lib/udev/rules.d", "lib/udev/rules.d"};
  return std::ranges::any_of(kFolders, [&](const char* folder) {
    std::error_code ignored;
    return fs::exists(root / folder / kRules, ignored);
  });
}

std::string cure_of_right(const fs::path& root) {
  if (!rules_installed(root)) {
    return std::string("sudo install -m 644 controller/device/") + kRules +
           " /etc/udev/rules.d/ && sudo udevadm control --reload && sudo udevadm trigger";
  }
  return "sudo usermod -aG plugdev $USER, log in again, plug the device in again";
}

std::string limit_line(const char* limit) {
  return std::string("echo '@plugdev - ") + limit +
         "' | sudo tee -a /etc/security/limits.d/kerf.conf, then log in again";
}

/// On a thread of its own: a priority cannot be tried without taking it.
int fifo_error(int priority) {
  int error = 0;
  std::thread([&] { error = set_fifo(priority); }).join();
  return error;
}

/// Whether so much may be locked, tried without touching it.
bool may_lock(std::size_t bytes) {
  rlimit limit{};
  if (getrlimit(RLIMIT_MEMLOCK, &limit) == 0 && limit.rlim_cur >= bytes) return true;
  // Beyond the limit only a privilege helps: then a page more than the limit can be locked too.
  const std::size_t above = limit.rlim_cur + 65536;
  void* const at = mmap(nullptr, above, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (at == MAP_FAILED) return false;
  const bool locked = mlock2(at, above, MLOCK_ONFAULT) == 0;
  munmap(at, above);
  return locked;
}

}  // namespace

std::vector<Lack> lacks_of_nodes(std::optional<Personality> which,
                                 std::span<const DeviceNode> nodes, const fs::path& root) {
  std::vector<Lack> lacks;
  bool found = false;
  for (const DeviceNode& node : nodes) {
    if (which && node.personality != *which) continue;
    found = true;
    if (node.open_error == 0) continue;
    lacks.push_back(
        {node.path + ": " + std::generic_category().message(node.open_error), cure_of_right(root)});
  }
  if (which && !found) {
    const Bus bus = bus_of(*which);
    std::error_code ignored;
    const bool has_bus = fs::exists(root / bus.sysfs, ignored);
    const std::string name(kPersonalityWords[static_cast<std::size_t>(*which)]);
    lacks.push_back({name + (has_bus ? ": none is connected"
                                     : ": the kernel has no /" + std::string(bus.sysfs)),
                     has_bus ? bus.absent : bus.missing});
  }
  return lacks;
}

std::vector<Lack> lacks_of_rights() {
  std::vector<Lack> lacks;
  const int priority = RealTimeOptions{}.priority;
  if (const int error = fifo_error(priority); error != 0) {
    lacks.push_back({"SCHED_FIFO " + std::to_string(priority) + ": " +
                         std::generic_category().message(error) +
                         "; other programs delay ticks by milliseconds",
                     limit_line("rtprio 95")});
  }
  if (!may_lock(kServoMemoryBytes)) {
    lacks.push_back({"locked memory: less than " + std::to_string(kServoMemoryBytes >> 20) +
                         " MiB; a page fault may delay a tick",
                     limit_line("memlock unlimited")});
  }
  return lacks;
}

}  // namespace kerf
