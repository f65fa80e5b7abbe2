// SPDX-License-Identifier: Apache-2.0
#include "controller/plan/gain_margin.hpp"

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>

#include <doctest/doctest.h>

#include "controller/law/law.hpp"
#include "controller/load/load_scene.hpp"
#include "controller/load/scene_json.hpp"
#include "controller/stability/identified_loop.hpp"
#include "controller/stability/sampled_loop.hpp"
#include "tests/servo/support.hpp"
#include "tests/support/errors.hpp"
#include "tests/support/identified_device.hpp"
#include "tests/support/temporary_folder.hpp"

namespace kerf::gain_margin_test {

using namespace kerf::test;

namespace {

LoadedScene scene_of(double stiffness, double damping, int rate_hz) {
  LoadedScene scene = half_space_scene(8);
  scene.path = "mine.toml";
  scene.tools.push_back(ball(8));
  scene.force.stiffness_n_per_mm = stiffness;
  scene.force.damping_ns_per_mm = damping;
  scene.servo.rate_hz = rate_hz;
  return scene;
}

GainMargin linear(const LoadedScene& scene) {
  return gain_margin(scene, PlayFriction::where_it_decides);
}

bool is_line(const std::string& text) {
  return !text.empty() && text.find('\n') == std::string::npos &&
         text.find(';') != std::string::npos;
}

/// F = A d + B d^3 - C v: its slope grows with d, and its damping is that of a linear damper.
template <class N>
struct Hardening {
  static constexpr const char* kName = "hardening";
  static constexpr const char* kMeaning = "for a test";
  static constexpr std::array<LawSetting, 3> kSettings{{{"a", "N/mm", -10, 10, 0.2, "A"},
                                                        {"b", "N/mm^3", 0, 10, 0, "B"},
                                                        {"c", "N s/mm", 0, 1, 0.002, "C"}}};
  using Real = typename N::Real;
  struct State {};
  explicit Hardening(const LawSetup& s) : a(s["a"]), b(s["b"]), c(s["c"]) {}
  DeviceVec<Real> step(const ForceInput<N>& in, State&) const noexcept {
    const double d = double(in.spring_mm.y), v = double(in.velocity_mm_per_s.y);
    return {Real(0), Real(a * d + b * d * d * d - c * v), Real(0)};
  }
  double a, b, c;
};
KERF_REGISTER_FORCE_LAW(Hardening)

/// An estimator that nothing is known of.
template <class N>
struct Mine {
  static constexpr const char* kName = "mine";
  static constexpr const char* kMeaning = "for a test";
  static constexpr std::array<LawSetting, 0> kSettings{};
  struct State {};
  explicit Mine(const LawSetup&) {}
  DeviceVec<typename N::Real> step(const VelocityInput<N>&, State&) const noexcept { return {}; }
};
KERF_REGISTER_VELOCITY_ESTIMATOR(Mine)

LoadedScene with_law(double a, double b, double c) {
  LoadedScene scene = scene_of(0.4, 0.002, 1000);
  scene.force.law = {LawKind::force, "hardening", {{"a", a}, {"b", b}, {"c", c}}};
  return scene;
}

}  // namespace

TEST_CASE("every scene of the project is held with a safe margin at its own rate") {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(KERF_SCENES_DIR)) {
    if (entry.path().extension() != ".toml") continue;
    if (entry.path().stem() == "skull") continue;  // its CT does not come with kerf
    LoadedScene scene = load_scene(entry.path(), {.phantom_size = VoxelGrid{64, 64, 40}});
    // The paper's stiffness goes with the tool's radius, and that with the voxels.
    if (scene.force.model == ForceModel::paper) scene = load_scene(entry.path());
    for (std::size_t i = 0; i < kPersonalityWords.size(); ++i) {
      scene.device.personality = static_cast<Personality>(i);
      CAPTURE(entry.path());
      CAPTURE(std::string(kPersonalityWords[i]));
      ++count;
      const GainMargin margin = linear(scene);
      CHECK(gain_error(scene, margin) == "");
      CHECK(device_limit_error(scene) == "");
      // The friction that holds the paper's force is known of the joint-count devices alone.
      if (scene.force.model == ForceModel::paper && is_cartesian(scene.device.personality))
        continue;
      CHECK(gain_warning(scene, margin) == "");
    }
  }
  CHECK(count >= 12);
}

