// SPDX-License-Identifier: Apache-2.0
#include "lab/energy/closed_loops.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <numbers>

#include "controller/plan/compile.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "lab/rig/fake_arm.hpp"
#include "shared/numeric/vec3.hpp"

namespace kerf::energy {
namespace {

using Place = std::array<double, 3>;

constexpr double kVoxelMm = 0.125, kBallMm = 3, kToolMm = 1, kDepthMm = 0.6, kLoopMm = 0.375;
constexpr int kEdge = 72, kLapTicks = 1000;

LoadedScene ball_scene(NumericKind numeric, ForceModel model, double friction) {
  LoadedScene scene;
  scene.path = "ball";
  SceneVolume volume;
  volume.name = "ball";
  volume.image.grid = {kEdge, kEdge, kEdge};
  volume.image.spacing_mm = {kVoxelMm, kVoxelMm, kVoxelMm};
  const double corner = -kVoxelMm * (kEdge - 1) / 2;
  volume.pose.position_mm = {corner, corner, corner};
  for (int z = 0; z < kEdge; ++z) {
    for (int y = 0; y < kEdge; ++y) {
      for (int x = 0; x < kEdge; ++x) {
        const double out_mm =
            std::hypot(corner + x * kVoxelMm, corner + y * kVoxelMm, corner + z * kVoxelMm) -
            kBallMm;
        volume.image.density.push_back(static_cast<Density>(
            std::lround(std::clamp(0.5 - out_mm / kVoxelMm, 0.0, 1.0) * kDensityMax)));
      }
    }
  }
  scene.volumes.push_back(std::move(volume));
  scene.tools.push_back(
      make_tool("ball", "ball", {.pitch_mm = kVoxelMm, .size_vox = int(2 * kToolMm / kVoxelMm)}));
  scene.cut.model = CutModel::none;
  scene.force.model = model;
  scene.force.friction = friction;
  scene.force.damping_ns_per_mm = 0;
  scene.device.torque_scale = std::array{0.342, 0.342, 0.342};
  scene.servo.numeric = numeric;
  return scene;
}

double mj(const ServoOutput& out, EnergySource source) {
  return energy_mj_of_steps(out.energy_steps[static_cast<std::size_t>(source)]);
}

/// The hand on the upper half of the ball.
class Rider {
 public:
  explicit Rider(LoadedScene scene) : servo_(compile(scene)) {
    arm_at(*servo_, arm_, 0, 20, 0);
    at_mm_ = {0, 20, 0};
  }
  ServoOutput travel(const Place& to_mm, int ticks) {
    ServoOutput out;
    const Place from_mm = at_mm_;
    for (int i = 1; i <= ticks; ++i) {
      const double s = static_cast<double>(i) / ticks;
      out =
          step({from_mm[0] + s * (to_mm[0] - from_mm[0]), from_mm[1] + s * (to_mm[1] - from_mm[1]),
                from_mm[2] + s * (to_mm[2] - from_mm[2])});
    }
    return out;
  }
  ServoOutput step(const Place& at_mm) {
    at_mm_ = at_mm;
    return servo_->step(arm_.at(at_mm[0], at_mm[1], at_mm[2]));
  }

 private:
  std::unique_ptr<Servo> servo_;
  FakeArm arm_;
  Place at_mm_{};
};

/// Two laps about the place in direction `normal`; the second one counts.
void ride(Rider& rider, const Place& normal, LoopWork& work) {
  const double centre_mm = kBallMm + kToolMm - kDepthMm;
  const double side = std::hypot(normal[0], normal[1]);
  const Place a = side > 0 ? Place{normal[1] / side, -normal[0] / side, 0} : Place{1, 0, 0};
  const Place b = {normal[1] * a[2] - normal[2] * a[1], normal[2] * a[0] - normal[0] * a[2],
                   normal[0] * a[1] - normal[1] * a[0]};
  const auto at = [&](double turn) {
    const double c = kLoopMm * std::cos(turn), s = kLoopMm * std::sin(turn);
    Place place{};
    for (std::size_t i = 0; i < 3; ++i) {
      const double rising = (normal[i] + a[i]) * std::numbers::sqrt2 / 2;
      place[i] = centre_mm * normal[i] + c * rising + s * b[i];
    }
    return place;
  };
  static_cast<void>(rider.travel({normal[0] * 8, normal[1] * 8, normal[2] * 8}, 200));
  static_cast<void>(rider.travel(at(0), 200));
  ServoOutput begin, last;
  double to_and_fro_mj = 0;
  for (int i = 0; i < 2 * kLapTicks; ++i) {
    const ServoOutput out = rider.step(at(2 * std::numbers::pi * (i + 1) / kLapTicks));
    if (i == kLapTicks - 1) begin = out;
    if (i >= kLapTicks) {
      to_and_fro_mj += std::abs(mj(out, EnergySource::spring) - mj(last, EnergySource::spring));
    }
    last = out;
  }
  const auto lap = [&](EnergySource source) { return mj(last, source) - mj(begin, source); };
  work.share = std::max(work.share, std::abs(lap(EnergySource::spring)) / to_and_fro_mj);
  work.friction_mj += lap(EnergySource::friction) / 6;
  work.leak_mj += lap(EnergySource::leak) / 6;
  static_cast<void>(rider.travel({normal[0] * 8, normal[1] * 8, normal[2] * 8}, 200));
}

}  // namespace

std::vector<LoopWork> closed_loops() {
  struct Model {
    const char* name;
    ForceModel model;
    double friction, most_share;
  };
  constexpr std::array kModels{Model{"proxy", ForceModel::proxy, 0, 5e-3},
                               Model{"proxy, friction 0.3", ForceModel::proxy, 0.3, 0.1},
                               Model{"paper", ForceModel::paper, 0, 5e-3}};
  constexpr std::array kNumbers{std::pair{NumericKind::fixed, "fixed"},
                                std::pair{NumericKind::float32, "float"},
                                std::pair{NumericKind::float64, "double"}};
  std::vector<LoopWork> all;
  for (const Model& model : kModels) {
    for (const auto& [numeric, name] : kNumbers) {
      LoopWork work{.model = model.name, .numeric = name, .most_share = model.most_share};
      Rider rider(ball_scene(numeric, model.model, model.friction));
      for (int i = 0; i < 6; ++i) {  // about the pole, none on an axis of the voxels
        const double turn = 1.1 + i * std::numbers::pi / 3, tilt = 0.25 + 0.12 * i;
        ride(rider,
             {std::sin(tilt) * std::cos(turn), std::cos(tilt), std::sin(tilt) * std::sin(turn)},
             work);
      }
      all.push_back(work);
    }
  }
  return all;
}

}  // namespace kerf::energy
