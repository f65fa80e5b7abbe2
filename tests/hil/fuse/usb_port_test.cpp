// SPDX-License-Identifier: Apache-2.0
// The Falcon's driver with libusb itself above the emulated node: boot, homing, force, faults.
#include "controller/device/port/usb_port.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <thread>
#include <utility>

#include <doctest/doctest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "controller/loop/allocation_counter.hpp"
#include "controller/loop/motor_guard.hpp"
#include "shared/wire/falcon.hpp"
#include "tests/hil/fuse/usb_session.hpp"

using kerf::Personality;
using kerf::UsbFault;
using kerf::UsbPort;
using kerf::test::kGoOn;
using kerf::test::MountedFalcon;
using kerf::test::ReadyServo;
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

/// Answers each command in the next frame, and notes how many ticks ago it was made.
class CountingDevice final : public kerf::PacketDevice {
 public:
  void receive(std::span<const std::uint8_t> packet) noexcept override {
    const auto command = kerf::falcon::decode_command(packet);
    if (!command) return;
    ++owed_;
    const int tick = command->motor[0];
    if (tick == 0) return;  // of the start
    oldest = std::max(oldest, newest - tick);
    longest_gap = std::max(longest_gap, tick - last_);
    last_ = tick;
  }
  void advance(int cycles) noexcept override { cycle_ += cycles; }
  std::span<const std::uint8_t> next_packet() noexcept override {
    if (cycle_ % kerf::kCyclesPerUsbFrame != 0 || owed_ == 0) return {};
    --owed_;
    return answer_;
  }

  std::atomic<int> newest{0};  ///< tick of the host
  int oldest = 0, longest_gap = 0;

 private:
  std::int64_t cycle_ = 0;
  int owed_ = 0, last_ = 0;
  kerf::falcon::PacketBytes answer_ = encode(kerf::FalconReport{});
};

/// Notes what its motors were last told.
class PushedDevice final : public kerf::PacketDevice {
 public:
  void receive(std::span<const std::uint8_t> packet) noexcept override {
    const auto command = kerf::falcon::decode_command(packet);
    if (!command) return;
    torque = command->motor[0];
    pushes += torque == 0 ? 0 : 1;
    ++owed_;
  }
  void advance(int /*cycles*/) noexcept override {}
  std::span<const std::uint8_t> next_packet() noexcept override {
    if (owed_ == 0) return {};
    --owed_;
    return answer_;
  }

  std::atomic<int> torque{0}, pushes{0};

