// SPDX-License-Identifier: Apache-2.0
// Colours and opacities: palette, transfer function, its file, and the pictures that show them.
#include "visualizer/scene/appearance.hpp"

#include <array>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <doctest/doctest.h>
#include <rapidcheck.h>
#include <unistd.h>

#include "tests/visualizer/gl/gl_fixture.hpp"
#include "tests/visualizer/render/renderer_fixture.hpp"
#include "visualizer/render/volume_textures.hpp"
#include "visualizer/scene/visualizer_error.hpp"

namespace kerf::appearance_test {

using namespace kerf::test;
namespace fs = std::filesystem;

namespace {

const GradientPlan kCorners(GradientFilter::corners);

const std::vector<MaterialView> kTooth{{"none", 0.0, {0, 0, 0}},
                                       {"enamel", 0.81, {1, 1, 1}},
                                       {"dentin", 0.45, {0, 1, 0}},
                                       {"pulp", 0.14, {1, 0, 0}}};

}  // namespace

TEST_CASE("air is not seen, what the materials are made of is, and between the two is a ramp") {
  for (const bool labels : {false, true}) {
    const TransferFunction made = make_transfer_function(kTooth, 29491, labels);
    CHECK(made.presence(0.0) == 0.0);
    CHECK(made.presence(1.0) == 1.0);
    CHECK(made.presence(0.5 * (made.empty + made.full)) == doctest::Approx(0.5));
    CHECK(made.presence(29491 / kDensityMax) == doctest::Approx(1.0).epsilon(1e-4));
  }
  // Pulp lies below the iso density of a tooth, and is seen where it has a label.
  CHECK(make_transfer_function(kTooth, 29491, true).presence(0.28) == doctest::Approx(1.0));
}

TEST_CASE("a CT whose air is far from black is seen through its air, not as a block") {
  constexpr Density kAir = 19'700, kNoise = 900, kIso = 32'000;
  std::vector<Density> density(3000, kAir);
  for (std::size_t i = 0; i < density.size(); i += 3) density[i] = kAir - kNoise;
  for (std::size_t i = 1; i < density.size(); i += 3) density[i] = kAir + kNoise;
  for (std::size_t i = 0; i < density.size(); i += 4) density[i] = 50'000;
  const Density air = air_level(density, kIso);
  CHECK(air <= kAir);
  CHECK(air > kAir - 256);
  const TransferFunction made = make_transfer_function(kTooth, kIso, false, air);
  CHECK(made.presence((kAir + kNoise) / kDensityMax) == 0.0);
  CHECK(made.presence(kIso / kDensityMax) == doctest::Approx(1.0));
  CHECK(make_transfer_function(kTooth, kIso, false).presence(kAir / kDensityMax) > 0.3);
}

TEST_CASE("what a border shows outside of a surface is no thicker in coarser voxels") {
  const auto of = [](double longest_mm) {
    return make_transfer_function(kTooth, 29491, false, 0, longest_mm);
  };
  const TransferFunction usual = of(kOpacityMm);
  CHECK(usual.empty == make_transfer_function(kTooth, 29491, false).empty);
  for (const double longest_mm : {0.25, 0.5, 3.0}) {
    CAPTURE(longest_mm);
    const TransferFunction coarse = of(longest_mm);
    // A ramp of presence on the same way of a border that is as much wider.
    CHECK((coarse.full - coarse.empty) * longest_mm ==
          doctest::Approx((usual.full - usual.empty) * kOpacityMm));
    CHECK(coarse.border_mm == doctest::Approx(usual.border_mm));
    CHECK(coarse.full == usual.full);
  }
  CHECK(of(0.05).empty == usual.empty);  // no wider than down to air
  const TransferFunction endless = of(1e12);
  CHECK(static_cast<float>(endless.empty) < static_cast<float>(endless.full));
}

TEST_CASE("air is 0 where nothing is below iso, and leaves a ramp where all is just below") {
  const std::vector<Density> full(100, 65535);
  CHECK(air_level(full, 30'000) == 0);
  CHECK(air_level({}, 30'000) == 0);
  const std::vector<Density> grey(100, 29'999);
  const TransferFunction made = make_transfer_function({}, 30'000, false, air_level(grey, 30'000));
  CHECK(made.full - made.empty > 0.1 * made.full);
}

TEST_CASE("the softer a material, the more opaque: hard enamel shows what is below") {
  const Palette look = make_transfer_function(kTooth, 29491, true).materials;
  CHECK(look[1][1].a < look[1][2].a);
  CHECK(look[1][2].a < look[1][3].a);
  CHECK(look[0][255].a == look[1][1].a);
  CHECK(look[0][0].a == look[1][3].a);
  CHECK(look[1][0].a == 0.0F);  // no material
}

TEST_CASE("no density below the lowest that is seen is seen after it was rounded to 8 bits") {
  CHECK(rc::check([] {
    const auto iso = *rc::gen::inRange<Density>(1, 65535);
    const TransferFunction made = make_transfer_function({}, iso, false);
    const auto density = *rc::gen::inRange<Density>(0, 65535);
    std::vector<GradientTexel> texel;
    const std::vector<Density> volume{density};
    fill_gradient_texels(kCorners, {1, 1, 1}, volume, {{0, 0, 0}, {1, 1, 1}}, texel);
    if (density < made.lowest_seen()) RC_ASSERT(made.presence(texel[0].density / 255.0) == 0.0);
  }));
}

TEST_CASE("a density takes the colour of the densest material it reaches, a label its own") {
  const std::vector<MaterialView> materials{{"none", 0.0, {0, 0, 0}},
                                            {"enamel", 0.8, {1, 1, 1}},
                                            {"dentin", 0.4, {0, 1, 0}},
                                            {"pulp", 0.1, {1, 0, 0}}};
  const auto palette = make_palette(materials);
  const auto by_density = [&](double density) {
    return glm::vec3(palette[0][static_cast<std::size_t>(density * 255.0 + 0.5)]);
  };
  CHECK(by_density(0.0) == glm::vec3(1, 0, 0));
  CHECK(by_density(0.2) == glm::vec3(1, 0, 0));
  CHECK(by_density(0.6) == glm::vec3(0, 1, 0));
  CHECK(by_density(1.0) == glm::vec3(1, 1, 1));
  const glm::vec3 border = by_density(0.4);
  CHECK(border.x == doctest::Approx(0.5).epsilon(0.2));  // half pulp, half dentin
  CHECK(glm::vec3(palette[1][2]) == glm::vec3(0, 1, 0));
}

TEST_CASE("without materials everything has one colour that is seen") {
  const auto palette = make_palette({});
  for (const auto& row : palette) {
    for (const glm::vec4& colour : row) CHECK(colour == palette[0][0]);
  }
  CHECK(palette[0][0].g > 0.3F);
}

namespace fs = std::filesystem;

namespace {

std::string refusal_of(std::string_view text) {
  try {
    static_cast<void>(parse_transfer(text, "t.toml"));
  } catch (const VisualizerError& problem) {
    return problem.what();
  }
  return "accepted";
}

}  // namespace

TEST_CASE("opacities come back from a file as they went, whatever a material is called") {
  const fs::path file =
      fs::temp_directory_path() / ("kerf-opacities-" + std::to_string(::getpid()) + ".toml");
  CHECK(rc::check([&](const std::vector<std::string>& names) {
    Opacities opacities{{"enamel", 0.125}, {"tooth \"36\"", 1.0}, {"", 0.0}};
    for (std::string name : names) {
      for (char& c : name) c = static_cast<char>(' ' + static_cast<unsigned char>(c) % 95);
      opacities[name] = *rc::gen::inRange(0, 1001) / 1000.0;
    }
    write_transfer(file, opacities);
    RC_ASSERT(read_transfer(file) == opacities);
  }));
  fs::remove(file);
  CHECK(parse_transfer("[opacity]\n", "t.toml").empty());
  CHECK(parse_transfer("opacity = {pulp = 1}", "t.toml") == Opacities{{"pulp", 1.0}});
}

TEST_CASE("a bad transfer function is refused in one line: location, value, way out") {
  CHECK(refusal_of("") == "t.toml: there is no table [opacity]; write one");
  CHECK(refusal_of("[opacity]\nenamel = 1.5") ==
        "t.toml:2: opacity.enamel = 1.5 is no opacity; give a number from 0 to 1");
  CHECK(refusal_of("[opacity]\nenamel = \"a\\nb\"").find("\n") == std::string::npos);
  CHECK(refusal_of("[opacity]\nenamel = nan").find("nan is no opacity") != std::string::npos);
  CHECK(refusal_of("[opacity]\n\nenamel = []").find("t.toml:3: ") == 0);
  CHECK(refusal_of("opacity = 1").find("known is the table [opacity]") != std::string::npos);
  CHECK(refusal_of("[opacity]\n[colour]") ==
        "t.toml:2: colour is not known here; known is the table [opacity]");
  CHECK(refusal_of("[!]").find("correct the TOML syntax") != std::string::npos);
  SceneView scene;
  scene.materials = kTooth;
  check_materials({{"pulp", 0.5}}, scene, "t.toml");
  CHECK_THROWS_WITH_AS(
      check_materials({{"none", 0.5}}, scene, "t.toml"),
      "t.toml: opacity.none is no material of this scene; it has enamel, dentin, pulp",
      VisualizerError);
}

TEST_CASE("whatever a file holds, it gives opacities from 0 to 1 or one line") {
  const std::array<std::string, 12> kPieces{"[opacity]", "enamel", "=", "0.3",   "\n",   "[",
                                            "]",         "\"",     "{", "1e999", "# \t", "\xff"};
  CHECK(rc::check([&](const std::string& noise) {
    const auto picks = *rc::gen::container<std::vector<std::size_t>>(
        rc::gen::inRange(std::size_t{0}, kPieces.size() + 1));
    std::string text = "[opacity]\n";
    for (const std::size_t pick : picks) text += pick < kPieces.size() ? kPieces[pick] : noise;
    try {
      for (const auto& [material, opacity] : parse_transfer(text, "t.toml")) {
        RC_ASSERT(opacity >= 0.0);
        RC_ASSERT(opacity <= 1.0);
      }
    } catch (const VisualizerError& problem) {
      RC_ASSERT(std::string(problem.what()).find('\n') == std::string::npos);
    }
  }));
}

TEST_CASE("a material has the opacity that was chosen, the others the one by their hardness") {
  std::vector<MaterialView> materials = kTooth;
  materials[2].opacity = 0.7;
  const Palette before = make_palette(kTooth);
  const Palette after = make_palette(materials);
  CHECK(after[1][2].a == doctest::Approx(0.7));
  CHECK(after[1][1] == before[1][1]);
  CHECK(after[1][3] == before[1][3]);
  CHECK(after[0][140].a == doctest::Approx(0.7));  // dentin by density
  for (std::size_t m = 1; m < kTooth.size(); ++m) {
    CHECK(static_cast<double>(before[1][m].a) == doctest::Approx(default_opacity(kTooth, m)));
  }
}

TEST_CASE("new opacities make the picture of a renderer that had them from the start") {
  if (!have_gl()) return;
  const VoxelGrid grid{30, 26, 24};
  const TestVolume volume(grid, centred(grid, glm::dvec3(0.3)), ball({}, 3.0, 1.5));
  std::vector<Label> labels;
  for (const Density density : volume.density) {
    labels.push_back(density < 9000 ? Label{0} : density < 50'000 ? Label{2} : Label{1});
  }
  SceneView scene = scene_of({&volume});
  scene.materials = kTooth;
  SceneView changed = scene;
  changed.materials[1].opacity = 0.02;
  changed.materials[2].opacity = 0.9;
  const View view = look_at({6, 7, 17}, {}, 8, 35);
  const RenderTarget target(kTestSize);
  for (const bool labelled : {false, true}) {
    const VolumeContent content{volume.density,
                                labelled ? std::span<const Label>(labels) : std::span<Label>()};
    for (const std::string_view kind : renderer_kinds()) {
      CAPTURE(std::string(kind));
      CAPTURE(labelled);
      const auto renderer = make_renderer(kind, scene, {&content, 1});
      const Drawn before = draw(*renderer, view, target);
      renderer->set_opacities(changed.materials, {&content, 1});
      const Drawn after = draw(*renderer, view, target);
      CHECK((after.rgb == before.rgb) != renderer->translucent());
      const auto fresh = make_renderer(kind, changed, {&content, 1});
      const bool same = draw(*fresh, view, target).rgb == after.rgb;
      CHECK(same);
      renderer->set_opacities(scene.materials, {&content, 1});
      const bool back = draw(*renderer, view, target).rgb == before.rgb;
      CHECK(back);
    }
  }
}

}  // namespace kerf::appearance_test
