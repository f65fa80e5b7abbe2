// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>

#include "shared/volume/checksum.hpp"
#include "tests/rig/kinematic_hand.hpp"
#include "tests/servo/support.hpp"

/// A scene of two arms, the hands that lead them, and a servo under both.
namespace kerf::test {

using Place = std::array<double, 3>;
inline constexpr Place kAbove{0, 5, 0};
inline constexpr double kApartMm = 3;  // of the middle, each

struct CutKind {
  const char* name;
  NumericKind numeric;
  CutModel cut;
};
inline constexpr std::array kCutKinds{
    CutKind{"preston, fixed", NumericKind::fixed, CutModel::preston},
    CutKind{"preston, double", NumericKind::float64, CutModel::preston},
    CutKind{"paper, fixed", NumericKind::fixed, CutModel::overlap},
    CutKind{"paper, double", NumericKind::float64, CutModel::overlap}};

/// Solid below y = 0, wide enough for two hands, each above its own half: an omega with a ball of
/// 16 voxels, and a Touch with one of 10.
inline LoadedScene two_armed(const CutKind& kind, double apart_mm = kApartMm) {
  const bool force = kind.cut == CutModel::preston;
  LoadedScene scene = force ? half_space_scene(96) : paper_scene(96);
  scene.servo.numeric = kind.numeric;
  scene.cut.model = kind.cut;
  if (force) scene.cut.machinability_mm3_per_s_n = 8;
  scene.tools.push_back(ball(10));
  scene.device.personality = Personality::omega;
  scene.device.torque_scale = std::array{1.0, 1.0, 1.0};
  scene.device.offset_mm = {-apart_mm, 0, 0};
  scene.second = SecondArm{.device = scene.device,
                           .offset_given = true,
                           .limits = scene.limits,
                           .hand_script = {},
                           .hand_location = {}};
  scene.second->device.personality = Personality::touch;
  scene.second->device.offset_mm = {apart_mm, 0, 0};
  scene.second_tool = 1;
  return scene;
}

/// The same with one arm: the first, or the second.
inline LoadedScene alone(LoadedScene scene, std::size_t arm) {
  if (arm == 1) {
    scene.device = scene.second->device;
    scene.limits = scene.second->limits;
    scene.active_tool = scene.second_tool;
  }
  scene.second.reset();
  return scene;
}

/// The same with the arms exchanged: each device, tool and limit at the other index.
inline LoadedScene exchanged(LoadedScene scene) {
  std::swap(scene.device, scene.second->device);
  std::swap(scene.limits, scene.second->limits);
  std::swap(scene.active_tool, scene.second_tool);
  return scene;
}

/// What a hand does in a tick: nothing is sent, it rests parked, or it holds its tool at a place.
struct Hand {
  Place at = kAbove;
  bool parked = false, silent = false;
  bool homed = true, pedal = true;
};

/// A servo under one or two hands.
class Bench {
 public:
  explicit Bench(LoadedScene scene) : servo(compile(scene)) {
    hands_[0].emplace(scene.device);
    if (scene.second) hands_[1].emplace(scene.second->device);
    first = hash();
  }
  void dock() {
    for (int tick = 0; tick < kDockTicks; ++tick) {
      step({.parked = true}, {.parked = true});
    }
    for (int tick = 0; tick < 200; ++tick) step({}, {});
  }
  void step(const Hand& a, const Hand& b = {}) {
    reports = {report(a, 0), servo->arms() > 1 ? report(b, 1) : DeviceReport{}};
    servo->step(std::span(reports).first(servo->arms()), std::span(out).first(servo->arms()));
  }
  [[nodiscard]] std::uint64_t hash() const { return density_hash(servo->density(0)); }

  std::unique_ptr<CompiledScene> servo;
  std::array<DeviceReport, kMaxArms> reports;  ///< of the last tick
  std::array<ServoOutput, kMaxArms> out;
  std::uint64_t first = 0;

 private:
  [[nodiscard]] DeviceReport report(const Hand& hand, std::size_t arm) {
    if (hand.silent) return {};
    ranges::KinematicHand& of = *hands_[arm];
    DeviceReport report =
        of.report(of.counts_at({hand.at[0], hand.at[1], hand.at[2]}), hand.parked);
    report.homed = hand.homed;
    report.button1 = hand.pedal;
    return report;
  }

  std::array<std::optional<ranges::KinematicHand>, kMaxArms> hands_;
};

/// Presses 0.9 mm below the first surface and draws a groove, from the air and back.
inline Hand stroke(int tick) {
  const double s = std::min(tick / 200.0, 1.0), along = std::clamp((tick - 200) / 400.0, 0.0, 1.0),
               up = std::clamp((tick - 600) / 100.0, 0.0, 1.0);
  return {{-0.5 + along, 5 - 5.9 * s + 5.9 * up, 0}};
}
inline constexpr int kStrokeTicks = 800;

}  // namespace kerf::test
