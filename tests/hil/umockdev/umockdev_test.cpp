// SPDX-License-Identifier: Apache-2.0
// libusb above the emulated node without FUSE: umockdev's /sys and /dev, for machines on which
// nothing can be mounted. No figure is asked of it: each call costs a turn of its thread.
#include <cstdio>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <utility>

#define DOCTEST_CONFIG_IMPLEMENT
#include <doctest/doctest.h>

#include "controller/device/port/usb_port.hpp"
#include "tests/hil/fuse/usb_session.hpp"
#include "tests/hil/umockdev/umockdev_node.hpp"

namespace {

using kerf::Personality;
using kerf::test::kGoOn;
using kerf::test::ReadyServo;
using kerf::test::ServoSession;
using kerf::test::UmockdevNode;

/// A /sys and a /dev of this process.
class Bed {
 public:
  explicit Bed(const std::string& devices) : bed_(umockdev_testbed_new()) {
    GError* error = nullptr;
    if (!umockdev_testbed_add_from_string(bed_, devices.c_str(), &error)) {
      FAIL(error->message);
    }
  }
  ~Bed() { g_object_unref(bed_); }
  Bed(const Bed&) = delete;
  Bed& operator=(const Bed&) = delete;
  [[nodiscard]] UMockdevTestbed* get() const noexcept { return bed_; }

 private:
  UMockdevTestbed* bed_;
};

std::string hex(std::span<const std::uint8_t> bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) {
    char digits[3];
    std::snprintf(digits, sizeof digits, "%02X", byte);
    text += digits;
  }
  return text;
}

std::string falcon_on_usb() {
  return "P: /devices/usb1/1-2\n"
         "N: bus/usb/001/002\n"
         "E: SUBSYSTEM=usb\nE: DEVTYPE=usb_device\nE: BUSNUM=001\nE: DEVNUM=002\n"
         "E: MAJOR=189\nE: MINOR=1\nE: DEVNAME=/dev/bus/usb/001/002\n"
         "A: busnum=1\\n\nA: devnum=2\\n\nA: speed=12\\n\nA: bConfigurationValue=1\\n\n"
         "H: descriptors=" +
         hex(kerf::FtdiFalcon::descriptors()) + "\n";
}

}  // namespace

TEST_CASE("umockdev: libusb finds the Falcon and brings it from homing to a force") {
  kerf::Emulator emulator(std::make_unique<kerf::FalconModel>(), kerf::test::touching_hand());
  kerf::test::HeldClock clock;
  kerf::UsbfsNode node({.firmware_runs = true, .clock = &clock}, {}, emulator);
  {
    const Bed bed(falcon_on_usb());
    const UmockdevNode served(bed.get(), "/dev/bus/usb/001/002", node);
    ReadyServo servo(Personality::falcon);
    kerf::UsbPort port({"", ""}, 0, kGoOn);
    ServoSession session(std::move(servo), port, clock);
    const auto course = session.run(8000, [](const auto& c) { return c.contact > 100; });
    CHECK(course.contact > 100);
    CHECK(course.motors > 100);
    CHECK(session.driver().refused() == 0);
    CHECK(port.stats().strays == 0);
    CHECK(port.stats().failures == 0);
    CHECK(session.driver().release());
  }
  CHECK(emulator.model().calibration() == kerf::Calibration::done);
  CHECK(emulator.stats().peak_motor_force_n > 0.01);
  CHECK(emulator.stats().refused == 0);
}

/// Skips with its reason, exit code 77, where the calls cannot be caught.
int main(int argc, char** argv) {
  const bool is_caught = [] {
    const Bed bed(falcon_on_usb());
    return std::filesystem::exists("/sys/devices/usb1/1-2/descriptors");
  }();
  if (!is_caught) {
    std::puts("skipped: libumockdev-preload is not loaded; start under umockdev-wrapper");
    return 77;
  }
  doctest::Context context(argc, argv);
  return context.run();
}
