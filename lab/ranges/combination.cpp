// SPDX-License-Identifier: Apache-2.0
#include "lab/ranges/combination.hpp"

#include <cstdint>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <memory>
#include <optional>
#include <system_error>
#include <utility>

#include <unistd.h>

#include "controller/load/scene_load.hpp"
#include "controller/plan/compile.hpp"
#include "controller/scene/scene_error.hpp"
#include "controller/volume/file/volume_write.hpp"
#include "hil/hil_error.hpp"
#include "lab/ranges/hard_hand.hpp"
#include "lab/ranges/watched_servo.hpp"
#include "lab/rig/body.hpp"

namespace kerf::ranges {
namespace {

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

/// Nothing where the scene is refused; the outcome tells why.
std::optional<Loaded> load(const KeyTexts& texts, NumericKind numeric,
                           const std::filesystem::path& file, Outcome& outcome) {
  std::ofstream(file) << scene_text(texts);
  try {
    auto scene = std::make_unique<LoadedScene>(load_scene(file, {.numeric = numeric}));
    auto servo = plan_scene(*scene);
    return Loaded{std::move(scene), std::move(servo)};
  } catch (const SceneError& error) {
    outcome.refused = true;
    outcome.refusal = error.what();
    if (!is_one_clear_line(outcome.refusal))
      outcome.violations.push_back({"line", outcome.refusal});
  } catch (const std::exception& error) {
    outcome.violations.push_back({"line", std::string("no SceneError: ") + error.what()});
  }
  return std::nullopt;
}

void look_at_mark(const Mark& mark, const ServoOutput& out, bool motors, Rules& rules) {
  const auto phase = std::to_string(static_cast<int>(out.phase));
  switch (mark.kind) {
    case Mark::Kind::active:
      if (out.phase == Phase::active && out.motors_on == motors) return;
      return rules.broken("active", "phase " + phase);
    case Mark::Kind::faded:
      if (!out.motors_on && out.force_n == std::array<double, 3>{}) return;
      return rules.broken("faded", "phase " + phase);
    case Mark::Kind::armed:
      if (out.phase == Phase::armed && out.fault == Fault::none) return;
      return rules.broken("armed", "phase " + phase);
  }
}

/// Where a run ended.
struct End {
  std::uint64_t hash = 0;
  std::unique_ptr<ServoSnapshot> recovered;
};

/// The end after the reports from `from` on.
std::uint64_t play(CompiledScene& servo, const HardHand& hand, std::size_t from,
                   std::size_t volumes) {
  ServoOutput out;
  for (std::size_t i = from; i < hand.reports.size(); ++i) out = servo.step(hand.reports[i]);
  return hash_of(servo, volumes, out);
}

End play_watched(CompiledScene& servo, const HardHand& hand, const LoadedScene& scene, Rules& rules,
                 Outcome& outcome) {
  End end;
  ServoOutput out;
  const bool motors = scene.device.torque_scale.has_value();
  auto mark = hand.marks.begin();
  const std::uint64_t before = sum_of(servo, scene.volumes.size());
  std::uint64_t removed = 0;
  for (std::size_t i = 0; i < hand.reports.size(); ++i) {
    if (i == hand.recovered) end.recovered = servo.keep();
    out = servo.step(hand.reports[i]);
    rules.look_at(hand.reports[i], out);
    if (mark != hand.marks.end() && mark->tick == i) look_at_mark(*mark++, out, motors, rules);
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

SceneFolder::SceneFolder() {
  std::error_code fault;
  std::string name = (std::filesystem::temp_directory_path(fault) / "kerf-ranges.XXXXXX").string();
  if (fault || mkdtemp(name.data()) == nullptr) {
    throw HilError("TMPDIR: no folder can be made there; set it to one that can be written");
  }
  path_ = name;
  write_volume(half_space(), path_ / "solid.nrrd", VolumeEncoding::raw);
  std::ofstream(path_ / "bur.stl") << octahedron();
}

SceneFolder::~SceneFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

Outcome load_combination(const KeyTexts& texts, NumericKind numeric,
                         const std::filesystem::path& file) {
  Outcome outcome;
  static_cast<void>(load(texts, numeric, file, outcome));
  return outcome;
}

Outcome run_combination(const KeyTexts& texts, NumericKind numeric,
                        const std::filesystem::path& file) {
  Outcome outcome;
  std::optional<Loaded> loaded = load(texts, numeric, file, outcome);
  if (!loaded) return outcome;
  LoadedScene& scene = *loaded->scene;
  CompiledScene& servo = *loaded->servo;
  const HardHand hand = hard_hand(scene);
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
