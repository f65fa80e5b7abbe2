// SPDX-License-Identifier: Apache-2.0
#include "tests/studies/ranges/combination.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <exception>
#include <fstream>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include "controller/input/load_error.hpp"
#include "controller/load/load_scene.hpp"
#include "controller/plan/compile.hpp"
#include "controller/volume/file/volume_io.hpp"
#include "tests/rig/geometry.hpp"
#include "tests/rig/kinematic_hand.hpp"
#include "tests/studies/ranges/rules.hpp"

namespace kerf::ranges {
namespace {

using Place = DeviceVec<double>;

/// Writes the reports one after the other.
class Writer {
 public:
  Writer(const LoadedScene& scene, StressInput& out)
      : hand_(scene.device), rate_hz_(scene.servo.rate_hz), out_(out) {
    const double scale = scene.device.workspace_scale;
    const double voxel_mm = touched_volumes(scene.volumes).voxel_mm;
    const double radius_mm = scene.tools[scene.active_tool].radius_mm;
    constexpr double kReachMm = 30;  // of every device, about its origin
    // Half of the fastest that is allowed, for the 40 ms of a press.
    const double way_mm =
        std::min(5 * voxel_mm / scale, 0.5 * scene.limits.speed_mm_per_s * kPressMs / 1000);
    top_.y = std::clamp((radius_mm + 2 * voxel_mm) / scale, -kReachMm, kReachMm);
    deep_ = top_;
    deep_.y -= std::min(way_mm, kReachMm);
    aside_ = deep_;
    aside_.x += std::min(way_mm, kReachMm);
    aside_.z += std::min(way_mm, kReachMm) / 3;
    // An Omni is parked in its inkwell, from which its encoders count; others anywhere.
    dock_ = scene.device.personality == Personality::omni ? KinematicHand::Counts{}
                                                          : hand_.counts_at(top_);
    at_ = dock_;
  }

  /// Parks at rest, until it is calibrated; then leaves, until the force has faded in.
  void arm() {
    glide(dock_, 20, true);
    rest(56, true);
    expect(Expectation::Kind::armed);
    out_.recovered = out_.reports.size();
    // Over the solid: a proxy that came through it would stay below.
    constexpr double kHighMm = 70;
    glide(hand_.counts_at({0, kHighMm, -kHighMm}), 5, true);
    glide(hand_.counts_at({0, kHighMm, 0}), 5, true);
    glide(hand_.counts_at(top_), 10, true);
    rest(101, false);
    expect(Expectation::Kind::active);
  }
  void press() {
    move(deep_, kPressMs);
    rest(10, false);
    slide(40, [](std::size_t) { return true; });
  }
  /// Every third report is lost, then the same one comes again and again.
  void lose() {
    slide(20, [](std::size_t i) { return i % 3 != 0; });
    const DeviceReport same = out_.reports.back();
    for (std::size_t i = ticks(5); i > 0; --i) out_.reports.push_back(same);
  }
  /// One report far away, and back; then counts at the ends of 16 bits, and a lost homing.
  void jump() {
    const KinematicHand::Counts here = at_;
    say({here[0] + 3000, here[1] - 2000, here[2] + 2500});
    say(here);
    constexpr double kEnd = std::numeric_limits<std::int16_t>::max();
    for (const double end : {kEnd, -kEnd - 1, 0.0}) say({end, end, -end});
    say(here);
    out_.reports.back().parked = true;  // for one report
    say(here);
    out_.reports.back().homed = false;
    for (std::size_t i = ticks(5); i > 0; --i) say(here);
  }
  void silence() {
    for (std::size_t i = ticks(25); i > 0; --i) out_.reports.push_back({});
    expect(Expectation::Kind::faded);
    rest(5, false);
  }

 private:
  static constexpr double kPressMs = 40;

