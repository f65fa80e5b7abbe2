// SPDX-License-Identifier: Apache-2.0
#include "lab/safety/fault_run.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>

#include "controller/device/device_driver.hpp"
#include "controller/device/port/packet_port.hpp"
#include "controller/loop/publisher.hpp"
#include "controller/loop/servo_loop.hpp"
#include "controller/loop/tick_source.hpp"
#include "hil/device/emulator.hpp"
#include "hil/device/packet_device.hpp"
#include "hil/script/faulty_device.hpp"
#include "lab/rig/virtual_loop.hpp"
#include "lab/safety/contract.hpp"
#ifdef KERF_LAB_HAS_SERVICE
#include "lab/safety/service_link.hpp"
#endif

namespace kerf::faults {
namespace {

/// The host's end of the wire: passes every packet on, and shows it to the contract, both ways.
/// `port`, `contract` and `time_ms` outlive it.
class WatchedPort final : public PacketPort {
 public:
  WatchedPort(PacketPort& port, SafetyMonitor& contract, const double& time_ms) noexcept
      : port_(port), contract_(contract), time_ms_(time_ms) {}

  std::size_t receive(std::span<std::uint8_t> out) noexcept override {
    contract_.listened(time_ms_);
    const std::size_t size = port_.receive(out);
    if (size > 0 && size <= out.size()) contract_.reported(time_ms_, out.first(size));
    if (port_.closed()) contract_.link_ended();
    return size;
  }
  bool send(std::span<const std::uint8_t> packet) noexcept override {
    contract_.commanded(time_ms_, packet);
    return port_.send(packet);
  }
  [[nodiscard]] bool closed() const noexcept override { return port_.closed(); }
  [[nodiscard]] bool wait(int milliseconds) noexcept override { return port_.wait(milliseconds); }

 private:
  PacketPort& port_;
  SafetyMonitor& contract_;
  const double& time_ms_;
};

/// The plant that the hand script asks for. Half of the seeds hold the torque when the host is
/// silent, half drop it: a device's behaviour is not known. WoodenHaptics lets go by itself.
std::unique_ptr<DeviceModel> model_of(const FaultCase& subject, std::uint32_t seed) {
  const DeviceSettings& device = subject.scene.device;
  return with_device_params(device.personality, [&](auto params) {
    take_plant(subject.hand.plant, params);
    if (!kind_of(device.personality).has_watchdog) {
      params.on_silence = seed % 2 == 0 ? OnSilence::hold_torque : OnSilence::drop_torque;
    }
    if constexpr (std::is_same_v<decltype(params), OmniParams>) params.dock_rad = device.dock_rad;
    if constexpr (std::is_same_v<decltype(params), CartesianParams>) {
      params.on_request = subject.by_service;
    }
    return make_model(params);
  });
}

/// What a fault does to the checks of the contract.
struct Effect {
  /// The motors' true force need not follow the commands under this script: a sensor shows another
  /// pose than the true one, or commands do not arrive.
  bool misleads = false;
  /// This fault is another one behind a service: a reply that is lost, or comes after 100 ms, ends
  /// the connection, and the device must be parked again; one more reply than messages is dropped;
  /// readings that stand still have an echo that is not the force that was sent. So the latch that
  /// a script demands of a plain link need not come, a second fault may meet no packet, and while a
  /// reply is out no message can take the force back.
  bool of_turns = false;
};

Effect effect_of(const DeviceFault& fault) {
  switch (fault.kind) {
    case FaultKind::stick:
    case FaultKind::jump:
    case FaultKind::wander:
    case FaultKind::still:
    case FaultKind::host_late:
      return {true, false};
    case FaultKind::corrupt:
    case FaultKind::unplug:
    case FaultKind::replay:
    case FaultKind::freeze:
      return {true, true};
    case FaultKind::lose:
    case FaultKind::delay:
    case FaultKind::duplicate:
    case FaultKind::reorder:
    case FaultKind::truncate:
      return {fault.of_commands, true};
    case FaultKind::silence:
    case FaultKind::hang_up:
    case FaultKind::unreadable:
    case FaultKind::closing:
    case FaultKind::half_close:
    case FaultKind::both_closed:
      return {false, true};
    case FaultKind::park:
    case FaultKind::chatter:
    case FaultKind::unhome:
    case FaultKind::noise:
      break;
  }
  return {};
}

/// The controller's loop with its guards; their clock is the emulator's.
class GuardedLoop {
 public:
  explicit GuardedLoop(VirtualLoop& loop) : loop_(loop), watchdog_(loop.driver(), signals_) {}

