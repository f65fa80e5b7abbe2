// SPDX-License-Identifier: Apache-2.0
#include "lab/reproduce/probes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "controller/law/stabilisers.hpp"
#include "controller/load/load_scene.hpp"
#include "controller/plan/compile.hpp"
#include "controller/scene/scene_file.hpp"
#include "controller/stability/axis_simulation.hpp"
#include "controller/stability/sampled_loop.hpp"
#include "hil/device/plant_params.hpp"
#include "hil/hil_error.hpp"
#include "lab/rig/kinematic_arm.hpp"
#include "lab/rig/port_loop.hpp"
#include "shared/text/text.hpp"
#include "shared/wire/omni.hpp"
#include "shared/wire/personality.hpp"

namespace kerf::reproduce {
namespace {

/// A figure that a run needs, its value if none is given, and its range.
struct Figure {
  std::string_view name;
  double standard, lowest, highest;
};

/// The values of `known`, in their order. A member that is none of them, nor one of `others`, is
/// refused.
template <std::size_t kCount>
std::array<double, kCount> figures_of(const Json& given, const std::array<Figure, kCount>& known,
                                      std::initializer_list<std::string_view> others = {}) {
  std::array<double, kCount> values{};
  std::ranges::transform(known, values.begin(), &Figure::standard);
  std::string names;
  for (const Figure& figure : known)
    names += (names.empty() ? "" : ", ") + std::string(figure.name);
  for (const Json::Member& member : given.members()) {
    if (std::ranges::find(others, member.key) != others.end()) continue;
    const auto figure = std::ranges::find(known, member.key, &Figure::name);
    if (figure == known.end()) {
      throw HilError("--probe: " + std::string(member.key) + ": unknown; known: " + names);
    }
    double& value = values[static_cast<std::size_t>(figure - known.begin())];
    try {
      value = member.value.get<double>();
    } catch (const JsonError&) {
      throw HilError("--probe: " + std::string(member.key) + ": is no number; give one");
    }
    if (!(value >= figure->lowest && value <= figure->highest)) {
      throw HilError("--probe: " + std::string(member.key) + ": " + number_text(value) +
                     " is outside of " + number_text(figure->lowest) + " to " +
                     number_text(figure->highest) + "; give a value within");
    }
  }
  return values;
}

/// At most so many, evenly taken.
std::vector<double> thinned(const std::vector<double>& all) {
  constexpr std::size_t kMost = 2000;
  const std::size_t step = (all.size() + kMost - 1) / kMost;
  std::vector<double> some;
  for (std::size_t i = 0; i < all.size(); i += step) some.push_back(all[i]);
  return some;
}

template <class Stabiliser>
Json run_contact(const SampledLoop& loop, const PortLoop& wall, double speed_mm_per_s,
                 const Stabiliser& stabiliser) {
  AxisSimulation axis(loop);
  axis.start(wall.start_mm, -speed_mm_per_s);
  PortLoop seen = wall;
  seen.start_mm = axis.encoder_mm();
  PortServo<DoubleNumbers, Stabiliser> servo(seen, stabiliser);
  const auto ticks = static_cast<std::size_t>(wall.seconds * wall.rate_hz);
  std::vector<double> s, tip_mm, port_mj, observed_mj;
  double peak_n = 0, lowest_port_mj = 0, lowest_observed_mj = 0;
  for (std::size_t tick = 0; tick < ticks; ++tick) {
    const double force_n = servo.step(axis.encoder_mm());
    s.push_back(static_cast<double>(tick) / wall.rate_hz);
    tip_mm.push_back(axis.place_mm());
    port_mj.push_back(0 - axis.motor_work_mj());  // the motors' work is what the port gives
    observed_mj.push_back(servo.port_mj());
    peak_n = std::max(peak_n, std::abs(force_n));
    lowest_port_mj = std::min(lowest_port_mj, port_mj.back());
    lowest_observed_mj = std::min(lowest_observed_mj, observed_mj.back());
    if (!(std::abs(axis.place_mm()) < wall.longest_mm)) break;
    axis.tick(force_n, -wall.push_n);
  }
  const auto third = tip_mm.end() - static_cast<std::ptrdiff_t>((tip_mm.size() + 2) / 3);
  const auto [low, high] = std::minmax_element(third, tip_mm.end());
  return {{"s", thinned(s)},
          {"tip_mm", thinned(tip_mm)},
          {"port_mj", thinned(port_mj)},
          {"observed_mj", thinned(observed_mj)},
          {"lowest_port_mj", lowest_port_mj},
          {"lowest_observed_mj", lowest_observed_mj},
          {"last_port_mj", port_mj.back()},
          {"swing_mm", *high - *low},
          {"peak_n", peak_n},
          {"last_depth_mm", 0 - tip_mm.back()},
          {"ended_early", tip_mm.size() < ticks}};
}

constexpr const char* kCutScene = R"(
[[volume]]
file = "phantom"
shape = "wall"
size = [64, 64, 40]
iso = 0.5

[[tool]]
shape = "ball"
)";

/// `kCutScene` with a ball of this radius, and the settings and tool lines of `figures`.
LoadedScene cut_scene(const Json& figures, double radius_mm) {
  SceneOverrides overrides;
  if (figures.contains("settings")) {
    for (const auto& text : figures.at("settings").get<std::vector<std::string>>()) {
      overrides.settings.push_back(parse_setting(text));
    }
  }
  std::string text = kCutScene + ("radius_mm = " + number_text(radius_mm) + "\n");
  if (figures.contains("tool")) {
    for (const auto& line : figures.at("tool").get<std::vector<std::string>>()) text += line + '\n';
  }
  LoadedScene scene = load_scene("cut.toml", text, overrides);
  scene.device.torque_scale = PlantParams().torque_scale();
  scene.limits.continuous_force_n =
      scene.limits.force_n;  // motors that get weaker would look like wear
  return scene;
}

/// Moves the arm from the inkwell around the solid to the height `y_mm` above it. The inkwell is
/// lower than the solid.
void go_over_solid(AnyServo& servo, KinematicOmni& arm, double rate_hz, double y_mm) {
  constexpr double kAboveMm = 30, kBesideMm = -60;
  constexpr int kTravelTicks = 400;
  arm_at(servo, arm, 0, kAboveMm, kBesideMm, std::max(1, static_cast<int>(rate_hz) / 1000));
  for (int i = 1; i <= kTravelTicks; ++i) {
    const double s = static_cast<double>(i) / kTravelTicks;
    static_cast<void>(servo.step(arm.at(0, kAboveMm + s * (y_mm - kAboveMm), (1 - s) * kBesideMm)));
  }
}

}  // namespace

