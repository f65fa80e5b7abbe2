// SPDX-License-Identifier: Apache-2.0
// The Falcon's driver with libusb itself above the emulated node: boot, homing, force, faults.
#include "controller/device/usb_port.hpp"

#include <array>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include <doctest/doctest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "controller/shell/allocation_counter.hpp"
#include "controller/shell/motor_guard.hpp"
#include "shared/wire/falcon_packet.hpp"
#include "tests/hil/fuse/usb_session.hpp"

using kerf::Personality;
using kerf::UsbFault;
using kerf::UsbPort;
using kerf::test::kGoOn;
using kerf::test::MountedFalcon;
using kerf::test::ServoSession;

namespace {

/// A file that stands in for the firmware, which this project does not have.
class FirmwareFile {
 public:
  explicit FirmwareFile(std::size_t bytes) : path_(folder_.path() + "/firmware") {
    std::ofstream out(path_, std::ios::binary);
    for (std::size_t i = 0; i < bytes; ++i) out.put(static_cast<char>(i * 7));
  }
  ~FirmwareFile() { std::filesystem::remove(path_); }
  FirmwareFile(const FirmwareFile&) = delete;
  FirmwareFile& operator=(const FirmwareFile&) = delete;
  [[nodiscard]] const std::string& path() const noexcept { return path_; }