 private:
  int owed_ = 0;
  kerf::falcon::PacketBytes answer_ = encode(kerf::FalconReport{});
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
    ReadyServo servo(Personality::falcon);
    UsbPort port({falcon.path(), firmware.path()}, 0, kGoOn);
    ServoSession session(std::move(servo), port, falcon.clock());
    const auto course = session.run(8000, [](const auto& c) { return c.contact > 300; });
    CHECK(course.contact > 300);
    CHECK(course.motors > 300);
    CHECK(course.fresh > course.ticks * 8 / 10);
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
  PushedDevice device;
  kerf::test::ServedNode<kerf::UsbfsNode> falcon("usb", kerf::test::become_device,
                                                 kerf::FtdiFalcon::Settings{.firmware_runs = true},
                                                 std::vector<kerf::ScriptedUsbFault>{}, device);
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
  // What was written is the device's, which outlives the program.
  CHECK(device.pushes > 0);
  CHECK(device.torque == 0);
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

TEST_CASE("usb: packets in pieces are put together, none is bad, none is lost") {
  std::atomic<bool> streams{false};
  MountedFalcon falcon({.firmware_runs = true},
                       {{0, UsbFault::split, &streams}, {600, UsbFault::split}});
  std::uint64_t packets = 0;
  {
    ReadyServo servo(Personality::falcon);
    UsbPort port({falcon.path(), ""}, 0, kGoOn);
    {
      ServoSession session(std::move(servo), port, falcon.clock());
      const auto course = session.run(1000, [&](const auto& c) {
        streams = c.fresh > 50;
        return false;
      });
      CHECK(course.fresh > 600);
      CHECK(course.longest_gap < 200);
      CHECK(session.driver().refused() == 0);
      CHECK(port.stats().strays == 0);
    }
    // What is in the line still comes: 256 bytes at most, 9 in a frame.
    for (int tries = 0; tries < 1000 && port.stats().packets < port.stats().commands; ++tries) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    packets = port.stats().packets;
  }
  falcon.stop();
  // The first ones, one as a rule, answered the question whether the firmware runs.
  CHECK(falcon.node().chip().reports() - packets <= 2);
}

TEST_CASE("usb: the device answers in each of its frames, wherever the servo ticks in them") {
  MountedFalcon falcon({.firmware_runs = true}, {}, std::nullopt);
  ReadyServo servo(Personality::falcon);
  UsbPort port({falcon.path(), ""}, 0, kGoOn);
  ServoSession session(std::move(servo), port, falcon.clock());
  static_cast<void>(session.run(10));
  for (int phase = 0; phase < 10; ++phase) {
    CAPTURE(phase);
    constexpr int kTicks = 100;
    falcon.clock().pass(100'000);
    CHECK(session.run(kTicks).fresh > kTicks * 8 / 10);
  }
}

TEST_CASE("usb: a device that took nothing for a while gets the newest command, no older one") {
  CountingDevice device;
  std::atomic<bool> streams{false};
  kerf::test::HeldClock clock;
  kerf::test::ServedNode<kerf::UsbfsNode> served(
      "usb", kerf::test::become_device,
      kerf::FtdiFalcon::Settings{.firmware_runs = true, .clock = &clock},
      kerf::test::at_ms({{0, UsbFault::deaf, &streams}}), device);
  {
    UsbPort port({served.path(), ""}, 0, kGoOn);
    clock.hold();
    for (std::int16_t tick = 1; tick <= 300; ++tick) {
      device.newest = tick;
      const std::uint64_t sent = kerf::test::commands_sent(port);
      port.send(encode(kerf::FalconCommand{.motor = {tick, 0, 0}}));
      streams = tick >= 100;
      kerf::test::wait_for_command(port, sent, 10);
      clock.pass(1'000'000);
    }
  }
  served.stop();
  CHECK(device.longest_gap > 90);  // ticks in which it heard nothing
  CHECK(device.oldest < device.longest_gap / 2);
}

TEST_CASE("usb: a stalled endpoint is freed when no read waits there, and the stream goes on") {
  std::atomic<bool> once{false}, twice{false};
  MountedFalcon falcon({.firmware_runs = true},
                       {{0, UsbFault::stall, &once}, {0, UsbFault::stall, &twice}});
  {
    ReadyServo servo(Personality::falcon);
    UsbPort port({falcon.path(), ""}, 0, kGoOn);
    ServoSession session(std::move(servo), port, falcon.clock());
    const auto course = session.run(1000, [&](const auto& c) {
      once = c.fresh > 100;
      twice = c.fresh > 300;
      return false;
    });
    CHECK(port.stats().failures >= 2);
    CHECK(course.longest_gap < 200);
    CHECK(course.gap_at_end < 100);
    CHECK(session.driver().refused() == 0);
    CHECK_FALSE(port.closed());
  }
  falcon.stop();
  CHECK(falcon.node().rash_clears() == 0);
}

TEST_CASE("usb: an unplugged Falcon closes the port, and the motors are not asked for any more") {
  std::atomic<bool> pushes{false};
  MountedFalcon falcon({.firmware_runs = true}, {{0, UsbFault::vanish, &pushes}});
  ReadyServo servo(Personality::falcon);
  UsbPort port({falcon.path(), ""}, 0, kGoOn);
  ServoSession session(std::move(servo), port, falcon.clock());
  const auto course = session.run(8000, [&](const auto& c) {
    pushes = c.motors > 100;
    return port.closed();
  });
  CHECK(port.closed());
  CHECK(course.motors > 100);
  const auto after = session.run(100);
  CHECK(after.gap_at_end >= 99);  // what came before the end may still be read
  CHECK(after.stale_with_motors == 0);
  CHECK_FALSE(session.driver().release());
  CHECK(error_of({falcon.path(), ""}).find("no such node; --port usb finds") != std::string::npos);
}

TEST_CASE("usb: two sessions, one after the other, on one node") {
  const MountedFalcon falcon;
  for (int i = 0; i < 3; ++i) {
    UsbPort port({falcon.path(), ""}, 0, kGoOn);
    port.send(encode(kerf::FalconCommand{}));
    CHECK(port.wait(200));
  }
}