TEST_CASE("the default coupling has a margin of 2.1, 3.3 with friction at half of its force") {
  const LoadedScene scene = scene_of(0.4, 0.002, 1000);
  const GainMargin margin = gain_margin(scene);
  CHECK(margin.highest_n_per_mm == doctest::Approx(0.8262).epsilon(0.002));
  CHECK(margin.margin() == doctest::Approx(2.07).epsilon(0.01));
  CHECK(margin.with_friction() == doctest::Approx(3.3).epsilon(0.02));
  const std::string lines = gain_lines(scene, margin);
  CHECK(has(lines, "stability_margin=2.07\n"));
  CHECK(lines.find("note=") == std::string::npos);
  CHECK(has(lines, "omni at 1000 Hz: 0.045 kg"));
}

TEST_CASE("at 250 Hz the default coupling is warned of, and what the warning says helps") {
  LoadedScene scene = scene_of(0.4, 0.002, 250);
  const std::string warning = gain_warning(scene, linear(scene));
  CHECK(is_line(warning));
  CHECK(has(warning, "margin of 1.14"));
  CHECK(has(warning, "use at most 0.304 in force.stiffness_n_per_mm"));
  CHECK(gain_error(scene, linear(scene)) == "");
  scene.force.stiffness_n_per_mm = 0.304;
  CHECK(gain_warning(scene, linear(scene)) == "");
}

TEST_CASE("on every device and at every rate, what a warning tells to use is not warned of again") {
  for (const Personality personality :
       {Personality::omni, Personality::falcon, Personality::woodenhaptics}) {
    for (const int rate_hz : {250, 500, 1000, 2000, 4000, 8000}) {
      CAPTURE(static_cast<int>(personality));
      CAPTURE(rate_hz);
      LoadedScene scene = scene_of(0, 0.002, rate_hz);
      scene.device.personality = personality;
      scene.force.stiffness_n_per_mm = linear(scene).highest_n_per_mm;
      const std::string warning = gain_warning(scene, linear(scene));
      const std::string told = "use at most ";
      const std::size_t at = warning.find(told);
      REQUIRE(at != std::string::npos);
      const double most = std::stod(warning.substr(at + told.size()));
      CHECK(most > 0.98 * scene.force.stiffness_n_per_mm / 1.5);
      scene.force.stiffness_n_per_mm = most;
      CHECK(gain_warning(scene, linear(scene)) == "");
    }
  }
}

TEST_CASE("an unstable coupling is refused unless it is asked for") {
  LoadedScene scene = scene_of(0.9, 0.002, 1000);
  CHECK(linear(scene).margin() < 1);
  const std::string refusal = gain_error(scene, linear(scene));
  CHECK(is_line(refusal));
  CHECK(refusal.find("mine.toml: force.stiffness_n_per_mm = 0.9") == 0);
  CHECK(has(refusal, "use at most 0.55"));
  CHECK(has(refusal, "force.unchecked_gain = true"));
  scene.force.unchecked_gain = true;
  CHECK(gain_error(scene, linear(scene)) == "");
  CHECK(gain_warning(scene, linear(scene)).find("it is unstable") != std::string::npos);
  // On both sides of the boundary.
  const double highest = linear(scene).highest_n_per_mm;
  scene.force.unchecked_gain = false;
  scene.force.stiffness_n_per_mm = highest * 0.999;
  CHECK(gain_error(scene, linear(scene)) == "");
  scene.force.stiffness_n_per_mm = highest * 1.001;
  CHECK(gain_error(scene, linear(scene)) != "");
}

