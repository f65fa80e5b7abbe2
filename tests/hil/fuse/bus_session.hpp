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

#include "controller/device/device_driver.hpp"
#include "controller/device/firewire/firewire_port.hpp"
#include "controller/device/open_port.hpp"
#include "controller/device/port/io_mailbox.hpp"
#include "controller/loop/allocation_counter.hpp"
#include "tests/hil/fuse/mounted_node.hpp"
#include "tests/servo/support.hpp"

namespace kerf::test {

/// Something firm to press on.
inline LoadedScene firm_half_space() {
  LoadedScene scene = half_space_scene();
  scene.force.stiffness_n_per_mm = 0.7;
  return scene;
}

/// A servo that touches a half-space, compiled before the port of its device opens: a hand waits
/// 2 s for a host that does not calibrate, and a busy machine may need that long to compile.
struct ReadyServo {
  explicit ReadyServo(Personality device, LoadedScene of = half_space_scene())
      : scene(std::move(of)) {
    scene.device.personality = device;
    if (device != Personality::omni) scene.device.torque_scale = std::array{0.3, 0.3, 0.3};
    servo = compile(scene);
  }
  LoadedScene scene;
  std::unique_ptr<AnyServo> servo;
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

/// Ticks of a session, counted.
struct Course {
  int ticks = 0, fresh = 0, contact = 0, motors = 0;
  int faults = 0;             ///< ticks with one
  int longest_gap = 0;        ///< ticks without a report
  int stale_with_motors = 0;  ///< ticks beyond 20 without a report and motors still commanded
  int gap_at_end = 0;
  std::uint64_t allocations = 0;  ///< by reads
};

/// A driver above its real port, and a servo above the driver, at 1 kHz by the clock of the device,
/// which waits for the servo from here to the end; without a clock the bus is in lock-step.
class ServoSession {
 public:
  ServoSession(ReadyServo ready, PacketPort& port, HeldClock* clock)
      : ready_(std::move(ready)),
        port_(port),
        clock_(clock),
        driver_(
            make_driver(ready_.scene.device.personality, port, ready_.scene.device.encoder_sign)) {
    if (clock_) clock_->hold();
    driver_->start();
  }
  ~ServoSession() {
    if (clock_) clock_->let_go();
  }
  ServoSession(const ServoSession&) = delete;
  ServoSession& operator=(const ServoSession&) = delete;

  /// Until so many ticks have passed, or `done` returns true.
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
    std::uint64_t allocations = 0;
  };
  /// A millisecond of the device, then a tick of the servo.
  Tick tick() {
    if (!clock_) return step();
    clock_->pass(kNsPerSecond / 1000);
    static_cast<void>(port_.wait(kLongestWayMs));
    const std::uint64_t sent = commands_sent(port_);
    const Tick tick = step();
    wait_for_command(port_, sent, kLongestWayMs);
    return tick;
  }
  /// Gets each tick's output in `run`.
  void watch(std::function<void(const ServoOutput&)> watch) { watch_ = std::move(watch); }

  [[nodiscard]] DeviceDriver& driver() noexcept { return *driver_; }

 private:
  /// Of the machine's time, for a packet between device and servo by other threads; one that takes
  /// longer comes in the next tick. Less than a port waits for an answer before it sends again.
  static constexpr int kLongestWayMs = 3;
  static_assert(kLongestWayMs * std::int64_t{1'000'000} < Turns::kPatienceNs);

  Tick step() {
    Tick tick;
    {
      const std::uint64_t before = CountedAllocations::total();
      const CountedAllocations counted;
      tick.report = driver_->read();
      tick.allocations = CountedAllocations::total() - before;
    }
    tick.output = ready_.servo->step(tick.report);
    driver_->command(tick.output);
    return tick;
  }

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
    course.allocations += tick.allocations;
  }

  ReadyServo ready_;
  PacketPort& port_;
  HeldClock* clock_;
  std::unique_ptr<DeviceDriver> driver_;
  std::function<void(const ServoOutput&)> watch_;
};

/// The same of an Omni with a hand, in lock-step unless the settings have another clock.
class FirewireSession {
 public:
  explicit FirewireSession(const FirewireSettings& settings = {}, FirewireOptions options = {})
      : mounted_(settings, {}, touching_hand()) {
    ReadyServo servo(Personality::omni);
    options.where = mounted_.path();
    port_ = std::make_unique<FirewirePort>(options, 1000, kGoOn);
    session_.emplace(std::move(servo), *port_, nullptr);
  }
  ~FirewireSession() { end(); }

  ServoSession* operator->() noexcept { return &*session_; }
  /// Ends the driver, then the node, whose counts may be read from then on.
  void end() {
    session_.reset();
    port_.reset();
    mounted_.stop();
  }

  [[nodiscard]] FirewirePort& port() noexcept { return *port_; }
  [[nodiscard]] DeviceDriver& driver() noexcept { return session_->driver(); }
  [[nodiscard]] const MountedNode& mounted() const noexcept { return mounted_; }

 private:
  MountedNode mounted_;
  std::unique_ptr<FirewirePort> port_;
  std::optional<ServoSession> session_;
};

}  // namespace kerf::test
