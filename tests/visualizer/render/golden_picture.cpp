// SPDX-License-Identifier: Apache-2.0
#include "tests/visualizer/render/golden_picture.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <string_view>

#include <doctest/doctest.h>

#include "visualizer/picture/image_files.hpp"

namespace kerf::test {

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

}  // namespace

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

}  // namespace kerf::test
