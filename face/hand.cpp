// SPDX-License-Identifier: Apache-2.0
#include "kerf/hand.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "controller/device/device_driver.hpp"
#include "face/emulated_hand.hpp"
#include "face/loaded.hpp"
#include "face/lock_step_port.hpp"
#include "hil/device/emulator.hpp"
#include "hil/script/fault_script.hpp"
#include "hil/script/faulty_device.hpp"
#include "hil/script/hand_script_file.hpp"
#include "shared/text/text.hpp"
#include "shared/wire/emulator_link.hpp"

namespace kerf {
namespace {

HandScript script_of(const std::filesystem::path& file, const LoadedScene& scene) {
  return with_unit(file.empty() ? HandScript{} : read_hand_script(file), scene);
}

FaultScript faults_of(const std::filesystem::path& file) {
  return file.empty() ? FaultScript{} : read_fault_script(file);
}

/// What the driver sends of a tick.
ServoOutput output_of(const TickRecord& record) noexcept {
  ServoOutput output;
  std::copy_n(std::begin(record.dac_counts), 3, output.dac_counts.begin());
  output.motors_on = (record.flags & kFlagMotorsOn) != 0;
  output.phase = static_cast<Phase>(record.phase);
  return output;
}

/// A rate that the emulated device can have.
int rate_of(const LoadedScene& scene) {
  const int rate_hz = scene.servo.rate_hz;
  if (kCyclesPerSecond % rate_hz == 0) return rate_hz;
  throw Error("servo.rate_hz = " + std::to_string(rate_hz) +
              ": an emulated device in lock-step has rates that divide 8000, such as 4000");
}

/// A scale that was measured on a unit gives the emulated motors another force.
void require_emulated_motors(const DeviceSettings& device) {
  const std::array<double, 3> emulated = torque_scale_in_text(device.personality);
  if (device.torque_scale == emulated) return;
  const auto text = [](const std::array<double, 3>& scale) {
    return number_text(scale[0]) + ", " + number_text(scale[1]) + ", " + number_text(scale[2]);
  };
  throw Error("device.torque_scale = [" + text(device.torque_scale.value_or(emulated)) +
              "]: the emulated motors have [" + text(emulated) + "]; leave it out");
}

}  // namespace

struct Hand::Parts {
  Parts(const LoadedScene& scene, const std::filesystem::path& script,
        const std::filesystem::path& faults)
      : device(scene.device),
        played(script_of(script, scene)),
        emulator(model_for(scene, played), played),
        faulty(emulator, faults_of(faults)),
        port(faulty, device.personality, rate_of(scene)),
        driver(make_driver(device.personality, port, device.encoder_sign, rate_of(scene))) {
    driver->start();
  }

  /// Without `script`: that of the scene.
  static std::unique_ptr<Parts> of(const Scene& scene,
                                   const std::optional<std::filesystem::path>& script,
                                   const std::filesystem::path& faults, std::size_t arm) {
    const LoadedScene& loaded = scene.loaded().scene;
    if (arm >= scene.arms()) {
      throw Error("arm " + std::to_string(arm) + ": the scene has " + std::to_string(scene.arms()) +
                  "; they count from 0");
    }
    require_emulated_motors(device_of(loaded, arm));
    if (arm == 0) {
      return std::make_unique<Parts>(loaded, script.value_or(loaded.hand_script), faults);
    }
    return std::make_unique<Parts>(second_arm_of(loaded),
                                   script.value_or(loaded.second->hand_script), faults);
  }

  DeviceReport next(const TickRecord& last) noexcept {
    if (last.tick > 0) driver->command(output_of(last));
    return driver->read();
  }

  DeviceSettings device;
  HandScript played;
  Emulator emulator;
  FaultyDevice faulty;
  DirectLockStepPort port;
  std::unique_ptr<DeviceDriver> driver;
};

Hand::Hand(const Scene& scene, std::size_t arm)
    : parts_(or_error([&] { return Parts::of(scene, std::nullopt, {}, arm); })) {}
Hand::Hand(const Scene& scene, const std::filesystem::path& script,
           const std::filesystem::path& faults, std::size_t arm)
    : parts_(or_error([&] { return Parts::of(scene, script, faults, arm); })) {}
Hand::Hand(std::unique_ptr<Parts> parts) noexcept : parts_(std::move(parts)) {}
Hand Hand::with_faults(const Scene& scene, const std::filesystem::path& faults, std::size_t arm) {
  return Hand(or_error([&] { return Parts::of(scene, std::nullopt, faults, arm); }));
}
Hand::~Hand() = default;
Hand::Hand(Hand&&) noexcept = default;
Hand& Hand::operator=(Hand&&) noexcept = default;

DeviceReport Hand::next(const TickRecord& last) noexcept {
  return parts_->next(last);
}

void Hand::lead(const std::array<double, 3>& tip_mm, bool button) noexcept {
  if (!std::ranges::all_of(tip_mm, [](double mm) { return std::isfinite(mm); })) return;
  const auto axis = [&](std::size_t i) {
    return (tip_mm[i] - parts_->device.offset_mm[i]) / parts_->device.workspace_scale;
  };
  HandTarget target{};
  target.tip_mm = {axis(0), axis(1), axis(2)};
  target.button1 = button;
  // Through the packet of a window, whose numbers are whole and within the limits.
  if (const auto sent = decode_hand_target(encode(target))) parts_->emulator.set_target(*sent);
}

bool Hand::ended() const noexcept {
  return parts_->emulator.accepts_target();
}

std::array<double, 3> Hand::tip_mm() const noexcept {
  const DeviceVec<double> tip = parts_->emulator.model().tip_mm();
  const DeviceSettings& device = parts_->device;
  const auto world = [&](double mm, std::size_t i) {
    return device.offset_mm[i] + device.workspace_scale * mm;
  };
  return {world(tip.x, 0), world(tip.y, 1), world(tip.z, 2)};
}

std::array<double, 3> Hand::motor_force_n() const noexcept {
  const DeviceVec<double> force = parts_->emulator.model().motor_force_n();
  return {force.x, force.y, force.z};
}

}  // namespace kerf
