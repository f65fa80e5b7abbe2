// SPDX-License-Identifier: Apache-2.0
// The accuracy study measures what it says: figures that are known from elsewhere come out.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <type_traits>
#include <vector>

#include <doctest/doctest.h>

#include "lab/accuracy/contact_errors.hpp"
#include "lab/accuracy/reference_methods.hpp"

namespace kerf::accuracy_test {

using namespace kerf::accuracy;

namespace {

constexpr double kPi = std::numbers::pi;

BallTool five_voxels() {
  return ball_tool(5 * kVoxelMm, kVoxelMm);
}

/// Off the lattice, as in the kernels' table of direction errors.
Point centre() {
  return Point{0.37, 0.11, -0.23} * kVoxelMm;
}

/// Errors of the gradients on the face of a ball of ten voxels.
ErrorStats normal_error(GradientKernel kernel) {
  const Shape shape = ball(centre(), 10 * kVoxelMm);
  const ContactCase at{shape, volume_of(shape, 5, kVoxelMm), {}, 0};
  const BallTool tool = five_voxels();
  ContactErrors errors;
  add_errors(*contact_method({.kernel = kernel}, at.volume, tool), at, tool, {}, errors);
  return errors.normal_deg;
}

/// The median work of 40 loops of one sample about the face of a ball of twelve voxels.
double loop_work(const ContactChoice& choice) {
  const Shape shape = ball(centre(), 12 * kVoxelMm);
  const AnalyticVolume volume = volume_of(shape, 6, kVoxelMm);
  const auto method = contact_method(choice, volume, five_voxels());
  const auto force = [&](Point at) {
    return relabel<WorldSpace>(method->sample(volume.voxel_from_mm(at)));
  };
  std::vector<double> works;
  for (std::size_t i = 0; i < 40; ++i) {
    const Point normal = spread_direction(i, 40);
    const Point face = centre() + 12 * kVoxelMm * normal;
    works.push_back(TiltedLoop{face, normal}.work(force, 2000));
  }
  std::nth_element(works.begin(), works.begin() + 20, works.end());
  return works[20];
}

}  // namespace

TEST_CASE("theory is pi p (2 R - p) on a flat, the lens's disc on a ball, nothing when immersed") {
  const double radius = 0.625;
  const Point normal = spread_direction(3, 10);
  for (const double depth : {0.1, 0.3, 0.6}) {
    const Point flat = ideal_force(plane(normal, 0.2), (0.2 + radius - depth) * normal, radius);
    const double share = depth * (2 * radius - depth) / (radius * radius);
    CHECK(norm(flat - share * normal) < 1e-4);

    const double other = 1.25, apart = other + radius - depth;
    const Point round = ideal_force(ball({0, 0, 0}, other), apart * normal, radius);
    const double along = (apart * apart + radius * radius - other * other) / (2 * apart);
    CHECK(norm(round - (1 - along * along / (radius * radius)) * normal) < 1e-4);
  }
  CHECK(norm(ideal_force(plane(normal, 0), -2 * normal, radius)) < 1e-4);
}

TEST_CASE("contacts lie at their depth in every shape and spread over its faces") {
  for (const Shape& shape :
       {plane({1, 2, 3}, 0.03), ball({0, 0, 0}, 1.25), torus({1, 2, 3}, 2, 0.8),
        thin_plate({2, -1, 3}, 0.25), crease(), layered_ball({0, 0, 0}, 1.5, 0.4)}) {
    CAPTURE(shape.name);
    const auto contacts = contacts_on(shape, 20, 0.625, 2);
    REQUIRE(contacts.size() == 20);
    double least = 1, most = 0;
    for (const Contact& contact : contacts) {
      CHECK(shape.distance_mm(contact.centre_mm) ==
            doctest::Approx(0.625 - contact.depth_mm).epsilon(1e-4));
      CHECK(norm(contact.normal) == doctest::Approx(1));
      least = std::min(least, contact.centre_mm.x);
      most = std::max(most, contact.centre_mm.x);
    }
    CHECK(most - least > 1);
  }
}

TEST_CASE("F1: a ball of five voxels feels 27.61, 62.43 and 73.65 at depths of 1, 3 and 5") {
  const AnalyticVolume volume = volume_of(plane({0, 0, 1}, 0), 5, kVoxelMm);
  const BallTool tool = five_voxels();
  REQUIRE(tool.offsets.size() == 515);
  for (const auto storage : {Storage::gradients, Storage::aligned, Storage::splat}) {
    const auto method = contact_method({.storage = storage}, volume, tool);
    for (const auto& [depth, force] : {std::array{1.0, 27.61}, {3.0, 62.43}, {5.0, 73.65}}) {
      const Point share = force_share(*method, volume, tool, {0, 0, (5 - depth) * kVoxelMm});
      CHECK(share.z * kPi * 25 == doctest::Approx(force).epsilon(0.001));
    }
  }
}

TEST_CASE("every way to compute the force but the nearest voxel feels the same flat, to its blur") {
  const AnalyticVolume volume = volume_of(plane({1, 2, 3}, 0), 5, kVoxelMm);
  const BallTool tool = five_voxels();
  const Point normal = Point{1, 2, 3} * (1 / std::sqrt(14.0));
  using enum Arithmetic;
  const std::array choices{
      ContactChoice{.arithmetic = q8},
      ContactChoice{.arithmetic = q12},
      ContactChoice{},
      ContactChoice{.arithmetic = float64},
      ContactChoice{.kernel = GradientKernel::central},
      ContactChoice{.kernel = GradientKernel::sobel5},
      ContactChoice{.storage = Storage::aligned},
      ContactChoice{.storage = Storage::splat},
      ContactChoice{.storage = Storage::spline, .interpolation = Interpolation::quadratic},
      ContactChoice{.storage = Storage::spline, .interpolation = Interpolation::cubic},
      ContactChoice{.interpolation = Interpolation::quadratic},
      ContactChoice{.interpolation = Interpolation::cubic}};
  for (const ContactChoice& choice : choices) {
    const auto method = contact_method(choice, volume, tool);
    const Point share = force_share(*method, volume, tool, 2 * kVoxelMm * normal);
    CHECK(norm(share - 0.84 * normal) < 0.07);  // p (2 R - p) / R^2 at three voxels of five
  }
}

TEST_CASE("N2: noise gains are those of the kernels' table") {
  const BallTool tool = five_voxels();
  CHECK(noise_gain({.kernel = GradientKernel::central}, tool) ==
        doctest::Approx(0.7071).epsilon(0.02));
  CHECK(noise_gain({.kernel = GradientKernel::sobel5}, tool) ==
        doctest::Approx(0.108).epsilon(0.02));
  CHECK(noise_gain({}, tool) == doctest::Approx(0.1302).epsilon(0.02));
  for (const auto storage : {Storage::aligned, Storage::splat}) {
    CHECK(noise_gain({.storage = storage}, tool) == doctest::Approx(0.1302).epsilon(0.02));
  }
}

TEST_CASE("N3: normals on a ball are off by what the kernels' table says") {
  const ErrorStats central = normal_error(GradientKernel::central);
  CHECK(central.rms() == doctest::Approx(8.1).epsilon(0.05));
  CHECK(central.worst() == doctest::Approx(15.1).epsilon(0.05));
  const ErrorStats sobel = normal_error(GradientKernel::sobel5);
  CHECK(sobel.rms() == doctest::Approx(0.83).epsilon(0.05));
  CHECK(sobel.worst() == doctest::Approx(2.0).epsilon(0.05));
  const ErrorStats farid = normal_error(GradientKernel::farid);
  CHECK(farid.rms() == doctest::Approx(0.57).epsilon(0.05));
  CHECK(farid.worst() == doctest::Approx(1.53).epsilon(0.05));
}

TEST_CASE("N5: interpolation errors are those of the formats' table") {
  const ErrorStats q15 = interpolation_error(Arithmetic::q15);
  CHECK(q15.worst() <= 3.1);
  CHECK(q15.rms() <= 0.3);
  CHECK(interpolation_error(Arithmetic::q12).rms() == doctest::Approx(2.2).epsilon(0.05));
  CHECK(interpolation_error(Arithmetic::q12).worst() == doctest::Approx(11.8).epsilon(0.2));
  CHECK(interpolation_error(Arithmetic::q8).rms() == doctest::Approx(35).epsilon(0.05));
  CHECK(interpolation_error(Arithmetic::q8).worst() == doctest::Approx(139).epsilon(0.2));
}

TEST_CASE("F5: a closed loop on a ball makes no more work than the kernel's bound, as a rule") {
  CHECK(loop_work({.kernel = GradientKernel::central}) <= 8e-2);
  CHECK(loop_work({.kernel = GradientKernel::central}) > 8e-3);  // and is no zero
  CHECK(loop_work({.kernel = GradientKernel::sobel5}) <= 8e-3);
  CHECK(loop_work({}) <= 5e-3);
  CHECK(loop_work({}) > 5e-4);
  CHECK(loop_work({.storage = Storage::spline, .interpolation = Interpolation::quadratic}) <= 1e-6);
  CHECK(loop_work({.storage = Storage::spline, .interpolation = Interpolation::cubic}) <= 1e-8);
}

TEST_CASE_TEMPLATE("spline weights add up to one, slopes to zero, and reproduce a ramp", Degree,
                   std::integral_constant<int, 1>, std::integral_constant<int, 2>,
                   std::integral_constant<int, 3>) {
  for (double at = -1.3; at < 2; at += 0.17) {
    const auto axis = spline_axis<Degree::value>(at);
    double one = 0, zero = 0, place = 0, slope = 0;
    for (std::size_t i = 0; i < axis.value.size(); ++i) {
      const double voxel = axis.low + static_cast<double>(i);
      one += axis.value[i];
      zero += axis.slope[i];
      place += axis.value[i] * voxel;
      slope += axis.slope[i] * voxel;
    }
    CHECK(one == doctest::Approx(1));
    CHECK(std::abs(zero) < 1e-12);
    CHECK(place == doctest::Approx(at));
    CHECK(slope == doctest::Approx(1));
  }
}

}  // namespace kerf::accuracy_test
