// SPDX-License-Identifier: Apache-2.0
#include "lab/faults/fault_run.hpp"

#include <algorithm>
#include <atomic>
#include <memory>

#include "controller/device/driver/device_driver.hpp"
#include "controller/plan/compile.hpp"
#include "controller/shell/servo_loop.hpp"
#include "controller/shell/watchdog.hpp"
#include "hil/devmodel/bus_cycle.hpp"
#include "hil/devmodel/emulator.hpp"
#include "hil/devmodel/falcon_model.hpp"
#include "hil/devmodel/omni_model.hpp"
#include "hil/devmodel/wooden_model.hpp"
#include "hil/fault/faulty_device.hpp"
#include "lab/faults/contract.hpp"
#include "lab/rig/direct_port.hpp"

namespace kerf::faults {
namespace {

constexpr double kPushN = 0.05;

/// Half of the seeds hold the torque when the host is silent, half drop it: what a device does is
/// not known.
template <class Params>
Params with_silence(Params params, std::uint32_t seed) {
  params.on_silence = seed % 2 == 0 ? OnSilence::hold_torque : OnSilence::drop_torque;
  return params;
}

Emulator make_emulator(const Subject& subject, std::uint32_t seed) {
  switch (subject.scene.device.personality) {
    case Personality::falcon:
      return {std::make_unique<FalconModel>(with_silence(FalconParams{}, seed)), subject.hand};
    case Personality::woodenhaptics:
      return {std::make_unique<WoodenModel>(WoodenParams{}), subject.hand};
    case Personality::omni:
      break;
  }
  OmniParams params = with_silence(OmniParams{}, seed);
  params.dock_rad = subject.scene.device.dock_rad;
  return {params, subject.hand};
}

/// Whether the motors' true force need not follow the commands under this script: a sensor tells of
/// another pose than the true one, or commands do not arrive.
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

}  // namespace

Outcome run_faults(const Subject& subject, const FaultScript& script) {
  LoadedScene scene = subject.scene;  // the servo takes its volumes
  const std::unique_ptr<CompiledScene> servo = compile(scene);
  Emulator emulator = make_emulator(subject, script.seed);
  FaultyDevice device(emulator, script);
  DirectPort port(device);
  const std::unique_ptr<DeviceDriver> driver =
      make_driver(scene.device.personality, port, scene.device.encoder_sign);
  std::atomic<bool> stop{false};
  LoopSignals signals{stop};
  Watchdog watchdog(*driver, signals);

  Outcome outcome;
  const int rate_hz = scene.servo.rate_hz;
  const int cycles_per_tick = kCyclesPerSecond / rate_hz;
  const auto ticks = static_cast<std::int64_t>(subject.seconds * rate_hz);
  Contract contract(rate_hz, scene.limits.force_n, outcome);
  const bool trusted = std::ranges::none_of(script.faults, misleads);
  double first_push_s = -1;
  double time_ms = 0;
  bool is_well = true;

  driver->start();
  for (std::int64_t tick = 1; tick <= ticks; ++tick) {
    for (int cycle = 0; cycle < cycles_per_tick; ++cycle) {
      port.cycle();
      time_ms = static_cast<double>(emulator.stats().cycles) * 1000 / kCyclesPerSecond;
      if (is_well && device.begun() > 0) contract.fault_begins(time_ms);
      is_well = device.begun() == 0;
      contract.device_force(time_ms, norm(emulator.model().motor_force_n()), trusted);
    }
    watchdog.look(static_cast<std::int64_t>(time_ms * 1e6));
    if (device.host_is_late()) {
      if (signals.stalled) contract.watchdog_off();
      continue;
    }
    const DeviceReport report = driver->read();
    if (signals.stalled.exchange(false)) servo->apply({.kind = ServoCommand::Kind::fade_in});
    const ServoOutput output = servo->step(report);
    driver->command(output);
    ++signals.heartbeat;
    contract.tick(time_ms, output);

    const double force_n = std::max(
        {std::abs(output.force_n[0]), std::abs(output.force_n[1]), std::abs(output.force_n[2])});
    if (force_n < kPushN) continue;
    if (first_push_s < 0) first_push_s = time_ms / 1000;
    outcome.pushed = true;
    outcome.pushed_again = time_ms / 1000 > first_push_s + end_of(script) + 0.05;
  }
  contract.end(time_ms, script.latches);
  outcome.faults_begun = device.begun();
  return outcome;
}

}  // namespace kerf::faults