TEST_CASE("a damping that no stiffness bears is named with its own bound") {
  const LoadedScene scene = scene_of(0.4, 0.03, 1000);  // the Omni's boundary lies at 0.0243
  CHECK(linear(scene).highest_n_per_mm == 0);
  const std::string refusal = gain_error(scene, linear(scene));
  CHECK(is_line(refusal));
  CHECK(has(refusal, "margin 0.00; use at most 0.0161 in force.damping_ns_per_mm"));
}

TEST_CASE("a real device takes no more than is known of it, each its own") {
  LoadedScene scene = scene_of(0.75, 0.002, 1000);
  CHECK(device_limit_error(scene).find(
            "mine.toml: force.stiffness_n_per_mm = 0.75 is above 0.7, ") == 0);
  CHECK(is_line(device_limit_error(scene)));
  scene.device.personality = Personality::falcon;
  CHECK(device_limit_error(scene) == "");
  scene.force.stiffness_n_per_mm = 0.7;
  scene.device.personality = Personality::omni;
  CHECK(device_limit_error(scene) == "");
  scene.force.damping_ns_per_mm = 0.006;
  CHECK(has(device_limit_error(scene), "force.damping_ns_per_mm = 0.006 is above 0.005"));
  scene.force.unchecked_gain = true;  // a scene alone does not lift it
  CHECK(device_limit_error(scene) != "");
  scene.force.model = ForceModel::paper;  // has no coupling
  CHECK(device_limit_error(scene) == "");
}

TEST_CASE("no device takes gains above those of the source that docs/gains.md names for it") {
  struct Published {
    Personality device;
    const char *name, *source;
    double stiffness, damping;  // N/m and N s/m, as the sources have them
  };
  std::ifstream file(KERF_DOCS "/gains.md", std::ios::binary);
  const std::string page((std::istreambuf_iterator<char>(file)), {});
  for (const Published& row :
       {Published{Personality::omni, "Omni", "of CHAI3D 3.3.0 for omni", 700, 5},
        Published{Personality::falcon, "Falcon", "of CHAI3D 3.3.0 for falcon", 3000, 20},
        Published{Personality::woodenhaptics, "WoodenHaptics",
                  "of its open driver for woodenhaptics", 1000, 8},
        Published{Personality::inverse3, "Inverse3",
                  "that kerf assumes for inverse3; none is published", 1000, 10},
        Published{Personality::touch, "Touch", "of CHAI3D 3.3.0 for touch", 400, 4},
        Published{Personality::omega, "omega.3", "of CHAI3D 3.3.0 for omega", 5000, 30}}) {
    CAPTURE(std::string(row.name));
    const double stiffness = row.stiffness / 1000, damping = row.damping / 1000;
    LoadedScene scene = scene_of(stiffness, damping, 1000);
    scene.device.personality = row.device;
    CHECK(device_limit_error(scene) == "");
    scene.force.stiffness_n_per_mm = 1.001 * stiffness;
    CHECK(is_line(device_limit_error(scene)));
    CHECK(has(device_limit_error(scene), std::string(", the maximum ") + row.source + "; "));
    scene.force.stiffness_n_per_mm = stiffness;
    scene.force.damping_ns_per_mm = 1.001 * damping;
    CHECK(is_line(device_limit_error(scene)));
    // The page has the same two, and a source.
    const std::size_t at = page.find("| " + std::string(row.name) + " | 0.");
    REQUIRE(at != std::string::npos);
    const std::string line = page.substr(at, page.find('\n', at) - at);
    char gains[40];
    std::snprintf(gains, sizeof gains, " | 2 | %g | %g | ", stiffness, damping);
    CHECK(has(line, gains));
    CHECK(has(line, row.device == Personality::inverse3 ? "none: assumed" : "`, "));
  }
}

