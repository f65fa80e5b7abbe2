// SPDX-License-Identifier: Apache-2.0
// Devices that nobody names: found by libusb and hidapi over udev, /sys and /dev, told apart by
// their serial numbers.
#include <stdexcept>
#include <string>

#include <doctest/doctest.h>

#include "controller/device/port/hid_port.hpp"
#include "controller/device/port/usb_port.hpp"
#include "shared/wire/falcon.hpp"
#include "shared/wire/woodenhaptics.hpp"
#include "tests/hil/fuse/bus_session.hpp"
#include "tests/hil/fuse/private_sysfs.hpp"

using kerf::HidPort;
using kerf::UsbPort;
using kerf::test::kGoOn;
using kerf::test::MountedArm;
using kerf::test::MountedFalcon;
using kerf::test::PrivateSysfs;

namespace {

void add(PrivateSysfs& sysfs, const MountedFalcon& falcon, int number) {
  sysfs.add_usb(falcon.path(), number, kerf::falcon::kVendorId, kerf::falcon::kProductId,
                kerf::FtdiFalcon::descriptors());
}
void add(PrivateSysfs& sysfs, const MountedArm& arm, int number, const std::string& serial) {
  sysfs.add_hid(arm.path(), number, arm.node().arm().vendor_id(), arm.node().arm().product_id(),
                serial);
}

bool answers(UsbPort& port) {
  port.send(encode(kerf::FalconCommand{}));
  return port.wait(500);
}
bool answers(HidPort& port) {
  port.send(encode(kerf::WoodenCommand{}));
  return port.wait(500);
}

/// Runs `work`, whose errors fail the test, where there is the right to a private /sys.
template <class Work>
void in_private_sysfs(Work work) {
  const bool ran = kerf::test::with_private_sysfs([&](PrivateSysfs& sysfs) {
    try {
      work(sysfs);
    } catch (const std::runtime_error& error) {
      FAIL_CHECK(error.what());
    }
  });
  WARN(ran);  // says in the log where it was skipped
}

}  // namespace

TEST_CASE("enumeration: the only Falcon needs no name; of two one is named by node or serial") {
  const MountedFalcon left({.firmware_runs = true, .serial = "LEFT"});
  const MountedFalcon right({.firmware_runs = true, .serial = "RIGHT"});
  in_private_sysfs([&](PrivateSysfs& sysfs) {
    CHECK_THROWS_WITH_AS(UsbPort({"", ""}, 0, kGoOn), doctest::Contains("no Falcon (0403:cb48)"),
                         std::runtime_error);
    add(sysfs, left, 2);
    {
      UsbPort port({"", ""}, 0, kGoOn);
      CHECK(answers(port));
    }
    add(sysfs, right, 3);
    CHECK_THROWS_WITH_AS(
        UsbPort({"", ""}, 0, kGoOn),
        doctest::Contains("several Falcons are there: /dev/bus/usb/001/002 (LEFT) "
                          "/dev/bus/usb/001/003 (RIGHT); name one by its node or serial"),
        std::runtime_error);
    UsbPort by_serial({"RIGHT", ""}, 0, kGoOn);
    CHECK(answers(by_serial));
    UsbPort by_node({"/dev/bus/usb/001/002", ""}, 0, kGoOn);
    CHECK(answers(by_node));
    CHECK_THROWS_WITH_AS(UsbPort({"MIDDLE", ""}, 0, kGoOn), doctest::Contains("no Falcon"),
                         std::runtime_error);
  });
}

TEST_CASE("enumeration: WoodenHaptics of either firmware, told apart in the same way") {
  const MountedArm mbed({.packet_bytes = 14, .serial = "A"});
  const MountedArm teensy({.packet_bytes = 64, .serial = "B"});
  in_private_sysfs([&](PrivateSysfs& sysfs) {
    CHECK_THROWS_WITH_AS(HidPort("", 0, kGoOn), doctest::Contains("no WoodenHaptics arm"),
                         std::runtime_error);
    add(sysfs, mbed, 0, "A");
    {
      HidPort port("", 0, kGoOn);
      CHECK(answers(port));
    }
    add(sysfs, teensy, 1, "B");
    CHECK_THROWS_WITH_AS(HidPort("", 0, kGoOn), doctest::Contains("several arms are there:"),
                         std::runtime_error);
    HidPort by_serial("B", 0, kGoOn);
    CHECK(answers(by_serial));
    HidPort by_node("/dev/hidraw0", 0, kGoOn);
    CHECK(answers(by_node));
  });
}
