// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/phantom.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string_view>
#include <vector>

#include <doctest/doctest.h>

#include "controller/input/load_error.hpp"
#include "controller/volume/windowing.hpp"
#include "shared/numeric/fnv1a.hpp"
#include "shared/volume/material.hpp"
#include "tests/support/property.hpp"
#include "tests/support/voxels.hpp"
#include "tests/volume/volume_files.hpp"

namespace kerf::phantom_test {

using namespace kerf::test;

namespace {

const VolumeImage& full() {
  static const VolumeImage image = make_phantom();
  return image;
}
const VolumeImage& half() {
  static const VolumeImage image = make_phantom({.grid = {128, 128, 80}});
  return image;
}

std::array<double, 3> place(const VolumeImage& image, std::int32_t x, std::int32_t y,
                            std::int32_t z) {
  return {image.origin_mm[0] + x * image.spacing_mm[0],
          image.origin_mm[1] + y * image.spacing_mm[1],
          image.origin_mm[2] + z * image.spacing_mm[2]};
}

}  // namespace

TEST_CASE("the phantom is as large as a lower molar and lies in the middle of its box") {
  CHECK(full().grid == VoxelGrid{256, 256, 161});
  CHECK(full().spacing_mm[0] == 0.125);
  CHECK(half().spacing_mm[0] == 0.25);
  const auto solid = static_cast<Density>(0.45 * kDensityMax);
  const VoxelBox box = solid_box(full(), solid);
  const auto mm = [](std::int32_t voxels) { return 0.125 * voxels; };
  CHECK(mm(box.extent().x) == doctest::Approx(11).epsilon(0.05));
  CHECK(mm(box.extent().y) == doctest::Approx(10.3).epsilon(0.05));
  CHECK(mm(box.extent().z) == doctest::Approx(19).epsilon(0.05));
  // Crown at high z: the widest layer lies in the upper third.
  std::array<int, 161> count{};
  for (std::int32_t z = 0; z < 161; ++z) {
    for (std::size_t i = 0; i < 256 * 256; ++i) {
      count[static_cast<std::size_t>(z)] += full().density[full().grid.index(0, 0, z) + i] >= solid;
    }
  }
  const auto widest = std::max_element(count.begin(), count.end()) - count.begin();
  CHECK(widest > 110);
}

TEST_CASE("the phantom has two roots below, one neck, and cusps around a fossa") {
  const auto outside = [](double x, double y, double z) {
    return phantom_signed_distance(x, y, z) > 0;
  };
  CHECK(outside(0, 0, -6));           // between the roots
  CHECK_FALSE(outside(2.9, 0, -6));   // mesial root
  CHECK_FALSE(outside(-3.2, 0, -6));  // distal root
  CHECK_FALSE(outside(0, 0, 0.5));    // they meet below the neck
  // Five cusps stand at least 0.8 mm over the fossa.
  const auto height = [&](double x, double y) {
    double z = 10;
    while (z > 0 && outside(x, y, z)) z -= 0.01;
    return z;
  };
  const double fossa = height(0, 0.2);
  CHECK(height(2.9, 2.4) > fossa + 0.8);               // mesiobuccal
  CHECK(height(-0.7, 2.6) > fossa + 0.8);              // distobuccal
  CHECK(height(-3.4, 1.3) > fossa + 0.8);              // distal
  CHECK(height(2.6, -2.7) > fossa + 0.8);              // mesiolingual
  CHECK(height(-2.1, -2.7) > fossa + 0.8);             // distolingual
  CHECK(height(1.1, 2.6) < height(2.9, 2.4) - 0.4);    // groove between the buccal cusps
  CHECK(height(0.2, -2.7) < height(2.6, -2.7) - 0.4);  // groove between the lingual cusps
}

TEST_CASE("the density crosses one half of its material where the signed distance is zero") {
  // On every edge along x that the outer surface cuts, in the enamel and in the roots' dentin.
  const VolumeImage& image = full();
  const double h = image.spacing_mm[0];
  std::size_t crossings = 0;
  double worst_vox = 0;
  const auto check_layer = [&](std::int32_t z, double iso) {
    for (std::int32_t y = 0; y < image.grid.ny; ++y) {
      for (std::int32_t x = 1; x < image.grid.nx; ++x) {
        const double here = image.density[image.grid.index(x, y, z)];
        const double before = image.density[image.grid.index(x - 1, y, z)];
        if ((here >= iso) == (before >= iso)) continue;
        const double t = (iso - before) / (here - before);
        const auto p = place(image, x, y, z);
        const double distance = phantom_signed_distance(p[0] - (1 - t) * h, p[1], p[2]);
        if (distance < -2 * h) continue;  // an inner boundary: the wall of the pulp
        ++crossings;
        worst_vox = std::max(worst_vox, std::abs(distance) / h);
      }
    }
  };
  for (std::int32_t z = 4; z < 80; ++z) check_layer(z, kPhantomDentin / 2.0);     // below the neck
  for (std::int32_t z = 112; z < 161; ++z) check_layer(z, kPhantomEnamel / 2.0);  // 2 mm above
  CHECK(crossings > 15000);
  CHECK(worst_vox < 0.25);
}

TEST_CASE("density follows the signed distance over two voxels, and no block is skipped wrongly") {
  const VolumeImage& image = half();
  const double h = image.spacing_mm[0];
  for (const auto& [x, y, z] : voxels(image.grid)) {
    const auto p = place(image, x, y, z);
    const double cover =
        std::clamp(0.5 - phantom_signed_distance(p[0], p[1], p[2]) / (2 * h), 0.0, 1.0);
    const double density = image.density[image.grid.index(x, y, z)];
    // Between all pulp and all enamel; air and full cover are exact.
    REQUIRE(density >= std::floor(kPhantomPulp * cover));
    REQUIRE(density <= kPhantomEnamel * cover + 0.5);
  }
}

TEST_CASE("no field of the shape is steeper than the bound that lets blocks be skipped") {
  CHECK(property([] {
    const auto coordinate = [](int lo, int hi) { return 0.001 * in_range(lo, hi); };
    const auto point = [&] {
      return phantom::Point{coordinate(-16000, 16000), coordinate(-16000, 16000),
                            coordinate(-10000, 10000)};
    };
    const phantom::Point a = point();
    const phantom::Point b =
        any<bool>() ? point() : phantom::Point{a.x + 0.01, a.y - 0.02, a.z + 0.03};
    const double apart = std::sqrt((a.x - b.x) * (a.x - b.x) + (a.y - b.y) * (a.y - b.y) +
                                   (a.z - b.z) * (a.z - b.z));
    for (const phantom::Field field :
         {phantom::outer_field, phantom::dentin_field, phantom::pulp_field}) {
      HOLDS(std::abs(field(a, phantom::Level(a.z)) - field(b, phantom::Level(b.z))) <=
            phantom::kSteepest * apart + 1e-12);
    }
  }));
}

TEST_CASE("labels lie where the density is and agree with it") {
  const VolumeImage& image = full();
  std::size_t wrong = 0, enamel_below_neck = 0;
  for (std::size_t i = 0; i < image.density.size(); ++i) {
    const Density d = image.density[i];
    const Label label = image.labels[i];
    wrong += (label == 0) != (d == 0) || label > kLabelPulp ||
             (d > kPhantomDentin && label == kLabelPulp) ||
             (d == kPhantomEnamel && label != kLabelEnamel);
  }
  CHECK(wrong == 0);
  for (std::size_t i = 0; i < image.grid.index(0, 0, 90); ++i) {  // z < 1.25 mm
    enamel_below_neck += image.labels[i] == kLabelEnamel && image.density[i] > kPhantomDentin;
  }
  CHECK(enamel_below_neck == 0);
  // Pulp: a chamber at the height of the neck, canals down both roots.
  const auto label = [&](double x, double y, double z) {
    const auto at = [&](double mm, std::size_t axis) {
      return static_cast<std::int32_t>(std::lround((mm - image.origin_mm[axis]) / 0.125));
    };
    return image.labels[image.grid.index(at(x, 0), at(y, 1), at(z, 2))];
  };
  CHECK(label(0, 0, 1.7) == kLabelPulp);
  CHECK(label(2.95, 0.95, -4) == kLabelPulp);
  CHECK(label(2.95, -0.95, -4) == kLabelPulp);
  CHECK(label(-2.98, 0, -4) == kLabelPulp);
  CHECK(label(0, 0, 4.5) == kLabelDentin);
}

TEST_CASE("the phantom is the same bits on every machine") {
  // FNV-1a over density and labels of a small one: only + - * / and square roots go into it.
  const VolumeImage image = make_phantom({.grid = {64, 64, 40}});
  std::uint64_t hash = kFnv1aBasis;
  for (const Density d : image.density) hash = fnv1a_bytes(hash, d, 2);
  for (const Label l : image.labels) hash = fnv1a_step(hash, l);
  CHECK(hash == 6934270975821157299ULL);
}

TEST_CASE("a phantom without voxels, above the limits or of no spacing is refused") {
  CHECK_THROWS_AS(static_cast<void>(make_phantom({.grid = {0, 10, 10}})), LoadError);
  CHECK_THROWS_AS(static_cast<void>(make_phantom({.grid = {2000, 10, 10}})), LoadError);
  CHECK_THROWS_AS(static_cast<void>(make_phantom({.grid = {10, 10, 10}, .spacing_mm = -1})),
                  LoadError);
}

TEST_CASE(
    "the carious molar differs from the molar in its lesion alone, which leaves the pulp alone") {
  const VolumeImage carious = make_phantom({.shape = kCariousMolar, .grid = {128, 128, 80}});
  std::size_t lesion = 0, touches_air = 0, others = 0;
  double deepest_mm = 100;
  for (const auto& [x, y, z] : voxels(VoxelBox{{0, 0, 0}, {128, 128, 80}})) {
    const std::size_t at = carious.grid.index(x, y, z);
    const auto [px, py, pz] = place(carious, x, y, z);
    if (carious.labels[at] != kLabelCaries) {
      others += carious.labels[at] != half().labels[at] ? 1 : 0;
      const bool far = phantom::lesion_distance({px, py, pz}) > 0.5;
      others += far && carious.density[at] != half().density[at] ? 1 : 0;
      continue;
    }
    ++lesion;
    touches_air += carious.density[carious.grid.index(x, y, z + 2)] < kPhantomPulp ? 1 : 0;
    deepest_mm = std::min(deepest_mm, pz);
    CHECK(half().labels[at] != kLabelPulp);
  }
  CHECK(others == 0);
  // The ellipsoid of 1.5 x 1.2 x 1.2 mm has 9.05 mm3; the track through the enamel adds some.
  CHECK(lesion > 9 * 64);  // 64 voxels a mm3
  CHECK(lesion < 12 * 64);
  CHECK(touches_air > 0);
  CHECK(phantom::pulp_field({0.0, -0.2, deepest_mm - 0.25}, phantom::Level(deepest_mm - 0.25)) >
        0.3);
}

TEST_CASE("a plain solid has its surface at a density of 0.5, and no labels") {
  for (const std::string_view shape : {"wall", "ball", "torus"}) {
    CAPTURE(shape);
    const VolumeImage image = make_phantom({.shape = shape, .grid = {128, 128, 80}});
    CHECK(image.labels.empty());
    double solid_mm3 = 0;
    for (const Density density : image.density) solid_mm3 += density / kDensityMax / 64.0;
    constexpr double kPi = std::numbers::pi;
    const double known_mm3 = shape == "wall"   ? 32.0 * 32 * 10
                             : shape == "ball" ? 4.0 / 3 * kPi * 8 * 8 * 8
                                               : 2 * kPi * kPi * 10 * 4 * 4;
    CHECK(solid_mm3 == doctest::Approx(known_mm3).epsilon(0.002));
    for (std::int32_t z = 0; z < 80; z += 3) {
      for (std::int32_t x = 0; x < 128; x += 3) {
        const auto [px, py, pz] = place(image, x, 60, z);
        const double distance_mm = phantom::solid_distance(shape, {px, py, pz});
        const double share = image.density[image.grid.index(x, 60, z)] / kDensityMax;
        if (std::abs(distance_mm) < 0.25)
          CHECK(share == doctest::Approx(0.5 - distance_mm / 0.5).epsilon(1e-4));
        if (std::abs(distance_mm) >= 0.25) CHECK(share == (distance_mm < 0 ? 1 : 0));
      }
    }
  }
}

// Seen by three kinds of eyes, after Vienot, Brettel and Mollon (1999).

namespace {

using Row = std::array<double, 3>;
using Matrix = std::array<Row, 3>;

constexpr Matrix kUsual{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
constexpr Matrix kNoRed{{{0.11238, 0.88762, 0}, {0.11238, 0.88762, 0}, {0.00401, -0.00401, 1}}};
constexpr Matrix kNoGreen{{{0.29275, 0.70725, 0}, {0.29275, 0.70725, 0}, {-0.02234, 0.02234, 1}}};
constexpr Matrix kXyz{
    {{0.4124, 0.3576, 0.1805}, {0.2126, 0.7152, 0.0722}, {0.0193, 0.1192, 0.9505}}};

Row times(const Matrix& m, const Row& v) {
  Row out{};
  for (std::size_t i = 0; i < 3; ++i) out[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
  return out;
}

/// CIE 1976 L*a*b* of linear RGB.
Row lab(const Row& rgb) {
  const Row white = times(kXyz, {1, 1, 1});
  Row f = times(kXyz, rgb);
  for (std::size_t i = 0; i < 3; ++i) {
    f[i] /= white[i];
    f[i] = f[i] > 0.008856 ? std::cbrt(f[i]) : 7.787 * f[i] + 16.0 / 116;
  }
  return {116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])};
}

double least_difference(const Matrix& eye, std::size_t labels) {
  double least = 1e9;
  for (std::size_t a = 1; a <= labels; ++a) {
    for (std::size_t b = a + 1; b <= labels; ++b) {
      const Row one = lab(times(eye, label_colour(a)));
      const Row two = lab(times(eye, label_colour(b)));
      least = std::min(least, std::hypot(one[0] - two[0], one[1] - two[1], one[2] - two[2]));
    }
  }
  return least;
}

}  // namespace

TEST_CASE("any two labels' colours differ for every kind of colour vision") {
  for (const Matrix& eye : {kUsual, kNoRed, kNoGreen}) {
    CHECK(least_difference(eye, 7) > 16);
    CHECK(least_difference(eye, kLabelColours) > 9);  // 2.3 is just seen
  }
  CHECK(label_colour(kLabelColours + 1) == label_colour(1));
}

}  // namespace kerf::phantom_test