TEST_CASE("the paper's force is judged with friction, which alone holds it, and never refused") {
  LoadedScene scene = scene_of(0.4, 0.002, 1000);
  scene.force.model = ForceModel::paper;
  scene.force.p0_n_per_mm2 = 0.06;
  GainMargin margin = linear(scene);
  CHECK(margin.damping_ns_per_mm == 0);
  CHECK(margin.margin() < 1);
  CHECK(margin.with_friction() > 1);
  scene.force.p0_n_per_mm2 = 1;
  margin = linear(scene);
  CHECK(margin.with_friction() < 1);
  CHECK(gain_error(scene, margin) == "");
  CHECK(is_line(gain_warning(scene, margin)));
  CHECK(has(gain_warning(scene, margin), "lower force.p0_n_per_mm2 to "));
  scene.force.p0_n_per_mm2 = 0;  // nothing is felt
  CHECK(gain_warning(scene, linear(scene)) == "");
}

TEST_CASE("damping that is unstable without a wall leaves no stiffness, with friction neither") {
  for (const double damping : {0.6, 0.65, 0.7, 0.75, 0.8, 0.95}) {
    const GainMargin margin = gain_margin(scene_of(0.4, damping, 250));
    CHECK(margin.highest_n_per_mm == 0);
    CHECK(margin.with_friction() == 0);
  }
}

TEST_CASE("the ends of what a scene may say give numbers and one line each") {
  for (const int rate_hz : {250, 8000}) {
    for (const double stiffness : {kMinStiffnessNPerMm, kMaxStiffnessNPerMm}) {
      for (const double damping : {0.0, kMaxDampingNsPerMm}) {
        CAPTURE(rate_hz);
        CAPTURE(stiffness);
        CAPTURE(damping);
        const LoadedScene scene = scene_of(stiffness, damping, rate_hz);
        const GainMargin margin = linear(scene);
        CHECK(margin.margin() >= 0);
        CHECK(margin.margin() < std::numeric_limits<double>::infinity());
        CHECK((margin.margin() < 1) == is_line(gain_error(scene, margin)));
        CHECK((margin.margin() < kSafeMargin) == is_line(gain_warning(scene, margin)));
      }
    }
  }
}

TEST_CASE("a force law has the margin of its worst slope, up to the largest force") {
  const GainMargin coupling = gain_margin(scene_of(0.4, 0.002, 1000));
  const GainMargin linear_law = gain_margin(with_law(0.4, 0, 0.002));
  CHECK(linear_law.margin() == doctest::Approx(coupling.margin()).epsilon(1e-6));
  CHECK(linear_law.with_friction() == doctest::Approx(coupling.with_friction()).epsilon(1e-6));
  // 0.2 d + 0.1 d^3 is 3.3 N at 2.999 mm, where it rises by 0.2 + 0.3 d^2 = 2.9 N/mm.
  const LoadedScene hard = with_law(0.2, 0.1, 0.002);
  const GainMargin margin = linear(hard);
  CHECK(margin.spring_mm == doctest::Approx(3.0).epsilon(0.03));
  CHECK(margin.stiffness_n_per_mm == doctest::Approx(2.9).epsilon(0.03));
  CHECK(margin.margin() == doctest::Approx(0.8262 / margin.stiffness_n_per_mm).epsilon(0.01));
  const std::string refusal = gain_error(hard, margin);
  CHECK(is_line(refusal));
  CHECK(refusal.find("mine.toml: force.law hardening at a spring of ") == 0);
  CHECK(has(refusal, "let it rise by at most 0.55 N/mm"));
  CHECK(is_line(device_limit_error(hard)));
  CHECK(has(device_limit_error(hard), "force.law hardening: its steepest stiffness_n_per_mm = "));
  CHECK(has(gain_lines(hard, margin), "steepest=force.law hardening at a spring of "));
  CHECK(device_limit_error(with_law(0.4, 0, 0.002)) == "");
  CHECK(gain_error(with_law(0.4, 0, 0.03), linear(with_law(0.4, 0, 0.03)))
            .find("let it damp by at most 0.0161 N s/mm") != std::string::npos);
  const LoadedScene falling = with_law(-1, 0, 0.002);  // never holds a hand
  CHECK(gain_warning(falling, gain_margin(falling)) == "");
}

