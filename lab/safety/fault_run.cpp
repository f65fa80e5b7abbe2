// SPDX-License-Identifier: Apache-2.0
#include "lab/safety/fault_run.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "controller/device/device_driver.hpp"
#include "controller/device/port/packet_port.hpp"
#include "controller/loop/servo_loop.hpp"
#include "controller/loop/tick_source.hpp"
#include "controller/plan/compile.hpp"
#include "hil/device/emulator.hpp"
#include "hil/device/falcon.hpp"
#include "hil/device/omni.hpp"
#include "hil/device/packet_device.hpp"
#include "hil/device/wooden.hpp"
#include "hil/script/faulty_device.hpp"
#include "lab/rig/direct_port.hpp"
#include "lab/safety/contract.hpp"

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
/// silent, half drop it: a device's behaviour is not known.
template <class Params>
Params plant_of(const HandScript& hand, std::uint32_t seed) {
  Params params;
  take_plant(hand.plant, params);
  params.on_silence = seed % 2 == 0 ? OnSilence::hold_torque : OnSilence::drop_torque;
  return params;
}

Emulator make_emulator(const Subject& subject, std::uint32_t seed) {
  switch (subject.scene.device.personality) {
    case Personality::falcon:
      return {std::make_unique<FalconModel>(plant_of<FalconParams>(subject.hand, seed)),
              subject.hand};
    case Personality::woodenhaptics: {
      WoodenParams wooden;  // lets go by itself
      take_plant(subject.hand.plant, wooden);
      return {std::make_unique<WoodenModel>(wooden), subject.hand};
    }
    case Personality::omni:
      break;
  }
  auto params = plant_of<OmniParams>(subject.hand, seed);
  params.dock_rad = subject.scene.device.dock_rad;
  return {params, subject.hand};
}

/// Returns true if the motors' true force need not follow the commands under this script: a sensor
/// shows another pose than the true one, or commands do not arrive.
bool misleads(const DeviceFault& fault) {
  switch (fault.kind) {
    case FaultKind::stick:
    case FaultKind::jump:
    case FaultKind::wander:
    case FaultKind::corrupt:
    case FaultKind::unplug:
    case FaultKind::host_late:
      return true;
    case FaultKind::lose:
    case FaultKind::delay:
    case FaultKind::duplicate:
    case FaultKind::reorder:
    case FaultKind::truncate:
      return fault.of_commands;
    case FaultKind::park:
    case FaultKind::chatter:
    case FaultKind::unhome:
    case FaultKind::noise:
    case FaultKind::silence:
      break;
  }
  return false;
}

double end_of(const FaultScript& script) {
  double end_s = 0;
  for (const DeviceFault& fault : script.faults) {
    end_s = std::max(end_s, fault.at_s + fault.for_s + fault.ms / 1000);
  }
  return end_s;
}

/// The same faults at another moment of the hand's motion, up to 0.1 s later.
FaultScript shifted(FaultScript script) {
  constexpr std::uint32_t kPrime = 7919, kMs = 100;
  const double later_s = (script.seed * kPrime % kMs) / 1000.0;
  for (DeviceFault& fault : script.faults) fault.at_s += later_s;
  return script;
}

/// One line if the run shows nothing: no contact, or a fault that never was.
std::string vacuous_line(const FaultScript& script, Personality personality, const Outcome& outcome,
                         std::uint64_t met) {
  if (!outcome.pushed) return "the motors never pushed at the tip";
  const auto due = std::ranges::count_if(
      script.faults, [&](const DeviceFault& fault) { return concerns(fault.kind, personality); });
  if (script.is_random ? met > 0 || due == 0 : met >= static_cast<std::uint64_t>(due)) return {};
  return std::to_string(met) + " of " + std::to_string(due) + " faults changed anything";
}

/// The shell of a controller in virtual time: its clock is the emulator's.
class VirtualShell {
 public:
  VirtualShell(const LoadedScene& scene, CompiledScene& servo, PacketPort& port)
      : servo_(servo),
        driver_(make_driver(scene.device.personality, port, scene.device.encoder_sign)) {}

  void start() { driver_->start(); }
  void look(std::int64_t now_ns) { watchdog_.look(now_ns); }
  void tick(std::int64_t now_ns) {
    const DeviceReport report = driver_->read();
    static_cast<void>(recover(signals_, standstill_.stood_still(now_ns), servo_));
    send_tick(servo_.step(report), signals_, *driver_);
    ++signals_.heartbeat;
  }

 private:
  CompiledScene& servo_;
  std::unique_ptr<DeviceDriver> driver_;
  std::atomic<bool> stop_{false};
  LoopSignals signals_{stop_};
  Watchdog watchdog_{*driver_, signals_};
  StandstillWatch standstill_;
};

}  // namespace

bool concerns(FaultKind kind, Personality personality) noexcept {
  if (kind == FaultKind::unhome) return personality == Personality::falcon;
  if (kind == FaultKind::noise) return personality == Personality::omni;
  return true;
}

Outcome run_faults(const Subject& subject, const FaultScript& as_written) {
  const FaultScript script = shifted(as_written);
  LoadedScene scene = subject.scene;  // the servo takes its volumes
  const std::unique_ptr<CompiledScene> servo = compile(scene);
  Emulator emulator = make_emulator(subject, script.seed);
  FaultyDevice device(emulator, script);
  DirectPort wire(device);

  Outcome outcome;
  const bool trusted = std::ranges::none_of(script.faults, misleads);
  SafetyMonitor contract(subject.scene, trusted, outcome);
  double time_ms = 0;
  WatchedPort port(wire, contract, time_ms);
  VirtualShell shell(scene, *servo, port);

  const int cycles_per_tick = kCyclesPerSecond / scene.servo.rate_hz;
  const auto cycles_per_look =
      static_cast<std::uint32_t>(cycles_of(std::chrono::duration<double>(kWatchdogPeriod).count()));
  double first_push_ms = -1;
  shell.start();
  const std::int64_t cycles = cycles_of(script.seconds);
  for (std::int64_t cycle = 1; cycle <= cycles; ++cycle) {
    wire.cycle();
    time_ms = static_cast<double>(cycle) * 1000 / kCyclesPerSecond;
    if (device.begun() > outcome.faults_begun) contract.fault_begins(time_ms);
    outcome.faults_begun = device.begun();
    contract.cycle(time_ms, {emulator.model().motor_force_n(), emulator.model().docked()});
    if (first_push_ms < 0 && outcome.pushed) first_push_ms = time_ms;
    const auto now_ns = static_cast<std::int64_t>(time_ms * 1e6);
    if ((static_cast<std::uint64_t>(cycle) + script.seed) % cycles_per_look == 0)
      shell.look(now_ns);
    if (cycle % cycles_per_tick == 0 && !device.host_is_late()) shell.tick(now_ns);
  }
  constexpr double kGraceMs = 50;
  contract.end(time_ms, script.latches, first_push_ms + end_of(script) * 1000 + kGraceMs);
  outcome.vacuous = vacuous_line(script, scene.device.personality, outcome, device.met());
  return outcome;
}

}  // namespace kerf::faults
