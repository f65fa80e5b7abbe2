// SPDX-License-Identifier: Apache-2.0
// Golden pictures: every renderer draws a drilled tooth as it did when somebody last looked at it.
//
// A picture that is meant to change is renewed, and then looked at, by
//
//     KERF_GOLDEN=renew ./kerf test -R '^visualizer$'
//
// Of the CT tooth, whose terms are unclear, only a signature is kept: means over squares of eight
// pixels.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>

#include <doctest/doctest.h>

#include "tests/visualizer/gl/gl_fixture.hpp"
#include "tests/visualizer/render/rgb_picture.hpp"
#include "tests/visualizer/render/teeth.hpp"
#include "visualizer/picture/image_files.hpp"
#include "visualizer/render/renderer.hpp"

namespace kerf::golden_test {

using namespace kerf::test;

namespace {

// llvmpipe draws the same bits with vectors of 128, 256 and 512 bits, and so does the ray caster on
// the processor. Other versions and graphics cards round filtered texels and powers in other ways,
// which a rim or the border of a material turns into another pixel here and there. A fault in
// light, order, place or colour moves whole faces: it is beyond both bounds by far.
constexpr double kLeastAlike = 0.995;
constexpr double kMostMean = 0.5;

void write(const std::filesystem::path& file, const RgbPicture& picture) {
  make_folder(file.parent_path());
  write_png(file, picture.size, picture.rgb);
}

RgbPicture difference_picture(const RgbPicture& a, const RgbPicture& b) {
  constexpr int kGain = 32;
  RgbPicture made{a.size, {}};
  for (std::size_t i = 0; i < a.rgb.size(); ++i) {
    made.rgb.push_back(
        static_cast<std::uint8_t>(std::min(255, kGain * std::abs(a.rgb[i] - b.rgb[i]))));
  }
  return made;
}

/// What was drawn, and right of it its depth in grey: from the near plane, black, to the far plane
/// in equal steps of distance; white where nothing was drawn.
RgbPicture with_depth(const Drawn& drawn, const View& view, PictureSize size) {
  constexpr double kFarthest = 254.0;
  constexpr std::uint8_t kNothing = 255;
  RgbPicture picture{{2 * size.width, size.height}, {}};
  for (int y = 0; y < size.height; ++y) {
    const auto row = static_cast<std::ptrdiff_t>(y) * size.width;
    picture.rgb.insert(picture.rgb.end(), drawn.rgb.begin() + 3 * row,
                       drawn.rgb.begin() + 3 * (row + size.width));
    for (int x = 0; x < size.width; ++x) {
      const float depth = drawn.depth[static_cast<std::size_t>(row + x)];
      const double fraction = (eye_distance_mm(static_cast<double>(depth), view) - view.near_mm) /
                              (view.far_mm - view.near_mm);
      const auto grey = static_cast<std::uint8_t>(std::lround(kFarthest * fraction));
      picture.rgb.insert(picture.rgb.end(), 3, depth < 1.0F ? grey : kNothing);
    }
  }
  return picture;
}

/// The mean of each square of `edge` pixels, which divides both sides.
RgbPicture box_filtered(const RgbPicture& picture, int edge) {
  RgbPicture small{{picture.size.width / edge, picture.size.height / edge}, {}};
  for (int y = 0; y < small.size.height; ++y) {
    for (int x = 0; x < small.size.width; ++x) {
      for (int channel = 0; channel < 3; ++channel) {
        int sum = 0;
        for (int i = 0; i < edge * edge; ++i) {
          const int from = (y * edge + i / edge) * picture.size.width + x * edge + i % edge;
          sum += picture.rgb[static_cast<std::size_t>(3 * from + channel)];
        }
        small.rgb.push_back(
            static_cast<std::uint8_t>(std::lround(static_cast<double>(sum) / (edge * edge))));
      }
    }
  }
  return small;
}

/// How a picture compares with the one that it should be.
struct Likeness {
  double alike = 0.0;  ///< fraction of the pixels whose channels all are within `kStep`
  double mean = 0.0;   ///< difference of the channels, in steps of 1/255
  static constexpr int kStep = 3;
};
/// Of pictures of one size.
Likeness likeness(const RgbPicture& picture, const RgbPicture& wanted) {
  std::size_t alike = 0;
  double sum = 0.0;
  for (std::size_t i = 0; i < picture.rgb.size(); i += 3) {
    int worst = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      const int off = std::abs(picture.rgb[i + c] - wanted.rgb[i + c]);
      worst = std::max(worst, off);
      sum += off;
    }
    alike += worst <= Likeness::kStep ? 1 : 0;
  }
  const auto channels = static_cast<double>(picture.rgb.size());
  return {3.0 * static_cast<double>(alike) / channels, sum / channels};
}

/// Checks `picture` against golden/NAME.png in the sources. Where they differ, NAME-actual.png and
/// NAME-difference.png (32 times the difference) are left in the folder golden-failed of the
/// working directory, and the failure names them. With KERF_GOLDEN=renew in the environment the
/// golden picture is replaced instead.
void check_golden(const std::string& name, const RgbPicture& picture) {
  const auto golden = std::filesystem::path(KERF_TEST_GOLDEN) / (name + ".png");
  const char* const wish = std::getenv("KERF_GOLDEN");
  if (wish != nullptr && std::string_view(wish) == "renew") {
    write(golden, picture);
    return;
  }
  const auto failed = std::filesystem::current_path() / "golden-failed";
  const auto actual = failed / (name + "-actual.png");
  const auto wanted = read_png(golden);
  if (!wanted || wanted->size != picture.size) {
    write(actual, picture);
    FAIL_CHECK(golden.string() << " is not there or has another size; this was drawn: "
                               << actual.string() << "; KERF_GOLDEN=renew takes it");
    return;
  }
  const Likeness found = likeness(picture, *wanted);
  if (found.alike >= kLeastAlike && found.mean <= kMostMean) return;
  const auto difference = failed / (name + "-difference.png");
  write(actual, picture);
  write(difference, difference_picture(picture, *wanted));
  FAIL_CHECK(golden.string() << ": " << 100.0 * found.alike << " % of pixels are alike ("
                             << 100.0 * kLeastAlike << " wanted), the mean difference is "
                             << found.mean << "/255 (" << kMostMean << " allowed); see "
                             << actual.string() << " and " << difference.string()
                             << "; KERF_GOLDEN=renew takes what was drawn");
}

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

}  // namespace kerf::golden_test