  /// From here on the motors are off, and the next tick is the last one.
  void ask_to_end() {
    is_asked_to_end_ = true;
    loop_.driver().stay_released();
  }
  [[nodiscard]] bool is_asked_to_end() const { return is_asked_to_end_; }
  [[nodiscard]] bool has_ended() const { return has_ended_; }

  /// The watchdog's look, if one is due at this bus cycle, counted from any.
  void look(std::uint64_t cycle, std::int64_t now_ns) {
    if (cycle % cycles_per_look_ == 0) watchdog_.look(now_ns);
  }

  /// The last tick, of which only a program's turn makes use.
  [[nodiscard]] const ServoOutput& last() const noexcept { return last_; }

  /// A tick that is due; a late host misses it.
  void tick(std::int64_t now_ns, bool host_is_late) {
    if (host_is_late) {
      ++missed_;
      return;
    }
    const DeviceReport report = loop_.driver().read();
    const bool stalled = stall_before(signals_, standstill_.stood_still(now_ns)) != nullptr;
    static_cast<void>(
        apply_commands({.fade_in = stalled, .missed = std::exchange(missed_, 0)}, loop_.servo()));
    last_ = loop_.servo().step(report);
    send_tick(std::span(&last_, 1), signals_, loop_.driver());
    ++signals_.heartbeat;
    if (!is_asked_to_end_) return;
    has_ended_ = true;
    loop_.driver().release_for_good();
  }

 private:
  VirtualLoop& loop_;
  std::atomic<bool> stop_{false};
  LoopSignals signals_{stop_};
  Watchdog watchdog_;
  StandstillWatch standstill_;
  std::uint64_t cycles_per_look_ =
      static_cast<std::uint64_t>(cycles_of(std::chrono::duration<double>(kWatchdogPeriod).count()));
  std::uint32_t missed_ = 0;  ///< ticks
  ServoOutput last_;
  bool is_asked_to_end_ = false, has_ended_ = false;
};

/// The device as the controller reaches it: by its own link, or behind its maker's service.
class ServedDevice {
 public:
  ServedDevice(FaultyDevice& device, bool by_service, std::uint32_t seed) : link_(&device) {
#ifdef KERF_LAB_HAS_SERVICE
    if (by_service) link_ = &service_.emplace(device, seed);
#else
    static_cast<void>(by_service);
    static_cast<void>(seed);
#endif
  }
  ServedDevice(const ServedDevice&) = delete;
  ServedDevice& operator=(const ServedDevice&) = delete;

  [[nodiscard]] PacketDevice& link() const noexcept {
    return *link_;
  }

  /// Reports failures of the service to the contract.
  void report(double time_ms, SafetyMonitor& contract) const {
#ifdef KERF_LAB_HAS_SERVICE
    if (service_ && service_->has_failed()) contract.service_fails(time_ms);
    if (service_ && service_->has_left_pushing()) contract.service_left_pushing(time_ms);
#else
    static_cast<void>(time_ms);
    static_cast<void>(contract);
#endif
  }

