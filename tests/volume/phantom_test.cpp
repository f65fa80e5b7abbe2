// SPDX-License-Identifier: Apache-2.0
#include "controller/volume/phantom.hpp"

#include <array>
#include <cmath>
#include <numbers>
#include <string_view>

#include <doctest/doctest.h>
#include <rapidcheck.h>

#include "controller/input/load_error.hpp"
#include "controller/volume/windowing.hpp"
#include "shared/numeric/fnv1a.hpp"
#include "tests/volume/volume_files.hpp"

using namespace kerf;

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

/// mm3 per label, and of solid as the density tells it.
std::array<double, 5> volumes_mm3(const VolumeImage& image) {
  const double voxel = image.spacing_mm[0] * image.spacing_mm[1] * image.spacing_mm[2];
  std::array<double, 5> mm3{};
  for (std::size_t i = 0; i < image.density.size(); ++i) {
    mm3[image.labels[i]] += voxel;
    mm3[4] += voxel * image.density[i] / kDensityMax;
  }
  return mm3;
}

double slope_at(double x, double y, double z) {
  constexpr double kStep = 1e-3;
  const auto along = [](double high, double low) { return (high - low) / (2 * kStep); };
  const double gx =
      along(phantom_signed_distance(x + kStep, y, z), phantom_signed_distance(x - kStep, y, z));
  const double gy =
      along(phantom_signed_distance(x, y + kStep, z), phantom_signed_distance(x, y - kStep, z));
  const double gz =
      along(phantom_signed_distance(x, y, z + kStep), phantom_signed_distance(x, y, z - kStep));
  return std::sqrt(gx * gx + gy * gy + gz * gz);
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
  for (std::int32_t z = 0; z < image.grid.nz; ++z) {
    for (std::int32_t y = 0; y < image.grid.ny; ++y) {
      for (std::int32_t x = 0; x < image.grid.nx; ++x) {
        const auto p = place(image, x, y, z);
        const double cover =
            std::clamp(0.5 - phantom_signed_distance(p[0], p[1], p[2]) / (2 * h), 0.0, 1.0);
        const double density = image.density[image.grid.index(x, y, z)];
        // Between all pulp and all enamel; air and full cover are exact.
        REQUIRE(density >= std::floor(kPhantomPulp * cover));
        REQUIRE(density <= kPhantomEnamel * cover + 0.5);
      }
    }
  }
}

TEST_CASE("the signed distance has a slope of one on the surface and a bounded one around it") {
  const VolumeImage& image = half();
  std::size_t near = 0;
  std::size_t off = 0;
  for (std::int32_t z = 0; z < image.grid.nz; ++z) {
    for (std::int32_t y = 0; y < image.grid.ny; ++y) {
      for (std::int32_t x = 0; x < image.grid.nx; ++x) {
        const auto p = place(image, x, y, z);
        const double distance = std::abs(phantom_signed_distance(p[0], p[1], p[2]));
        if (distance > 0.5) continue;
        const double slope = slope_at(p[0], p[1], p[2]);
        REQUIRE(slope < 5.0);
        if (distance < 0.01) REQUIRE(std::abs(slope - 1) < 0.05);
        if (distance > 0.125) continue;  // one voxel of the full phantom
        ++near;
        off += std::abs(slope - 1) > 0.1;
      }
    }
  }
  CHECK(near > 5000);
  CHECK(static_cast<double>(off) < 0.02 * static_cast<double>(near));  // the sharp grooves
}

TEST_CASE("no field of the shape is steeper than the bound that lets blocks be skipped") {
  CHECK(rc::check("steepest", [] {
    const auto coordinate = [](int lo, int hi) { return 0.001 * *rc::gen::inRange(lo, hi); };
    const auto point = [&] {
      return phantom::Point{coordinate(-16000, 16000), coordinate(-16000, 16000),
                            coordinate(-10000, 10000)};
    };
    const phantom::Point a = point();
    const phantom::Point b =
        *rc::gen::arbitrary<bool>() ? point() : phantom::Point{a.x + 0.01, a.y - 0.02, a.z + 0.03};
    const double apart = std::sqrt((a.x - b.x) * (a.x - b.x) + (a.y - b.y) * (a.y - b.y) +
                                   (a.z - b.z) * (a.z - b.z));
    for (const phantom::Field field :
         {phantom::outer_field, phantom::dentin_field, phantom::pulp_field}) {
      RC_ASSERT(std::abs(field(a, phantom::Level(a.z)) - field(b, phantom::Level(b.z))) <=
                phantom::kSteepest * apart + 1e-12);
    }
  }));
}

TEST_CASE("volumes of the materials do not depend on the grid") {
  const auto fine = volumes_mm3(full());
  const auto coarse = volumes_mm3(half());
  CHECK(fine[4] == doctest::Approx(coarse[4]).epsilon(0.02));
  const auto parts = [](const VolumeImage& image) {  // by density, free of the antialiased rim
    std::array<double, 3> mm3{};
    const double voxel = std::pow(image.spacing_mm[0], 3);
    for (std::size_t i = 0; i < image.density.size(); ++i) {
      if (image.labels[i] == 0) continue;
      const double share = image.density[i] / kDensityMax;
      mm3[static_cast<std::size_t>(image.labels[i] - 1)] += voxel * share;
    }
    return mm3;
  };
  const auto fine_parts = parts(full());
  const auto coarse_parts = parts(half());
  CHECK(fine_parts[0] == doctest::Approx(coarse_parts[0]).epsilon(0.02));  // enamel
  CHECK(fine_parts[1] == doctest::Approx(coarse_parts[1]).epsilon(0.02));  // dentin
  // Canals are two coarse voxels wide, so the pulp is the least certain.
  CHECK(fine_parts[2] == doctest::Approx(coarse_parts[2]).epsilon(0.08));
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

TEST_CASE("the enamel is thick over the cusps and thins out to nothing at the neck") {
  // Thickness along a horizontal ray from the buccal side, and along a vertical one on a cusp.
  const auto thickness = [](phantom::Point from, phantom::Point step) {
    double mm = 0;
    for (int i = 0; i < 4000; ++i) {
      const double t = 0.005 * i;
      const phantom::Point p{from.x + t * step.x, from.y + t * step.y, from.z + t * step.z};
      const phantom::Level level(p.z);
      if (phantom::outer_field(p, level) < 0 && phantom::dentin_field(p, level) > 0) mm += 0.005;
      if (phantom::dentin_field(p, level) <= 0) break;
    }
    return mm;
  };
  const double cusp = thickness({2.9, 2.4, 10}, {0, 0, -1});
  const double middle = thickness({-0.7, 8, 5}, {0, -1, 0});
  const double neck = thickness({-0.7, 8, 2.3}, {0, -1, 0});
  CHECK(cusp > 1.5);
  CHECK(cusp < 2.3);
  CHECK(middle > neck);
  CHECK(neck < 0.6);
  CHECK(thickness({-0.7, 8, 1.0}, {0, -1, 0}) == 0.0);
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
  for (std::int32_t z = 0; z < 80; ++z) {
    for (std::int32_t y = 0; y < 128; ++y) {
      for (std::int32_t x = 0; x < 128; ++x) {
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
    }
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