Json contact_energy(const Json& figures) {
  constexpr double kMostTicks = 2e6;
  const auto [mass, viscous, friction, quantum, rate, delay, stiffness, passivity, push, speed,
              start, hand_kg, hand_ns_per_mm, hand_n_per_mm, seconds] =
      figures_of(
          figures,
          std::array{Figure{"mass_kg", 0.1, 0.001, 100}, Figure{"viscous_ns_per_mm", 0.0002, 0, 2},
                     Figure{"friction_n", 0, 0, 100}, Figure{"quantum_mm", 0, 0, 10},
                     Figure{"rate_hz", 1000, 10, 100000},
                     Figure{"delay_periods", 0, 0, kMaxDelayPeriods},
                     Figure{"stiffness_n_per_mm", 1, 0, 1e6}, Figure{"passivity", 0, 0, 1},
                     Figure{"push_n", 1, -1000, 1000}, Figure{"speed_mm_per_s", 0, 0, 2000},
                     Figure{"start_mm", 0, 0, 1000}, Figure{"hand_kg", 0, 0, 100},
                     Figure{"hand_ns_per_mm", 0, 0, 2}, Figure{"hand_n_per_mm", 0, 0, 100},
                     Figure{"seconds", 3, 0.01, 600}});
  if (seconds * rate > kMostTicks) {
    throw HilError("--probe: seconds: " + number_text(seconds) + " at " + number_text(rate) +
                   " Hz are more than two million ticks; give fewer");
  }
  SampledLoop loop;
  loop.mass_kg = mass;
  loop.viscous_ns_per_mm = viscous;
  loop.coulomb_n = friction;
  loop.hand = {hand_kg, hand_ns_per_mm, hand_n_per_mm};
  loop.quantum_mm = quantum;
  loop.period_s = 1 / rate;
  loop.delay_s = delay / rate;
  PortLoop wall;
  wall.push_n = push > 0 ? push + friction : push;
  wall.start_mm = start;
  wall.stiffness_n_per_mm = stiffness;
  wall.rate_hz = rate;
  wall.quantum_mm = quantum;
  wall.seconds = seconds;
  using N = DoubleNumbers;
  if (passivity == 0) return run_contact(loop, wall, speed, NoStabiliser<N>{});
  using Controller = PassivityController<N>;
  const std::array values{
      std::clamp(mass, Controller::kSettings[0].lo, Controller::kSettings[0].hi)};
  return run_contact(loop, wall, speed,
                     Controller(LawSetup(rate, quantum / 2, Controller::kSettings, values)));
}

