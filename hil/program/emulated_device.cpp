// SPDX-License-Identifier: Apache-2.0
#include "hil/program/emulated_device.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <type_traits>
#include <utility>

#include "hil/device/emulator.hpp"
#include "hil/hil_error.hpp"
#include "hil/script/hand_script_file.hpp"
#include "hil/script/identified_plant.hpp"
#include "shared/device/identified_device.hpp"
#include "shared/numeric/fnv1a.hpp"
#include "shared/wire/emulator_link.hpp"

namespace kerf {
namespace {

constexpr std::int64_t kAcceptCycles = kCyclesPerSecond / 20;  // for another window: each 50 ms
constexpr int kMaxTargetsPerWake = 16;  // a flooding window cannot hold the device

std::optional<HandScript> hand_of(const EmulatorOptions& o) {
  if (o.hand.empty() && o.hand_socket.empty()) return std::nullopt;
  HandScript script;  // one that a window leads only goes to its start
  if (!o.hand.empty()) script = read_hand_script(o.hand);
  if (!script.unit_mm) script.unit_mm = o.unit_mm;
  return script;
}

/// Faults of a device; one of its host can only be played if both are in one program.
FaultScript faults_of(const EmulatorOptions& o) {
  if (o.fault.empty()) return {};
  FaultScript script = read_fault_script(o.fault);
  if (std::ranges::count(script.faults, FaultKind::host_late, &DeviceFault::kind) > 0) {
    throw HilError(o.fault + ": host_late: no device can hold up its host; use ./kerf lab faults " +
                   "--scripts " + o.fault + ", or stop the controller (kill -STOP)");
  }
  return script;
}

/// In lock-step a command acts a period after its report; in real time the device moves on when it
/// has looked for one, so that it acts at once.
PlantValues identified_of(const EmulatorOptions& o) {
  if (o.identified.empty()) return {};
  try {
    return plant_of(read_identified_device(o.identified), o.lockstep ? 1.0 / o.rate_hz : 0,
                    o.identified);
  } catch (const DeviceFileError& error) {
    throw HilError(error.what());
  }
}

/// Sets the parameters that script, identified device and command line give.
void take_plants(const EmulatorOptions& o, const PlantValues& of_script,
                 const PlantValues& of_identified, PlantParams& params) {
  take_plant(of_script, params);
  take_plant(of_identified, params);
  take_plant(o.plant, params);
  if (params.mode_hz > 0 && params.joint_inertia_kg_m2[0] <= 0) {
    throw HilError("--mode-hz: without inertia nothing rings; give --joint-inertia, such as 1e-4");
  }
  if (!o.drop_torque) return;
  params.on_silence = OnSilence::drop_torque;
  params.silence_cycles = o.silence_ms * kCyclesPerSecond / 1000;
}

}  // namespace

void HandServer::accept_window() noexcept {
  auto newcomer = server_.accept_waiting();
  if (!newcomer) return;
  const bool taken = window_.has_value();
  static_cast<void>(newcomer->send(encode(taken ? HandGreeting::taken : HandGreeting::yours)));
  if (!taken) window_.emplace(std::move(*newcomer));
}

void HandServer::lead(Emulator& emulator, int cycles) noexcept {
  since_accept_ += cycles;
  if (since_accept_ >= kAcceptCycles && emulator.accepts_target()) {
    since_accept_ = 0;
    accept_window();
  }
  if (!window_) return;
  std::array<std::uint8_t, kHandTargetBytes + 1> buffer;  // a longer packet is seen to be wrong
  std::optional<HandTarget> newest;
  for (int taken = 0; taken < kMaxTargetsPerWake; ++taken) {
    const auto packet = window_->take(buffer);
    if (packet.empty()) break;
    const auto target = decode_hand_target(packet);
    ++(target ? targets_ : refused_);
    if (target) newest = target;
  }
  if (newest) emulator.set_target(*newest);
  if (!window_->closed()) return;
  window_.reset();
  emulator.release();
}

std::unique_ptr<DeviceModel> make_device(const EmulatorOptions& o, const PlantValues& of_script,
                                         const PlantValues& of_identified) {
  return with_device_params(o.personality, [&](auto params) {
    take_plants(o, of_script, of_identified, params);
    if constexpr (std::is_same_v<decltype(params), WoodenParams>) {
      params.packet_bytes = o.packet_bytes;
      params.wireless_button = o.wireless_button;
    } else if constexpr (std::is_same_v<decltype(params), OmniParams>) {
      params.pot_noise = o.pot_noise;
      params.seed = o.seed;
    } else if constexpr (std::is_same_v<decltype(params), CartesianParams>) {
      params.on_request = o.front == "websocket";
    }
    return make_model(params);
  });
}

EmulatedDevice::EmulatedDevice(const EmulatorOptions& options)
    : options_(options),
      hand_(hand_of(options)),
      identified_(identified_of(options)),
      faults_(faults_of(options)) {
  if (!options_.hand_socket.empty()) leader_.emplace(options_.hand_socket);
  renew();
}

void EmulatedDevice::advance(int cycles) noexcept {
  if (leader_) leader_->lead(*emulator_, cycles);
  faulty_->advance(cycles);
}

void EmulatedDevice::renew() {
  if (emulator_) {
    earlier_ = stats();
    withheld_ = withheld();
  }
  faulty_.reset();
  emulator_.emplace(make_device(options_, hand_ ? hand_->plant : PlantValues{}, identified_),
                    hand_);
  faulty_.emplace(*emulator_, faults_);
}

EmulatorStats EmulatedDevice::joined(const EmulatorStats& earlier,
                                     const EmulatorStats& later) noexcept {
  if (earlier.cycles == 0) return later;
  EmulatorStats all = later;
  all.cycles += earlier.cycles;
  all.reports += earlier.reports;
  all.commands += earlier.commands;
  all.refused += earlier.refused;
  all.peak_motor_force_n = std::max(earlier.peak_motor_force_n, later.peak_motor_force_n);
  all.square_sum_n2 += earlier.square_sum_n2;
  all.motor_work_mj += earlier.motor_work_mj;
  if (later.undocked_at) all.undocked_at = earlier.cycles + *later.undocked_at;
  if (earlier.undocked_at) all.undocked_at = earlier.undocked_at;
  all.report_hash = fnv1a_step(earlier.report_hash, later.report_hash);
  return all;
}

}  // namespace kerf
