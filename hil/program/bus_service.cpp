// SPDX-License-Identifier: Apache-2.0
#include "hil/program/bus_service.hpp"

#include <cstdint>
#include <ostream>
#include <utility>

#include "hil/front/firewire/firewire_node.hpp"
#include "hil/front/fuse/fuse_mount.hpp"
#include "hil/front/usb/hidraw_node.hpp"
#include "hil/front/usb/usbfs_node.hpp"
#include "hil/front/usb/usbip_falcon.hpp"
#include "hil/front/usb/wooden_hid.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "shared/text/text.hpp"

namespace kerf {
namespace {

/// The start of a device's idle time, by the clock: its own time stands still then.
class Unused {
 public:
  [[nodiscard]] bool for_longer_than(std::int64_t ns, bool in_use) noexcept {
    const std::int64_t now_ns = monotonic_ns();
    if (in_use) since_ns_ = now_ns;
    return now_ns - since_ns_ > ns;
  }

 private:
  std::int64_t since_ns_ = monotonic_ns();
};

/// Serves `node` as `mount`/`name`, and the other nodes of `folder`; `cycles()` since the start.
template <class Node, class Cycles>
void serve_node(BusService& service, FuseMount& folder, const std::string& mount,
                const char* device, const std::string& name, Node& node, Cycles cycles) {
  folder.add(name, node);
  service.out << "kerf-emulator: " << device << " at " << escaped(mount) << '/' << name
              << std::endl;
  Unused unused;
  folder.serve([&] {
    return service.goes_on(cycles(), node.left()) &&
           !unused.for_longer_than(service.limits.left_ns(cycles()), node.in_use());
  });
  service.stats.wake = folder.lateness();
}

}  // namespace

void serve_fuse(BusService& service, const std::string& mount, const FirewireSettings& omni) {
  FirewireNode node(omni, service.device);
  FuseMount folder(mount);
  folder.add("fw0", node, FirewireNode::kHostFile);
  serve_node(service, folder, mount, "omni", "fw1", node,
             [&] { return node.bus().cycle() - kFirstCycle; });
  service.stats.sent = node.bus().stats().reports;
  service.stats.dropped = node.bus().stats().undelivered;
}

void serve_fuse(BusService& service, const std::string& mount, const FtdiFalcon::Settings& falcon,
                std::vector<ScriptedUsbFault> script) {
  UsbfsNode node(falcon, std::move(script), service.device);
  FuseMount folder(mount);
  serve_node(service, folder, mount, "falcon", "usb", node,
             [&] { return node.chip().time().cycle(); });
  service.stats.sent = node.chip().reports();
  service.stats.dropped = node.chip().lost();
}

void serve_fuse(BusService& service, const std::string& mount, const WoodenHid::Settings& wooden) {
  HidrawNode node(wooden, service.device);
  FuseMount folder(mount);
  serve_node(service, folder, mount, "woodenhaptics", "hidraw0", node,
             [&] { return node.arm().time().cycle(); });
  service.stats.sent = node.arm().reports();
  service.stats.dropped = node.lost();
}

void serve_usbip(BusService& service, const FtdiFalcon::Settings& falcon,
                 std::vector<ScriptedUsbFault> script) {
  UsbipFalcon device(falcon, std::move(script), service.device, plug_into_vhci);
  service.out << "kerf-emulator: falcon at a port of vhci_hcd" << std::endl;
  const auto goes_on = [&] {  // a kernel that let go does not come back, even to one that stays
    return !device.left() && service.goes_on(device.chip().time().cycle(), false);
  };
  serve_kernel(device, goes_on, service.stats.wake);
  service.stats.sent = device.chip().reports();
  service.stats.dropped = device.chip().lost();
}

void serve_uhid(BusService& service, const WoodenHid::Settings& wooden) {
  UhidArm device(open_uhid(), wooden, service.device);
  service.out << "kerf-emulator: woodenhaptics at /dev/uhid" << std::endl;
  const auto goes_on = [&] { return service.goes_on(device.arm().time().cycle(), device.left()); };
  serve_kernel(device, goes_on, service.stats.wake);
  service.stats.sent = device.arm().reports();
  service.stats.dropped = device.lost();
}

}  // namespace kerf
