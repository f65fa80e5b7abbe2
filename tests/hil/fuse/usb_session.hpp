// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "controller/device/device_driver.hpp"
#include "controller/device/open_port.hpp"
#include "controller/device/port/io_mailbox.hpp"
#include "hil/device/falcon.hpp"
#include "hil/device/wooden.hpp"
#include "hil/front/serving.hpp"
#include "hil/front/usb/hidraw_node.hpp"
#include "hil/front/usb/usbfs_node.hpp"
#include "hil/script/hand_script_file.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "tests/hil/fuse/held_clock.hpp"
#include "tests/hil/fuse/mounted_node.hpp"
#include "tests/servo/support.hpp"

namespace kerf::test {

inline const std::atomic<bool> kGoOn{false};

/// Faults at these milliseconds since the node was made.
inline std::vector<ScriptedUsbFault> at_ms(std::vector<ScriptedUsbFault> script) {
  for (ScriptedUsbFault& entry : script) entry.cycle *= kCyclesPerUsbFrame;
  return script;
}

/// The server's thread, where there is the right to it: before the servo, on its core.
inline void become_device() {
  static_cast<void>(make_real_time(82, -1));
}

inline std::optional<HandScript> touching_hand() {
  return read_hand_script(KERF_HANDS "/touch.toml");
}

/// A hand that comes down, and then presses on.
inline std::optional<HandScript> pressing_hand() {
  HandScript script;
  script.start = {0, 4, 0};
  script.steps = {hand_move({0, -1, 0}, 0.4), hand_move({0, -1, 0}, 10)};
  return script;
}
/// Something firm to press on.
inline LoadedScene firm_half_space() {
  LoadedScene scene = half_space_scene();
  scene.force.stiffness_n_per_mm = 0.7;
  return scene;
}

/// The settings of a device that goes by `clock`.
template <class Settings>
Settings by(const HeldClock& clock, Settings settings) {
  settings.clock = &clock;
  return settings;
}

/// The emulated Falcon as a usbfs node.
class MountedFalcon {
 public:
  explicit MountedFalcon(const FtdiFalcon::Settings& settings = {.firmware_runs = true},
                         std::vector<ScriptedUsbFault> script = {},
                         const std::optional<HandScript>& hand = touching_hand())
      : emulator_(std::make_unique<FalconModel>(), hand),
        served_("usb", become_device, by(clock_, settings), at_ms(std::move(script)), emulator_) {}

  void stop() { served_.stop(); }
  [[nodiscard]] std::string path() const { return served_.path(); }
  [[nodiscard]] const UsbfsNode& node() const noexcept { return served_.node(); }
  [[nodiscard]] const Emulator& emulator() const noexcept { return emulator_; }
  [[nodiscard]] HeldClock& clock() noexcept { return clock_; }

 private:
  HeldClock clock_;
  Emulator emulator_;
  ServedNode<UsbfsNode> served_;
};

/// The emulated WoodenHaptics arm as a hidraw node.
class MountedArm {
 public:
  explicit MountedArm(WoodenHid::Settings settings = {},
                      const std::optional<HandScript>& hand = touching_hand(),
                      std::array<int, 3> encoder_sign = {1, 1, 1})
      : emulator_(std::make_unique<WoodenModel>(params_of(settings, encoder_sign)), hand),
        served_("hidraw0", become_device, by(clock_, with_cycles(std::move(settings))), emulator_) {
  }

  void stop() { served_.stop(); }
  [[nodiscard]] std::string path() const { return served_.path(); }
  [[nodiscard]] const HidrawNode& node() const noexcept { return served_.node(); }
  [[nodiscard]] const Emulator& emulator() const noexcept { return emulator_; }
  [[nodiscard]] HeldClock& clock() noexcept { return clock_; }

 private:
  static WoodenParams params_of(const WoodenHid::Settings& settings,
                                std::array<int, 3> encoder_sign) {
    WoodenParams params;
    params.encoder_sign = encoder_sign;
    params.packet_bytes = settings.packet_bytes;
    return params;
  }
  static WoodenHid::Settings with_cycles(WoodenHid::Settings settings) {
    settings.script = at_ms(std::move(settings.script));
    return settings;
  }

