// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "controller/device/driver/device_driver.hpp"
#include "controller/device/port/open_port.hpp"
#include "hil/devmodel/falcon_model.hpp"
#include "hil/devmodel/wooden_model.hpp"
#include "hil/front/serving.hpp"
#include "hil/front/usb/hidraw_node.hpp"
#include "hil/front/usb/usbfs_node.hpp"
#include "hil/script/hand_script_file.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "tests/hil/fuse/mounted_node.hpp"
#include "tests/servo/support.hpp"

namespace kerf::test {

/// How fresh reports are says something of ours only where threads run when they want to: with the
/// right to real time, and without sanitizers, which slow both ends down.
inline bool keeps_time() {
#ifdef KERF_SANITIZED
  return false;
#else
  static const bool does = [] {
    bool has_right = false;
    std::thread([&] { has_right = make_real_time(80, -1).empty(); }).join();
    return has_right;
  }();
  return does;
#endif
}

/// Whether reports came in time: to more than eight of ten ticks.
inline bool came_in_time(int fresh, int ticks) {
  return fresh > ticks * 8 / 10 || !keeps_time();
}

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

/// The emulated Falcon as a usbfs node.
class MountedFalcon {
 public:
  explicit MountedFalcon(const FtdiFalcon::Settings& settings = {.firmware_runs = true},
                         std::vector<ScriptedUsbFault> script = {},
                         const std::optional<HandScript>& hand = touching_hand())
      : emulator_(std::make_unique<FalconModel>(), hand),
        served_("usb", become_device, settings, at_ms(std::move(script)), emulator_) {}

  void stop() { served_.stop(); }
  [[nodiscard]] std::string path() const { return served_.path(); }
  [[nodiscard]] const UsbfsNode& node() const noexcept { return served_.node(); }
  [[nodiscard]] const Emulator& emulator() const noexcept { return emulator_; }

 private:
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
        served_("hidraw0", become_device, with_cycles(std::move(settings)), emulator_) {}

  void stop() { served_.stop(); }
  [[nodiscard]] std::string path() const { return served_.path(); }
  [[nodiscard]] const HidrawNode& node() const noexcept { return served_.node(); }
  [[nodiscard]] const Emulator& emulator() const noexcept { return emulator_; }

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

/// A driver above its real library, and a servo above the driver, at 1 kHz by the machine's clock.
class ServoSession {
 public:
  ServoSession(ReadyServo ready, PacketPort& port)
      : ready_(std::move(ready)),
        driver_(
            make_driver(ready_.scene.device.personality, port, ready_.scene.device.encoder_sign)) {
    driver_->start();
  }

  struct Course {
    int ticks = 0, fresh = 0, contact = 0, motors = 0;
    int faults = 0;                       ///< ticks with one
    int longest_gap = 0;                  ///< ticks without a report
    std::int64_t longest_silence_ms = 0;  ///< the same by the clock, which goes on between ticks
    int stale_with_motors = 0;  ///< ticks beyond 20 without a report and motors still asked for
    int gap_at_end = 0;
  };
  /// Until so many ticks have passed, or `done` says so. On a thread with the servo's priority.
  template <class Done>
  Course run(int most_ticks, Done done) {
    Course course;
    std::thread([&] {
      static_cast<void>(make_real_time(80, -1));
      tick(most_ticks, done, course);
    }).join();
    return course;
  }
  Course run(int ticks) {
    return run(ticks, [](const Course&) { return false; });
  }

  struct Tick {
    DeviceReport report;
    ServoOutput output;
  };
  /// One tick, now.
  Tick step() {
    const DeviceReport report = driver_->read();
    const ServoOutput output = ready_.servo->step(report);
    driver_->command(output);
    return {report, output};
  }
  /// Who is told of each tick's output in `run`, on its thread.
  void watch(std::function<void(const ServoOutput&)> watch) { watch_ = std::move(watch); }

  [[nodiscard]] DeviceDriver& driver() noexcept { return *driver_; }

 private:
  template <class Done>
  void tick(int most_ticks, Done& done, Course& course) {
    int gap = 0;
    std::int64_t deadline_ns = monotonic_ns();
    std::int64_t heard_ns = deadline_ns;
    while (course.ticks < most_ticks && !done(course)) {
      deadline_ns = std::max(deadline_ns + 1'000'000, monotonic_ns());
      sleep_until_ns(deadline_ns);
      const auto [report, output] = step();
      if (watch_) watch_(output);
      ++course.ticks;
      gap = report.fresh ? 0 : gap + 1;
      course.fresh += report.fresh ? 1 : 0;
      course.contact += output.contact ? 1 : 0;
      course.motors += output.motors_on ? 1 : 0;
      course.faults += output.fault != Fault::none ? 1 : 0;
      course.longest_gap = std::max(course.longest_gap, gap);
      const std::int64_t now_ns = monotonic_ns();
      course.longest_silence_ms =
          std::max(course.longest_silence_ms, (now_ns - heard_ns) / 1'000'000);
      if (report.fresh) heard_ns = now_ns;
      if (gap > 20 && output.motors_on) ++course.stale_with_motors;
      course.gap_at_end = gap;
    }
  }

  ReadyServo ready_;
  std::unique_ptr<DeviceDriver> driver_;
  std::function<void(const ServoOutput&)> watch_;
};

}  // namespace kerf::test