 private:
  kerf::test::TempFolder folder_;
  std::string path_;
};

std::string error_of(const kerf::UsbOptions& options) {
  try {
    const UsbPort port(options, 0, kGoOn);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("usb: from power-up over firmware and homing to a force") {
  MountedFalcon falcon({.firmware_runs = false});
  const FirmwareFile firmware(1000);
  {
    UsbPort port({falcon.path(), firmware.path()}, 0, kGoOn);
    ServoSession session(Personality::falcon, port);
    const auto course = session.run(8000, [](const auto& c) { return c.contact > 300; });
    CHECK(course.contact > 300);
    CHECK(course.motors > 300);
    // Taking turns, a tick that falls just before the answer gets it one tick later.
    if (kerf::test::kKeepsTime) CHECK(course.fresh > course.ticks * 4 / 10);
    CHECK(session.driver().refused() == 0);
    CHECK(session.driver().release());
    CHECK(port.stats().strays == 0);
    CHECK(port.stats().overflow == 0);
    CHECK(port.stats().failures == 0);
    CHECK_FALSE(port.closed());
  }
  falcon.stop();
  CHECK(falcon.node().chip().firmware_bytes() == 1000);
  CHECK(falcon.emulator().model().calibration() == kerf::Calibration::done);
  CHECK(falcon.emulator().stats().refused == 0);
  CHECK(falcon.emulator().stats().peak_motor_force_n > 0.01);
  CHECK_FALSE(falcon.emulator().model().motors_on());  // what was sent last came through
}

TEST_CASE("usb: the servo's side of the mailbox never allocates") {
  MountedFalcon falcon;
  UsbPort port({falcon.path(), ""}, 0, kGoOn);
  std::array<std::uint8_t, 65> packet{};
  const std::uint64_t before = kerf::CountedAllocations::total();
  int received = 0;
  {
    const kerf::CountedAllocations counted;
    for (int i = 0; i < 200; ++i) {
      port.send(encode(kerf::FalconCommand{}));
      if (port.wait(100)) received += port.receive(packet) == 16 ? 1 : 0;
    }
  }
  CHECK(kerf::CountedAllocations::total() == before);
  CHECK(received > 190);
}

TEST_CASE("usb: the last packet of a process has left when the call returns") {
  MountedFalcon falcon;
  UsbPort port({falcon.path(), ""}, 0, kGoOn);
  const std::uint64_t before = port.stats().commands;
  CHECK(port.send_last(encode(kerf::FalconCommand{})));
  CHECK(port.stats().commands == before + 1);
}

TEST_CASE("usb: a program that crashes while it pushes switches the motors off first") {
  MountedFalcon falcon({.firmware_runs = true}, {}, false);
  const pid_t child = fork();
  if (child == 0) {
    UsbPort port({falcon.path(), ""}, 0, kGoOn);
    const auto driver = kerf::make_driver(Personality::falcon, port);
    const kerf::MotorGuard guard(*driver);
    for (int i = 0; i < 20; ++i) {
      port.send(encode(kerf::FalconCommand{.motor = {2000, 2000, 2000}}));
      static_cast<void>(port.wait(20));
    }
    std::abort();
  }
  int status = 0;
  CHECK(waitpid(child, &status, 0) == child);
  CHECK(WIFSIGNALED(status));
  CHECK(WTERMSIG(status) == SIGABRT);
  // The device outlives the program: it reads what it was sent, one packet in a frame of 1 ms.
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  falcon.stop();
  CHECK(falcon.emulator().stats().peak_motor_force_n > 1);
  CHECK_FALSE(falcon.emulator().model().motors_on());
}

TEST_CASE("usb: what keeps a Falcon from starting is told in one line") {
  const FirmwareFile firmware(200);
  {
    const MountedFalcon falcon({.firmware_runs = false});
    CHECK(error_of({falcon.path(), ""}) ==
          "--port usb:" + falcon.path() +
              ": the Falcon has no firmware since it was powered up; name its file: "
              ",firmware=FILE");
  }
  {
    const MountedFalcon falcon({.firmware_runs = false, .wrong_echo_at = 100});
    CHECK(error_of({falcon.path(), firmware.path()})
              .find(": firmware: byte 100 was 188 and came "
                    "back as 189; ") != std::string::npos);
  }
  {
    const MountedFalcon falcon;
    const UsbPort first({falcon.path(), ""}, 0, kGoOn);
    CHECK(error_of({falcon.path(), ""})
              .find("cannot be claimed (Resource busy); end the program "
                    "that uses it") != std::string::npos);
  }
  const kerf::test::MountedArm other;
  CHECK(error_of({other.path(), ""}).find("is no USB device") != std::string::npos);
}

TEST_CASE("usb: packets in pieces are put together, none is bad") {
  MountedFalcon falcon({.firmware_runs = true}, {{200, UsbFault::split}, {600, UsbFault::split}});
  UsbPort port({falcon.path(), ""}, 0, kGoOn);
  ServoSession session(Personality::falcon, port);
  const auto course = session.run(1000);
  if (kerf::test::kKeepsTime)
    CHECK(course.fresh > course.ticks * 4 / 10);  // as above, of any phase
  CHECK(course.longest_gap < 200);
  CHECK(session.driver().refused() == 0);
  CHECK(port.stats().strays == 0);
}

TEST_CASE("usb: a stalled endpoint is freed and the stream goes on") {
  MountedFalcon falcon({.firmware_runs = true}, {{300, UsbFault::stall}, {500, UsbFault::stall}});
  UsbPort port({falcon.path(), ""}, 0, kGoOn);
  ServoSession session(Personality::falcon, port);
  const auto course = session.run(1000);
  CHECK(port.stats().failures >= 2);
  CHECK(course.longest_gap < 200);
  CHECK(course.gap_at_end < 100);
  CHECK(session.driver().refused() == 0);
  CHECK_FALSE(port.closed());
}

TEST_CASE("usb: an unplugged Falcon closes the port, and the motors are not asked for any more") {
  MountedFalcon falcon({.firmware_runs = true}, {{3500, UsbFault::vanish}});
  UsbPort port({falcon.path(), ""}, 0, kGoOn);
  ServoSession session(Personality::falcon, port);
  const auto course = session.run(8000, [&](const auto&) { return port.closed(); });
  CHECK(port.closed());
  CHECK(course.motors > 100);
  CHECK(course.ticks < 5000);
  const auto after = session.run(100);
  CHECK(after.fresh == 0);
  CHECK(after.stale_with_motors == 0);
  CHECK_FALSE(session.driver().release());
  CHECK(error_of({falcon.path(), ""}).find("no Falcon (0403:cb48) is there") != std::string::npos);
}

TEST_CASE("usb: two sessions, one after the other, on one node") {
  const MountedFalcon falcon;
  for (int i = 0; i < 3; ++i) {
    UsbPort port({falcon.path(), ""}, 0, kGoOn);
    port.send(encode(kerf::FalconCommand{}));
    CHECK(port.wait(200));
  }
}
