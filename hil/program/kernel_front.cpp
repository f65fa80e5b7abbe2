// SPDX-License-Identifier: Apache-2.0
#include "hil/program/kernel_front.hpp"

#include <ostream>
#include <utility>

#include "hil/front/uhid/uhid_arm.hpp"
#include "hil/front/usbip/usbip_falcon.hpp"
#include "hil/front/usbip/vhci_hub.hpp"

namespace kerf {

void serve_usbip(const BusService& service, const FtdiFalcon::Settings& falcon,
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

void serve_uhid(const BusService& service, const WoodenHid::Settings& wooden) {
  UhidArm device(open_uhid(), wooden, service.device);
  service.out << "kerf-emulator: woodenhaptics at /dev/uhid" << std::endl;
  const auto goes_on = [&] { return service.goes_on(device.arm().time().cycle(), device.left()); };
  serve_kernel(device, goes_on, service.stats.wake);
  service.stats.sent = device.arm().reports();
  service.stats.dropped = device.lost();
}

}  // namespace kerf
