// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "tests/visualizer/gl/gl_fixture.hpp"
#include "tests/visualizer/render/rgb_picture.hpp"

namespace kerf::test {

/// What was drawn, and right of it its depth in grey: from the near plane, black, to the far plane
/// in equal steps of distance; white where nothing was drawn.
[[nodiscard]] RgbPicture with_depth(const Drawn& drawn, const View& view, PictureSize size);

/// The mean of each square of `edge` pixels, which divides both sides.
[[nodiscard]] RgbPicture box_filtered(const RgbPicture& picture, int edge);

/// How a picture compares with the one that it should be.
struct Likeness {
  double alike = 0.0;  ///< share of pixels whose channels all are within `kStep`
  double mean = 0.0;   ///< difference of the channels, in steps of 1/255
  static constexpr int kStep = 3;
};
/// Of pictures of one size.
[[nodiscard]] Likeness likeness(const RgbPicture& picture, const RgbPicture& wanted);

/// Checks `picture` against golden/NAME.png in the sources. Where they differ, NAME-actual.png and
/// NAME-difference.png (32 times the difference) are left in the folder golden-failed of the
/// working directory, and the failure names them. With KERF_GOLDEN=renew in the environment the
/// golden picture is replaced instead.
void check_golden(const std::string& name, const RgbPicture& picture);

}  // namespace kerf::test