  [[nodiscard]] std::size_t ticks(double ms) const {
    return static_cast<std::size_t>(std::ceil(ms * rate_hz_ / 1000)) + 1;
  }
  void expect(Expectation::Kind kind) {
    out_.expectations.push_back({kind, out_.reports.size() - 1});
  }
  void say(const KinematicHand::Counts& counts, bool parked = false) {
    out_.reports.push_back(hand_.report(counts, parked));
    out_.reports.back().button1 = true;  // the pedal of scenes that have one
  }
  void rest(double ms, bool parked) {
    for (std::size_t i = ticks(ms); i > 0; --i) say(at_, parked);
  }
  /// By joints.
  void glide(const KinematicHand::Counts& to, double ms, bool parked) {
    const KinematicHand::Counts from = at_;
    // No encoder steps half of its 16 bits in a tick.
    const std::size_t steps = std::max<std::size_t>(ticks(ms), 5);
    for (std::size_t i = 1; i <= steps; ++i) {
      const double s = static_cast<double>(i) / static_cast<double>(steps);
      for (std::size_t j = 0; j < 3; ++j) at_[j] = from[j] + s * (to[j] - from[j]);
      say(at_, parked);
    }
    place_ = top_;
  }
  void move(const Place& to, double ms) {
    const Place from = place_;
    const std::size_t steps = ticks(ms);
    for (std::size_t i = 1; i <= steps; ++i) {
      place_ = from + (to - from) * (static_cast<double>(i) / static_cast<double>(steps));
      at_ = hand_.counts_at(place_);
      say(at_);
    }
  }
  /// To the side and back while the wrist turns; reports that `comes` refuses are lost.
  template <class Comes>
  void slide(double ms, Comes&& comes) {
    const std::size_t steps = ticks(ms);
    for (std::size_t i = 1; i <= steps; ++i) {
      const double s = static_cast<double>(i) / static_cast<double>(steps);
      place_ = deep_ + (aside_ - deep_) * (1 - std::abs(2 * s - 1));
      hand_.turn_wrist(0.5 + 0.3 * s);
      at_ = hand_.counts_at(place_);
      say(at_);
      if (!comes(i)) out_.reports.back() = {};
    }
  }

