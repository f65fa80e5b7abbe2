// SPDX-License-Identifier: Apache-2.0
// Golden pictures: every renderer draws a drilled tooth as it did when somebody last looked at it.
//
// A picture that is meant to change is renewed, and then looked at, by
//
//     KERF_GOLDEN=renew ./kerf test -R '^visualizer$'
//
// Of the CT tooth, whose terms are unclear, only a signature is kept: means over squares of eight
// pixels.
#include <map>
#include <string>

#include <doctest/doctest.h>

#include "tests/visualizer/render/golden_picture.hpp"
#include "tests/visualizer/render/teeth.hpp"
#include "visualizer/render/renderer.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

constexpr PictureSize kSize{256, 256};

/// The whole tooth, and into the hole.
View above() {
  return look_at({13, 30, 27}, {0, 0.5, 0}, 28, 56);
}

using Pictures = std::map<std::string, RgbPicture>;

/// By renderer.
Pictures pictures_of(const Tooth& tooth) {
  const RenderTarget target(kSize);
  const VolumeContent content = tooth.content();
  Pictures all;
  for (const std::string_view kind : renderer_kinds()) {
    const auto renderer = make_renderer(kind, tooth.scene, {&content, 1});
    all[std::string(kind)] = with_depth(draw(*renderer, above(), target), above(), kSize);
  }
  return all;
}

/// Renderers that show the same in different ways.
void check_pairs(const Pictures& pictures) {
  struct Pair {
    std::string a, b;
    double alike;
  };
  // Triangles are straight where a ray finds the curve within a cell: noisy CT shows it.
  for (const Pair& pair : {Pair{"iso", "cast", 0.995}, Pair{"iso", "surface", 0.98},
                           Pair{"blend", "slices", 0.995}, Pair{"blend", "cast-blend", 0.995}}) {
    CAPTURE(pair.a);
    CAPTURE(pair.b);
    CHECK(likeness(pictures.at(pair.a), pictures.at(pair.b)).alike >= pair.alike);
  }
}

}  // namespace

TEST_CASE("every renderer draws the phantom of the default scene as it did") {
  if (!have_gl()) return;
  Tooth tooth = phantom({256, 256, 161}, true);
  tooth.drill();
  const Pictures pictures = pictures_of(tooth);
  for (const auto& [kind, picture] : pictures) check_golden("phantom-" + kind, picture);
  check_pairs(pictures);
}

TEST_CASE("every renderer draws the CT tooth as it did") {
  if (!have_gl()) return;
  auto tooth = ct_tooth();
  if (!tooth) return;
  tooth->drill();
  const Pictures pictures = pictures_of(*tooth);
  for (const auto& [kind, picture] : pictures) {
    check_golden("tooth-" + kind, box_filtered(picture, 8));
  }
  check_pairs(pictures);
}

TEST_CASE("a picture is not like one with other pixels, and is like one with other roundings") {
  RgbPicture picture{{100, 100}, std::vector<std::uint8_t>(30'000, 100)};
  const RgbPicture wanted = picture;
  for (std::size_t i = 0; i < picture.rgb.size(); i += 4) picture.rgb[i] = 101;
  CHECK(likeness(picture, wanted).alike == 1.0);
  CHECK(likeness(picture, wanted).mean == 0.25);
  for (std::size_t i = 0; i < 300; ++i) picture.rgb[i] = 104;
  CHECK(likeness(picture, wanted).alike == 0.99);
}
