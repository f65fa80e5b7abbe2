// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "visualizer/render/volume_textures.hpp"
#include "visualizer/scene/appearance.hpp"

using namespace kerf;

namespace {

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
    fill_gradient_texels(GradientFilter::corners, {1, 1, 1}, volume, {{0, 0, 0}, {1, 1, 1}}, texel);
    if (density < made.lowest_seen()) RC_ASSERT(made.presence(texel[0].density / 255.0) == 0.0);
  }));
}