  KinematicHand hand_;
  double rate_hz_;
  StressInput& out_;
  Place top_, deep_, aside_, place_;
  KinematicHand::Counts dock_{}, at_{};
};

VolumeImage half_space() {
  constexpr std::int32_t kEdge = 32, kSurface = 20, kEnamel = 4;
  VolumeImage image;
  const extremes::Body body = extremes::body_of(
      {kEdge, kEdge, kEdge}, [](extremes::Point p) { return 0.5 - (p[2] - kSurface) / 2; });
  image.grid = body.grid;
  image.density = body.density;
  image.spacing_mm = {0.25, 0.25, 0.25};
  for (std::int32_t z = 0; z < kEdge; ++z) {
    const Label label = z > kSurface + 2 ? 0 : z > kSurface - kEnamel ? 1 : 2;
    image.labels.insert(image.labels.end(), std::size_t{kEdge} * kEdge, label);
  }
  return image;
}

/// About the y axis, 2 mm across.
std::string octahedron() {
  std::string text = "solid bur\n";
  for (const int x : {1, -1}) {
    for (const int y : {1, -1}) {
      for (const int z : {1, -1}) {
        const auto corner = [](int a, int b, int c) {
          return "vertex " + std::to_string(a) + " " + std::to_string(b) + " " + std::to_string(c) +
                 "\n";
        };
        const bool even = x * y * z > 0;  // outward by the right hand
        text += "facet normal 0 0 0\nouter loop\n" + corner(x, 0, 0) +
                (even ? corner(0, y, 0) + corner(0, 0, z) : corner(0, 0, z) + corner(0, y, 0)) +
                "endloop\nendfacet\n";
      }
    }
  }
  return text + "endsolid bur\n";
}

bool is_one_clear_line(const std::string& line) {
  const std::size_t place = line.find(": ");
  return line.find('\n') == std::string::npos && place != std::string::npos &&
         line.find("; ", place) != std::string::npos;
}

/// A scene and the servo that is planned for it.
struct Loaded {
  std::unique_ptr<LoadedScene> scene;
  std::unique_ptr<CompiledScene> servo;
};

/// Empty if the scene is refused; the outcome has the reason.
std::optional<Loaded> load(const KeyTexts& texts, NumericKind numeric,
                           const std::filesystem::path& file, SceneOutcome& outcome) {
  std::ofstream(file) << scene_text(texts);
  try {
    auto scene = std::make_unique<LoadedScene>(load_scene(file, {.numeric = numeric}));
    auto servo = plan_scene(*scene);
    return Loaded{std::move(scene), std::move(servo)};
  } catch (const LoadError& error) {
    outcome.refused = true;
    outcome.refusal = error.what();
    if (!is_one_clear_line(outcome.refusal))
      outcome.violations.push_back({"line", outcome.refusal});
  } catch (const std::exception& error) {
    outcome.violations.push_back({"line", std::string("no LoadError: ") + error.what()});
  }
  return std::nullopt;
}

void check_expectation(const Expectation& expected, const ServoOutput& out, bool motors,
                       Rules& rules) {
  const auto phase = std::to_string(static_cast<int>(out.phase));
  switch (expected.kind) {
    case Expectation::Kind::active:
      if (out.phase == Phase::active && out.motors_on == motors) return;
      return rules.broken("active", "phase " + phase);
    case Expectation::Kind::faded:
      if (!out.motors_on && out.commanded_force_n == std::array<double, 3>{}) return;
      return rules.broken("faded", "phase " + phase);
    case Expectation::Kind::armed:
      if (out.phase == Phase::armed && out.fault == Fault::none) return;
      return rules.broken("armed", "phase " + phase);
  }
}

/// The end of a run.
struct End {
  std::uint64_t hash = 0;
  std::unique_ptr<ServoSnapshot> recovered;
};

/// The end after the reports from `from` on.
std::uint64_t play(CompiledScene& servo, const StressInput& hand, std::size_t from,
                   std::size_t volumes) {
  ServoOutput out;
  for (std::size_t i = from; i < hand.reports.size(); ++i) out = servo.step(hand.reports[i]);
  return hash_of(servo, volumes, out);
}

End play_watched(CompiledScene& servo, const StressInput& hand, const LoadedScene& scene,
                 Rules& rules, SceneOutcome& outcome) {
  End end;
  ServoOutput out;
  const bool motors = scene.device.torque_scale.has_value();
  auto due = hand.expectations.begin();
  const std::uint64_t before = sum_of(servo, scene.volumes.size());
  std::uint64_t removed = 0;
  for (std::size_t i = 0; i < hand.reports.size(); ++i) {
    if (i == hand.recovered) end.recovered = servo.keep();
    out = servo.step(hand.reports[i]);
    rules.look_at(hand.reports[i], out);
    if (due != hand.expectations.end() && due->tick == i)
      check_expectation(*due++, out, motors, rules);
    removed += out.removed_steps;
    outcome.felt = outcome.felt || out.contact;
    outcome.faulted = outcome.faulted || out.fault != Fault::none;
  }
  const std::uint64_t after = sum_of(servo, scene.volumes.size());
  if (before - after != removed) {
    rules.broken("removed", std::to_string(before - after) + " steps gone, " +
                                std::to_string(removed) + " told");
  }
  outcome.cut = removed > 0;
  outcome.ticks = hand.reports.size();
  end.hash = hash_of(servo, scene.volumes.size(), out);
  return end;
}

}  // namespace

StressInput hard_hand(const LoadedScene& scene) {
  StressInput out;
  Writer writer(scene, out);
  writer.arm();
  writer.press();
  writer.lose();
  writer.silence();
  writer.arm();
  writer.press();
  writer.jump();
  writer.arm();
  writer.press();
  return out;
}

SceneFolder::SceneFolder() : folder_("kerf-ranges") {
  write_volume(half_space(), path() / "solid.nrrd", VolumeEncoding::raw);
  std::ofstream(path() / "bur.stl") << octahedron();
}

SceneOutcome load_combination(const KeyTexts& texts, NumericKind numeric,
                              const std::filesystem::path& file) {
  SceneOutcome outcome;
  static_cast<void>(load(texts, numeric, file, outcome));
  return outcome;
}

SceneOutcome run_combination(const KeyTexts& texts, NumericKind numeric,
                             const std::filesystem::path& file) {
  SceneOutcome outcome;
  std::optional<Loaded> loaded = load(texts, numeric, file, outcome);
  if (!loaded) return outcome;
  LoadedScene& scene = *loaded->scene;
  CompiledScene& servo = *loaded->servo;
  const StressInput hand = hard_hand(scene);
  LoadedScene twin = scene;
  servo.take(scene);
  const auto other = compile(twin);
  const std::size_t volumes = scene.volumes.size();
  Rules rules(scene, most_samples(servo.costs(), scene));
  const End end = play_watched(servo, hand, scene, rules, outcome);
  if (play(*other, hand, 0, volumes) != end.hash) rules.broken("again", "other bits");
  other->restore(*end.recovered);
  if (play(*other, hand, hand.recovered, volumes) != end.hash) {
    rules.broken("recovered", "other bits");
  }
  outcome.violations = rules.violations();
  return outcome;
}

}  // namespace kerf::ranges
