// SPDX-License-Identifier: Apache-2.0
#include "lab/stability/energy_measures.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <numbers>
#include <random>

#include "controller/law/stabilisers.hpp"
#include "controller/law/virtual_coupling.hpp"
#include "controller/plan/compile.hpp"
#include "controller/servo/energy_ledger.hpp"
#include "controller/tool/tool_shapes.hpp"
#include "lab/rig/bench_scene.hpp"
#include "lab/rig/kinematic_arm.hpp"
#include "lab/rig/port_loop.hpp"
#include "shared/numeric/linear_algebra.hpp"

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
  std::unique_ptr<AnyServo> servo_;
  KinematicOmni arm_;
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

constexpr std::size_t kPlaces = 4096;
constexpr int kRounds = 9;

/// Of one tick, as a hand that trembles on a wall makes them.
template <class N>
struct Tick {
  DeviceVec<typename N::Real> force_n, moved_mm, spring_mm;
};

template <class N>
std::vector<Tick<N>> random_ticks() {
  using Real = typename N::Real;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(-1, 1);
  const auto vector = [&](double most) {
    const double x = any(random) * most, y = any(random) * most, z = any(random) * most;
    return DeviceVec<Real>{static_cast<Real>(x), static_cast<Real>(y), static_cast<Real>(z)};
  };
  std::vector<Tick<N>> ticks(kPlaces);
  for (Tick<N>& tick : ticks) {
    tick.force_n = vector(2);
    tick.moved_mm = vector(0.2);
    tick.spring_mm = vector(1);
  }
  return ticks;
}

template <class Run>
double fastest_ns(Run&& run) {
  using Clock = std::chrono::steady_clock;
  double best = 1e18;
  for (int round = 0; round < kRounds; ++round) {
    const auto start = Clock::now();
    run();
    const std::chrono::duration<double, std::nano> took = Clock::now() - start;
    best = std::min(best, took.count() / kPlaces);
  }
  return best;
}

template <class N>
std::int64_t whole(typename N::Energy energy) {
  return static_cast<std::int64_t>(energy);
}

template <class N>
double ledger_ns(const std::vector<Tick<N>>& ticks) {
  EnergyLedger<N> ledger;
  const VirtualCoupling<N> spring{typename N::Ratio(0.4F), {}};
  const double ns = fastest_ns([&] {
    for (const Tick<N>& tick : ticks) {
      ledger.move(tick.force_n, tick.moved_mm, 1);
      const auto spring_n = virtual_coupling_force(spring, tick.spring_mm, {});
      const ForceParts<N> parts{.contact = true,
                                .spring = spring_n,
                                .damping = tick.force_n - spring_n,
                                .friction = tick.moved_mm,
                                .cutting = tick.spring_mm};
      ledger.split(parts);
      ledger.send(parts);
    }
  });
  bench::use(whole<N>(ledger.lowest_mj()));
  return ns;
}

template <class N, class Law>
double law_ns(const std::vector<Tick<N>>& ticks, double value) {
  const std::array values{value};
  const Law law(LawSetup(1000, 0, Law::kSettings, values));
  typename Law::State state;
  typename N::Energy taken{};
  DeviceVec<typename N::Real> sent{};
  const double ns = fastest_ns([&] {
    for (const Tick<N>& tick : ticks) {
      taken = sum_of_energy<N>(taken, work_of_hand<N>(sent, tick.moved_mm));
      sent = law.step({tick.force_n, sent, tick.moved_mm, 1, tick.force_n, taken, true}, state);
    }
  });
  bench::use(whole<N>(taken));
  return ns;
}

template <class N>
void add_rows(std::vector<TickCostRow>& rows) {
  const auto ticks = random_ticks<N>();
  rows.push_back({"ledger and observer", N::kName, ledger_ns<N>(ticks)});
  rows.push_back({"passivity", N::kName, law_ns<N, PassivityController<N>>(ticks, 0.045)});
  rows.push_back({"energy_bounding", N::kName, law_ns<N, EnergyBounding<N>>(ticks, 0.0002)});
}

using N = FixedNumbers;

template <class Law>
Law law(double value) {
  const std::array values{value};
  return Law(LawSetup(1000, 0, Law::kSettings, values));
}

Feel feel_of(const PortLoop& loop, const PortLoopRun& run) {
  Feel feel{.stiffness_n_per_mm = loop.stiffness_n_per_mm,
            .peak_n = run.peak_n,
            .delay_ms = 3000,
            .port_minimum_mj = run.port_minimum_mj};
  const auto touch = std::ranges::find_if(run.at_mm, [](double y) { return y < 0; });
  const auto first = static_cast<std::size_t>(touch - run.at_mm.begin());
  const auto let_go = static_cast<std::size_t>(loop.let_go_s * loop.rate_hz);
  const std::size_t settled = let_go * 3 / 4;
  double low_mm = 1e9, high_mm = -1e9;
  for (std::size_t i = first; i < run.at_mm.size(); ++i) {
    if (run.force_n[i] >= loop.push_n / 2) {
      feel.delay_ms = std::min(feel.delay_ms, 1000 * static_cast<double>(i - first) / loop.rate_hz);
    }
    if (i >= let_go && run.at_mm[i] > 0.06) {  // an encoder's step is no contact any more
      feel.air_n = std::max(feel.air_n, std::abs(run.force_n[i]));
    }
    if (i < settled || i >= let_go) continue;
    low_mm = std::min(low_mm, run.at_mm[i]);
    high_mm = std::max(high_mm, run.at_mm[i]);
    feel.depth_mm -= run.at_mm[i] / static_cast<double>(let_go - settled);
  }
  feel.swing_mm = high_mm - low_mm;
  return feel;
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

std::vector<TickCostRow> ledger_costs() {
  std::vector<TickCostRow> rows;
  add_rows<FixedNumbers>(rows);
  add_rows<DoubleNumbers>(rows);
  return rows;
}

std::vector<Feel> stabiliser_feel() {
  struct Hand {
    const char* name;
    double mass_kg, damping_ns_per_m;
  };
  // The device alone, and with a hand that grips it; both stabilisers only know the device.
  constexpr std::array kHands{Hand{"bare", 0.045, 0.2}, Hand{"gripped", 0.145, 3.2}};
  std::vector<Feel> all;
  for (const Hand& hand : kHands) {
    for (const double stiffness : {0.2, 0.4, 1.0, 2.0, 4.0, 10.0}) {
      const PortLoop loop{.mass_kg = hand.mass_kg,
                          .damping_ns_per_m = hand.damping_ns_per_m,
                          .let_go_s = 2,
                          .start_mm = 0.1,
                          .stiffness_n_per_mm = stiffness,
                          .quantum_mm = 0.055,
                          .limits = true};
      const auto add = [&](const char* name, const auto& stabiliser) {
        Feel feel = feel_of(loop, run_port_loop<N>(loop, stabiliser));
        feel.hand = hand.name;
        feel.stabiliser = name;
        all.push_back(feel);
      };
      add("none", NoStabiliser<N>{});
      add("passivity", law<PassivityController<N>>(0.045));
      add("energy_bounding", law<EnergyBounding<N>>(0.0002));
    }
  }
  return all;
}

}  // namespace kerf::energy
