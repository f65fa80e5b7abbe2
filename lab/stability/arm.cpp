// SPDX-License-Identifier: Apache-2.0
#include "lab/stability/arm.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <utility>

#include "controller/load/load_scene.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "hil/device/emulator.hpp"
#include "hil/device/packet_device.hpp"
#include "hil/hil_error.hpp"
#include "lab/rig/bench_scene.hpp"
#include "lab/rig/virtual_loop.hpp"
#include "lab/stability/one_axis.hpp"
#include "shared/numeric/linear_algebra.hpp"

namespace kerf::zwidth {
namespace {

constexpr double kRadiusMm = kArmTouchMm, kVoxelMm = 0.25;
constexpr double kAwayMm = 3;     ///< the tool's middle above the flat, before a hit
constexpr double kGentlyS = 0.4;  ///< from there into the wall, of a push
/// x and z at which two more walls meet the flat: away from the hand's way in, which comes from -z,
/// and from the point at which friction stops a soft hand short.
constexpr double kCornerMm = 4.25;

/// The hand that pushes: the subject's, or a spring so soft that the device is as good as free.
SampledHand pushing_hand(const LoopCase& subject) {
  SampledHand hand = subject.loop.hand;
  constexpr double kSoft = 0.2;
  if (hand.stiffness_n_per_mm <= 0) hand.stiffness_n_per_mm = kSoft;
  return hand;
}

template <class Params>
Params with_plant(Params params, const LoopCase& subject) {
  const SampledHand hand = pushing_hand(subject);
  params.tip_mass_kg = subject.loop.mass_kg;
  params.viscous_ns_per_mm = subject.loop.viscous_ns_per_mm;
  params.coulomb_n = subject.loop.coulomb_n;
  params.hand_mass_kg = hand.mass_kg;
  params.hand_damping_ns_per_mm = hand.damping_ns_per_mm;
  params.hand_stiffness_n_per_mm = hand.stiffness_n_per_mm;
  params.output_delay_cycles = static_cast<int>(cycles_of(subject.loop.delay_s));
  if (subject.mode_hz > 0) {
    // A tenth of the tip's mass turns with the motors, at a lever of 0.13 m.
    constexpr double kShare = 0.1, kLeverM = 0.13;
    params.joint_inertia_kg_m2.fill(kShare * params.tip_mass_kg * kLeverM * kLeverM);
    params.tip_mass_kg *= 1 - kShare;
    params.mode_hz = subject.mode_hz;
  }
  return params;
}

/// One way of meeting a wall; device mm, of the tool's middle. Judged along `normal`.
struct ArmHit {
  DeviceVec<double> from, to;
  double mm_per_s;  ///< slower than that: gently
  DeviceVec<double> normal{0, 1, 0};
  double wall_mm = kRadiusMm;  ///< of the tool's middle along `normal` at the first contact
};

/// At a place that the seed shifts.
std::array<ArmHit, kArmHits> hits_of(const LoopCase& subject, const Press& press,
                                     std::uint64_t seed) {
  const double depth_mm =
      (press.push_n + subject.loop.coulomb_n) / pushing_hand(subject).stiffness_n_per_mm;
  constexpr std::uint64_t kPlaces = 1000;
  const double x_mm = static_cast<double>(seed * 7919 % kPlaces) / kPlaces;
  const DeviceVec<double> above{x_mm, kAwayMm, 0}, pressed{x_mm, kRadiusMm - depth_mm, 0};
  // A slide comes down by a sixth of its way; the hand is in full only at the end.
  constexpr double kSlideMm = 3;
  const DeviceVec<double> graze{x_mm - kSlideMm, kRadiusMm + kSlideMm / 6, 0};
  const double third = 1 / std::sqrt(3.0), in_mm = kCornerMm - kRadiusMm;
  const DeviceVec<double> out{-third, third, -third}, corner{in_mm, kRadiusMm, in_mm};
  return {{{above, pressed, kHitsMmPerS[0]},
           {above, pressed, kHitsMmPerS[1]},
           {above, pressed, kHitsMmPerS[2]},
           {graze, pressed, 50},
           {corner + out * kAwayMm, corner - out * depth_mm, 50, out, dot(corner, out)},
           {above, pressed, press.hit_mm_per_s}}};
}

/// To the hit's start, at which it waits, then into the wall, where it stays. The reach ends high
/// above, and the hand comes down so slowly that it does not swing.
HandScript script_of(const LoopCase& subject, const ArmHit& hit) {
  constexpr double kHighMm = 20, kPeriods = 3;
  const double hand_rad_per_s = with_plant(PlantParams{}, subject).hand_rad_per_s();
  HandScript script;
  script.start = {hit.from.x, hit.from.y + kHighMm, hit.from.z};
  HandStep wait;
  wait.seconds = 0.2;
  HandStep down = hand_move(hit.to, kGentlyS);
  const double way_mm = norm(hit.to - hit.from);
  if (hit.mm_per_s * kGentlyS > way_mm) {
    down.seconds = way_mm / hit.mm_per_s;
    down.ease = HandStep::Ease::linear;
  }
  script.steps = {hand_move(hit.from, kPeriods * 2 * std::numbers::pi / hand_rad_per_s), wait,
                  down};
  return script;
}

/// The whole arm in virtual time.
class Rig {
 public:
  Rig(LoadedScene scene, const LoopCase& subject, const HandScript& hand)
      : emulator_(arm_model(subject), hand), port_(emulator_), loop_(scene, port_) {
    loop_.driver().allow_stillness();
  }

  ServoOutput tick() { return loop_.tick(); }
  /// The mechanics. Their work is the motors' work on the tip, delay included: the servo books what
  /// it asked for.
  [[nodiscard]] const PlantState& plant() const { return emulator_.model().state(); }