  HeldClock clock_;
  Emulator emulator_;
  ServedNode<HidrawNode> served_;
};

/// A servo that touches a half-space, compiled before the port of its device opens: a hand waits 2
/// s for a host that does not calibrate, and a busy machine may need that long for a sanitized
/// compilation.
struct ReadyServo {
  explicit ReadyServo(Personality device, LoadedScene of = half_space_scene())
      : scene(std::move(of)) {
    scene.device.personality = device;
    scene.device.torque_scale = std::array{0.3, 0.3, 0.3};
    servo = compile(scene);
  }
  LoadedScene scene;
  std::unique_ptr<Servo> servo;
};

/// Packets that have left by the port's thread.
inline std::uint64_t commands_sent(const PacketPort& port) {
  for (const LinkCounter& counter : port.counters()) {
    if (counter.name == std::string_view("commands")) return counter.value;
  }
  return 0;
}
/// Until one more than `sent` has left, or so long of the machine's time has passed.
inline void wait_for_command(const PacketPort& port, std::uint64_t sent, int most_ms) {
  const std::int64_t until_ns = monotonic_ns() + most_ms * std::int64_t{1'000'000};
  while (!port.closed() && commands_sent(port) == sent && monotonic_ns() < until_ns) {
    sleep_until_ns(monotonic_ns() + 20'000);
  }
}

/// A driver above its real library, and a servo above the driver, at 1 kHz by the clock of the
/// device, which waits for the servo from here to the end.
class ServoSession {
 public:
  ServoSession(ReadyServo ready, PacketPort& port, HeldClock& clock)
      : ready_(std::move(ready)),
        port_(port),
        clock_(clock),
        driver_(
            make_driver(ready_.scene.device.personality, port, ready_.scene.device.encoder_sign)) {
    clock_.hold();
    driver_->start();
  }
  ~ServoSession() { clock_.let_go(); }
  ServoSession(const ServoSession&) = delete;
  ServoSession& operator=(const ServoSession&) = delete;

  struct Course {
    int ticks = 0, fresh = 0, contact = 0, motors = 0;
    int faults = 0;             ///< ticks with one
    int longest_gap = 0;        ///< ticks without a report
    int stale_with_motors = 0;  ///< ticks beyond 20 without a report and motors still asked for
    int gap_at_end = 0;
  };
  /// Until so many ticks have passed, or `done` says so.
  template <class Done>
  Course run(int most_ticks, Done done) {
    Course course;
    while (course.ticks < most_ticks && !done(course)) note(tick(), course);
    return course;
  }
  Course run(int ticks) {
    return run(ticks, [](const Course&) { return false; });
  }

  struct Tick {
    DeviceReport report;
    ServoOutput output;
  };
  /// What a servo does in a tick, now.
  Tick step() {
    const DeviceReport report = driver_->read();
    const ServoOutput output = ready_.servo->step(report);
    driver_->command(output);
    return {report, output};
  }
  /// A millisecond of the device, then a step.
  Tick tick() {
    clock_.pass(kNsPerSecond / 1000);
    static_cast<void>(port_.wait(kLongestWayMs));
    const std::uint64_t sent = commands_sent(port_);
    const Tick tick = step();
    wait_for_command(port_, sent, kLongestWayMs);
    return tick;
  }
  /// Who is told of each tick's output in `run`.
  void watch(std::function<void(const ServoOutput&)> watch) { watch_ = std::move(watch); }

  [[nodiscard]] DeviceDriver& driver() noexcept { return *driver_; }

 private:
  /// Of the machine's time, for a packet between device and servo by other threads; one that takes
  /// longer comes in the next tick. Less than a port waits for an answer before it speaks again.
  static constexpr int kLongestWayMs = 3;
  static_assert(kLongestWayMs * std::int64_t{1'000'000} < Turns::kPatienceNs);

  void note(const Tick& tick, Course& course) {
    if (watch_) watch_(tick.output);
    ++course.ticks;
    course.gap_at_end = tick.report.fresh ? 0 : course.gap_at_end + 1;
    course.fresh += tick.report.fresh ? 1 : 0;
    course.contact += tick.output.contact ? 1 : 0;
    course.motors += tick.output.motors_on ? 1 : 0;
    course.faults += tick.output.fault != Fault::none ? 1 : 0;
    course.longest_gap = std::max(course.longest_gap, course.gap_at_end);
    course.stale_with_motors += course.gap_at_end > 20 && tick.output.motors_on ? 1 : 0;
  }

  ReadyServo ready_;
  PacketPort& port_;
  HeldClock& clock_;
  std::unique_ptr<DeviceDriver> driver_;
  std::function<void(const ServoOutput&)> watch_;
};

}  // namespace kerf::test