TEST_CASE("a filter of the velocity costs margin, and what is not counted is told") {
  LoadedScene scene = scene_of(0.4, 0.002, 1000);
  CHECK(gain_lines(scene, linear(scene)).find("delay 2 ms\n") != std::string::npos);
  const double bare = linear(scene).margin();
  scene.servo.velocity = {LawKind::velocity, "difference", {}};
  CHECK(linear(scene).margin() == bare);
  scene.servo.velocity.settings = {{"tau_ms", 5}};
  SampledLoop loop = unheld_loop(Personality::omni, 1000);
  loop.velocity_filter_s = 0.005;
  CHECK(linear(scene).margin() < 0.9 * bare);
  CHECK(linear(scene).highest_n_per_mm == highest_stiffness(loop, 0.002));
  scene.servo.velocity = {LawKind::velocity, "mine", {}};
  scene.force.stabiliser = {LawKind::stabiliser, "passivity", {}};
  CHECK(gain_lines(scene, linear(scene))
            .find("delay 2 ms, mine counted as a plain difference, passivity not counted\n") !=
        std::string::npos);
}

TEST_CASE("an identified device takes the place of its figures, as unfavourable as its intervals") {
  const TemporaryFolder folder;
  const std::string text = "[force]\nmodel = \"external\"\nstiffness_n_per_mm = 0.1\n[device]\n";
  const auto load = [&](const std::string& lines) {
    return load_scene(folder.write("scene.toml", text + lines));
  };
  static_cast<void>(folder.write("device.toml", kDeviceFile));
  const std::string named = "identified = \"device.toml\"\n";
  const LoadedScene scene = load(named);
  const GainMargin margin = gain_margin(scene);
  // The lowest of the directions has their least friction, and the longest delay.
  const IdentifiedDevice device = parse_identified_device(kDeviceFile, "device.toml");
  const DeviceDirection worst = worst_direction(device, scene.force.damping_ns_per_mm, 1000);
  SampledLoop loop;
  loop.mass_kg = worst.mass_kg;
  loop.viscous_ns_per_mm = worst.along[0] * worst.along[0] * 0.0003 +
                           worst.along[2] * worst.along[2] * 0.0005;  // -0.0001 is none
  loop.delay_s = 0.0019;
  CHECK(margin.highest_n_per_mm ==
        doctest::Approx(highest_stiffness(loop, scene.force.damping_ns_per_mm)).epsilon(1e-9));
  CHECK(margin.highest_n_per_mm != gain_margin(load("")).highest_n_per_mm);
  CHECK(has(gain_lines(scene, margin), "delay 1.9 ms, identified\n"));
  // It changes no tick, so no hash; and a replay does without the file.
  CHECK(canonical_json(scene) == canonical_json(load("")));
  std::filesystem::remove(folder / "device.toml");
  CHECK(has(error_of([&] { static_cast<void>(load(named)); }), "device.toml: not a file"));
  CHECK_FALSE(load_scene(folder / "scene.toml", text + named, {}, {.without_device_file = true})
                  .identified);
  // Of another device it is none.
  CHECK(has(error_of([&] {
              static_cast<void>(
                  load_scene(folder / "scene.toml", {.personality = Personality::falcon}));
            }),
            "--device falcon: the scene's device.identified is of its omni; "));
  static_cast<void>(folder.write("device.toml", device_file_with("0.0018", "0.0081")));
  CHECK(error_of([&] { static_cast<void>(load(named + "[servo]\nrate_hz = 8000\n")); }) ==
        (folder / "device.toml").string() +
            ": device.delay_s is 64 periods and more at servo.rate_hz = 8000; lower the rate");
}

TEST_CASE("each of two arms has the identified device that it names") {
  const TemporaryFolder folder;
  static_cast<void>(folder.write("device.toml", kDeviceFile));
  const LoadedScene scene =
      load_scene(folder.write("scene.toml",
                              "[force]\nmodel = \"external\"\n[[device]]\n[[device]]\n"
                              "identified = \"device.toml\"\n"));
  CHECK_FALSE(scene.identified);
  CHECK(second_arm_of(scene).identified);
}

}  // namespace kerf::gain_margin_test