 private:
  PacketDevice* link_;
#ifdef KERF_LAB_HAS_SERVICE
  std::optional<ServiceLink> service_;
#endif
};

double end_of(const FaultScript& script) {
  double end_s = 0;
  for (const DeviceFault& fault : script.faults) {
    end_s = std::max(end_s, fault.at_s + fault.for_s + fault.ms / 1000);
  }
  return end_s;
}

/// By how much the faults of a seed are later in the hand's motion, below 100 ms.
double later_ms(const FaultScript& script) {
  constexpr std::uint32_t kPrime = 7919, kMs = 100;
  return script.seed * kPrime % kMs;
}

/// The same faults at another moment of the hand's motion.
FaultScript shifted(FaultScript script) {
  for (DeviceFault& fault : script.faults) fault.at_s += later_ms(script) / 1000;
  return script;
}

/// One line if the run shows nothing: no contact, or a fault that never was. A Falcon reports only
/// what it is asked for, so that after a signal to end nothing may be left to change: then a fault
/// that has begun before is enough.
std::string inconclusive_line(const FaultScript& script, const FaultCase& subject,
                              const FaultOutcome& outcome, std::uint64_t met, bool one_is_enough,
                              std::uint64_t begun_before_end) {
  if (!outcome.pushed) return "the motors never pushed at the tip";
  const auto due = std::ranges::count_if(script.faults, [&](const DeviceFault& fault) {
    return concerns(fault.kind, subject.scene.device.personality, subject.by_service);
  });
  if (subject.stop_s && begun_before_end > 0) return {};
  if (one_is_enough ? met > 0 || due == 0 : met >= static_cast<std::uint64_t>(due)) return {};
  return std::to_string(met) + " of " + std::to_string(due) + " faults changed anything";
}

}  // namespace

bool concerns(FaultKind kind, Personality personality, bool by_service) noexcept {
  const DeviceKind& device = kind_of(personality);
  const bool is_numbered = device.streams && !by_service;
  if (kind == FaultKind::unhome) return device.reports_homed;
  if (kind == FaultKind::noise) return device.has_pots;
  if (kind == FaultKind::replay) return is_numbered;
  if (is_of_service(kind)) return by_service;
  if (kind == FaultKind::still) return is_cartesian(personality);
  if (kind == FaultKind::freeze) return !device.streams || is_cartesian(personality);
  return true;
}

FaultOutcome run_faults(const FaultCase& subject, const FaultScript& as_written) {
  const FaultScript script = shifted(as_written);
  LoadedScene scene = subject.scene;  // the servo takes its volumes
  Emulator emulator(model_of(subject, script.seed), subject.hand);
  FaultyDevice device(emulator, script);
  const ServedDevice served(device, subject.by_service, script.seed);
  DirectPort wire(served.link());

  FaultOutcome outcome;
  const bool turns_fail =
      subject.by_service && std::ranges::any_of(script.faults, &Effect::of_turns, effect_of);
  const bool trusted =
      !turns_fail && std::ranges::none_of(script.faults, &Effect::misleads, effect_of);
  SafetyMonitor contract(subject.scene, trusted, outcome);
  double time_ms = 0;
  WatchedPort port(wire, contract, time_ms);
  VirtualLoop loop(scene, wire, port);

  GuardedLoop controller(loop);
  std::optional<EmulatedProgram> program;
  if (scene.force.model == ForceModel::external) {
    program.emplace(scene.force, subject.program, script.seed);
  }
  double first_push_ms = -1;
  std::uint64_t begun_before_end = 0;
  // A service does not show a servo that is ready: the emulated hand begins 2 s later.
  const std::int64_t cycles = cycles_of(script.seconds + (subject.by_service ? 2 : 0));
  for (std::int64_t cycle = 1; cycle <= cycles; ++cycle) {
    const bool due = loop.cycle();
    time_ms = static_cast<double>(cycle) * 1000 / kCyclesPerSecond;
    if (device.begun() > outcome.faults_begun) contract.fault_begins(time_ms);
    outcome.faults_begun = device.begun();
    served.report(time_ms, contract);
    contract.cycle(time_ms, {emulator.model().motor_force_n(), emulator.model().docked()});
    if (first_push_ms < 0 && outcome.pushed) {
      first_push_ms = time_ms;
      if (program) program->go_wrong(time_ms + later_ms(script));
    }
    const auto now_ns = static_cast<std::int64_t>(time_ms * 1e6);
    if (!controller.is_asked_to_end() && subject.stop_s && first_push_ms >= 0 &&
        time_ms >= first_push_ms + later_ms(script) + *subject.stop_s * 1000) {
      begun_before_end = device.begun();
      contract.asked_to_end(time_ms);
      controller.ask_to_end();
    }
    if (controller.has_ended()) continue;
    controller.look(static_cast<std::uint64_t>(cycle) + script.seed, now_ns);
    if (due && program && program->turn(time_ms, controller.last(), loop.servo())) {
      contract.program_gave(time_ms);
    }
    if (due) controller.tick(now_ns, device.host_is_late());
  }
  constexpr double kGraceMs = 50;
  // Of faults that may hide each other only this is demanded: if they amount to none, it goes on.
  const bool hides_more = script.hides && outcome.latched != fault_name(Fault::none);
  outcome.demanded = turns_fail || hides_more ? std::string() : script.latches;
  contract.end(time_ms, outcome.demanded, first_push_ms + end_of(script) * 1000 + kGraceMs);
  outcome.inconclusive = inconclusive_line(script, subject, outcome, device.met(),
                                           script.hides || turns_fail, begun_before_end);
  return outcome;
}

}  // namespace kerf::faults