 private:
  Emulator emulator_;
  DirectPort port_;
  VirtualLoop loop_;
};

/// The verdict on a latched fault.
constexpr LimitCycle kLost{.swings = true, .active = true};

/// Runs one hit and follows it from the first contact on. Returns the verdict; a lost device after
/// a fault. Throws NotMet after kPatienceS without contact.
LimitCycle watch_hit(Rig& rig, const LoopCase& subject, const ArmHit& hit, double push_n,
                     const LimitCycleDetector::Ticks& limits, StepCounter& ticks,
                     const SwingWatch& watch) {
  const double rate_hz = 1 / subject.loop.period_s;
  constexpr double kPatienceS = 8;  // calibration, and the way there
  LimitCycleDetector detector(limits, subject.loop.quantum_mm, push_n);
  std::int64_t away = 0;
  bool has_met = false;
  const std::int64_t settled = std::llround(0.05 * rate_hz);
  const std::int64_t patience = std::llround(kPatienceS * rate_hz);
  ServoOutput last;
  DeviceVec<double> last_mm{};
  for (std::int64_t tick = 0;; ++tick, ticks.tick()) {
    if (!has_met && tick > patience) throw NotMet();
    const ServoOutput out = rig.tick();
    if (out.fault != Fault::none) return kLost;
    const bool free = out.motors_on && out.phase == Phase::active && !out.contact;
    const DeviceVec<double> true_mm = rig.plant().pose.tip_mm;
    if (!has_met && away < settled) {
      away = free ? away + 1 : 0;
    } else if (has_met || out.contact) {
      has_met = true;
      const DeviceVec<double> tip_mm{out.position_mm[0], out.position_mm[1], out.position_mm[2]};
      if (watch)
        watch({dot(true_mm, hit.normal) - hit.wall_mm, dot(rig.plant().velocity, hit.normal)});
      const bool is_held = true_mm == last_mm && out.commanded_force_n == last.commanded_force_n;
      if (detector.take(dot(tip_mm, hit.normal), rig.plant().motor_work_mj, is_held)) {
        return detector.verdict();
      }
    }
    last = out;
    last_mm = true_mm;
  }
}

}  // namespace

LoadedScene walls_scene(const LoopCase& subject) {
  const int rate_hz = static_cast<int>(std::lround(1 / subject.loop.period_s));
  if (kCyclesPerSecond % rate_hz != 0) {
    throw HilError("--rate: " + std::to_string(rate_hz) +
                   " does not divide 8000, the rate of the devices' mechanics; use such as 4000");
  }
  LoadedScene scene;
  scene.path = "walls";
  constexpr std::int32_t kEdge = 48;
  const VoxelGrid grid{kEdge, kEdge, kEdge};
  constexpr double kCorner = -kVoxelMm * (kEdge - 1) / 2;
  SceneVolume& volume = scene.volumes.emplace_back();
  volume.name = "solid";
  volume.image.grid = grid;
  volume.image.spacing_mm = {kVoxelMm, kVoxelMm, kVoxelMm};
  volume.image.density = bench::densities(grid, [&](double x, double y, double z) {
    constexpr double kMiddle = (kEdge - 1) / 2.0, kWall = kMiddle + kCornerMm / kVoxelMm;
    return std::max({kMiddle - y, x - kWall, z - kWall});
  });
  volume.pose.position_mm = {kCorner, kCorner, kCorner};
  scene.tools.push_back(make_tool("ball", "ball", {.pitch_mm = kVoxelMm, .radius_mm = kRadiusMm}));
  scene.cut.model = CutModel::none;
  scene.device.personality = subject.device;
  scene.device.torque_scale = torque_scale_of(subject.device);
  if (subject.law == Law::paper) scene.force.model = ForceModel::paper;
  scene.force.damping_ns_per_mm = subject.damping_ns_per_mm;
  scene.force.stabiliser = subject.stabiliser;
  scene.limits.continuous_force_n = scene.limits.force_n;  // the motors stay cool
  scene.servo.velocity = subject.estimator;
  scene.servo.rate_hz = rate_hz;
  scene.servo.numeric = subject.numeric;
  return scene;
}

std::unique_ptr<DeviceModel> arm_model(const LoopCase& subject) {
  return with_device_params(
      subject.device, [&](const auto& params) { return make_model(with_plant(params, subject)); });
}

LoadedScene arm_scene(const LoadedScene& walls, const LoopCase& subject,
                      double stiffness_n_per_mm) {
  LoadedScene own = walls;
  own.force.stiffness_n_per_mm = stiffness_n_per_mm;
  if (subject.law == Law::paper) {
    own.force.p0_n_per_mm2 = 1;
    own.force.p0_n_per_mm2 = stiffness_n_per_mm / device_stiffness_n_per_mm(own);
  }
  own.force.law = force_law_at(subject, stiffness_n_per_mm);
  return own;
}

LimitCycle hit_with_arm(const LoadedScene& scene, const LoopCase& subject,
                        double stiffness_n_per_mm, std::size_t hit, const Press& press,
                        double limit_s, std::uint64_t seed, StepCounter& ticks,
                        const SwingWatch& watch) {
  // A tip that friction holds does not move before the hand has come to its place.
  constexpr double kRememberedS = 2 * kGentlyS;
  const ArmHit way = hits_of(subject, press, seed)[hit];
  Rig rig(arm_scene(scene, subject, stiffness_n_per_mm), subject, script_of(subject, way));
  return watch_hit(rig, subject, way, press.push_n,
                   hit_ticks(subject, stiffness_n_per_mm, press, limit_s, kRememberedS), ticks,
                   watch);
}

}  // namespace kerf::zwidth