Json cut_rate(const Json& figures) {
  const auto [press, radius, seconds] =
      figures_of(figures,
                 std::array{Figure{"press_n", 1, 0.05, 3}, Figure{"radius_mm", 0.5, 0.2, 2},
                            Figure{"seconds", 2, 0.1, 60}},
                 {"settings", "tool"});
  LoadedScene scene = cut_scene(figures, radius);
  const auto h = scene.volumes[0].image.spacing_mm;
  const double mm3_per_step = h[0] * h[1] * h[2] / kDensityMax, rate_hz = scene.servo.rate_hz;
  const std::unique_ptr<AnyServo> servo = compile(scene);
  KinematicOmni arm;
  double y_mm = radius + 2;
  go_over_solid(*servo, arm, rate_hz, y_mm);
  // The hand sinks until its press is the wanted one: a fifth of the missing spring in each tick,
  // so that it follows the cut and does not swing; never faster than 50 mm/s.
  const double spring_n_per_mm = device_stiffness_n_per_mm(scene), most_mm = 50 / rate_hz;
  constexpr double kSettleS = 1;
  const auto ticks = static_cast<std::size_t>((kSettleS + seconds) * rate_hz);
  const auto settled = static_cast<std::size_t>(kSettleS * rate_hz);
  std::vector<double> removed_mm3;
  double pressed_n = 0, speed = 0;
  double missing_n = press;
  for (std::size_t tick = 0; tick < ticks; ++tick) {
    y_mm -= std::clamp(missing_n / spring_n_per_mm / 5, -most_mm, most_mm);
    const ServoOutput out = servo->step(arm.at(0, y_mm, 0));
    missing_n = press - out.press_n;
    if (tick < settled) continue;
    removed_mm3.push_back(static_cast<double>(out.removed_steps) * mm3_per_step);
    pressed_n += out.press_n;
    speed += out.spindle_ratio;
  }
  const auto rate = [&](std::size_t from, std::size_t to) {
    double sum_mm3 = 0;
    for (std::size_t i = from; i < to; ++i) sum_mm3 += removed_mm3[i];
    return sum_mm3 / static_cast<double>(to - from) * rate_hz;
  };
  const std::size_t count = removed_mm3.size(), quarter = std::max<std::size_t>(1, count / 4);
  return {{"rate_mm3_per_s", rate(0, count)},
          {"first_mm3_per_s", rate(0, quarter)},
          {"last_mm3_per_s", rate(count - quarter, count)},
          {"press_n", pressed_n / static_cast<double>(count)},
          {"spindle_ratio", speed / static_cast<double>(count)}};
}

Json device_table() {
  Json table;
  for (const DeviceFigures& device : kDeviceFigures) {
    const DeviceKind& kind = kind_of(device.personality);
    table[kind.word] = {{"mass_kg", device.mass_kg},
                        {"viscous_ns_per_mm", device.viscous_ns_per_mm},
                        {"friction_n", device.coulomb_n},
                        {"quantum_mm", device.quantum_mm},
                        {"delay_s", device.delay_s},
                        {"stiffness_n_per_mm", device.highest_stiffness_n_per_mm},
                        {"damping_ns_per_mm", device.highest_damping_ns_per_mm},
                        {"peak_n", kind.forces.peak_n},
                        {"continuous_n", kind.forces.continuous_n}};
  }
  const LimitSettings limits;
  table["scene"] = {{"peak_n", limits.force_n},
                    {"continuous_n", limits.continuous_force_n},
                    {"cut_threshold_n", CutSettings().threshold_n},
                    {"upper_link_mm", omni::kUpperLinkMm},
                    {"forearm_mm", omni::kForearmMm}};
  return table;
}

}  // namespace kerf::reproduce
