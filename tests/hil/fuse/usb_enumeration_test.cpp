// SPDX-License-Identifier: Apache-2.0
// Devices without a name on the command line: found by libusb and hidapi over udev, /sys and /dev,
// distinguished by their serial numbers.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <span>
#include <stdexcept>
#include <string>
#include <thread>

#include <doctest/doctest.h>
#include <sched.h>
#include <sys/mount.h>

#include "controller/device/port/hid_port.hpp"
#include "controller/device/port/usb_port.hpp"
#include "shared/wire/falcon.hpp"
#include "shared/wire/woodenhaptics.hpp"
#include "tests/hil/fuse/bus_session.hpp"

namespace kerf::usb_enumeration_test {

using kerf::test::kGoOn;
using kerf::test::MountedArm;
using kerf::test::MountedFalcon;

namespace {

/// A /sys and a /dev of its own for one thread, with the files that libudev, libusb and hidapi
/// read, so that they enumerate nodes on FUSE as if the kernel had made them.
///
/// Needs the right to make a mount namespace: root, or a user namespace.
class PrivateSysfs {
 public:
  PrivateSysfs() {
    // libudev otherwise finds that this /sys is none.
    setenv("SYSTEMD_DEVICE_VERIFY_SYSFS", "0", 1);
    if (unshare(CLONE_NEWNS) != 0 ||
        mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0) {
      throw std::runtime_error("no private mount namespace");
    }
    for (const char* folder : {"/sys", "/dev"}) {
      if (mount("none", folder, "tmpfs", 0, nullptr) != 0) throw std::runtime_error(folder);
    }
    for (const char* folder : {"/sys/bus/usb/devices", "/sys/bus/hid/devices", "/sys/class/hidraw",
                               "/dev/bus/usb/001"}) {
      std::filesystem::create_directories(folder);
    }
  }

  /// The node at `path` as device `number` of bus 1.
  void add_usb(const std::string& path, int number, std::uint16_t vendor, std::uint16_t product,
               std::span<const std::uint8_t> descriptors) {
    const std::string name = "1-" + std::to_string(number);
    const std::string folder = "/sys/devices/usb1/" + name;
    const std::string node = text("bus/usb/001/%03d", number);
    std::filesystem::create_directories(folder);
    write(folder + "/uevent",
          "MAJOR=189\nMINOR=" + std::to_string(number - 1) + "\nDEVNAME=" + node +
              "\nDEVTYPE=usb_device\nPRODUCT=" + text("%x/", vendor) + text("%x/600\n", product));
    write(folder + "/busnum", "1\n");
    write(folder + "/devnum", std::to_string(number) + "\n");
    write(folder + "/speed", "12\n");
    write(folder + "/bConfigurationValue", "1\n");
    write(folder + "/descriptors", {descriptors.begin(), descriptors.end()});
    std::filesystem::create_directory_symlink("/sys/bus/usb", folder + "/subsystem");
    std::filesystem::create_directory_symlink(folder, "/sys/bus/usb/devices/" + name);
    bind(path, "/dev/" + node);
  }

  /// The node at `path` as /dev/hidraw`number`.
  void add_hid(const std::string& path, int number, std::uint16_t vendor, std::uint16_t product,
               const std::string& serial) {
    const std::string id =
        text("0003:%04X:", vendor) + text("%04X.", product) + text("%04X", number);
    const std::string hid = "/sys/devices/usb1/" + id;
    const std::string name = "hidraw" + std::to_string(number);
    const std::string folder = hid + "/hidraw/" + name;
    std::filesystem::create_directories(folder);
    write(hid + "/uevent", text("HID_ID=0003:%08X:", vendor) + text("%08X", product) +
                               "\nHID_NAME=kerf\nHID_PHYS=\nHID_UNIQ=" + serial + "\n");
    std::filesystem::create_directory_symlink("/sys/bus/hid", hid + "/subsystem");
    write(folder + "/uevent",
          "MAJOR=240\nMINOR=" + std::to_string(number) + "\nDEVNAME=" + name + "\n");
    std::filesystem::create_directory_symlink(hid, folder + "/device");
    std::filesystem::create_directory_symlink("/sys/class/hidraw", folder + "/subsystem");
    std::filesystem::create_directory_symlink(folder, "/sys/class/hidraw/" + name);
    bind(path, "/dev/" + name);
  }

 private:
  static std::string text(const char* format, int value) {
    char out[64];
    std::snprintf(out, sizeof out, format, value);
    return out;
  }
  static void write(const std::string& file, const std::string& contents) {
    std::ofstream(file, std::ios::binary) << contents;
  }
  static void bind(const std::string& path, const std::string& place) {
    write(place, "");
    if (mount(path.c_str(), place.c_str(), nullptr, MS_BIND, nullptr) != 0) {
      throw std::runtime_error(place + " cannot be bound");
    }
  }
};

/// Runs `work(sysfs)` on a thread that alone sees such a /sys; false if there is no right to it.
bool with_private_sysfs(const std::function<void(PrivateSysfs&)>& work) {
  bool ran = false;
  std::thread([&] {
    try {
      PrivateSysfs sysfs;
      ran = true;
      work(sysfs);
    } catch (const std::runtime_error& error) {
      std::printf("without a private /sys: %s\n", error.what());
    }
  }).join();
  return ran;
}

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

/// Runs `work`, whose errors fail the test, if there is the right to a private /sys.
template <class Work>
void in_private_sysfs(Work work) {
  const bool ran = with_private_sysfs([&](PrivateSysfs& sysfs) {
    try {
      work(sysfs);
    } catch (const std::runtime_error& error) {
      FAIL_CHECK(error.what());
    }
  });
  if (!ran) MESSAGE("skipped: no right to a private /sys");
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

TEST_CASE("enumeration: WoodenHaptics of either firmware, distinguished in the same way") {
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

}  // namespace kerf::usb_enumeration_test
