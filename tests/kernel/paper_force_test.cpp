// SPDX-License-Identifier: Apache-2.0
// The paper's contact force against what it must be on a flat, by every method and number type: it
// measures the area of the tool's cut with the face, F = p0 pi (2 R d - d^2) at depth d.
#include <algorithm>
#include <cmath>
#include <numbers>

#include <doctest/doctest.h>

#include "tests/kernel/contact_methods.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kRadius = 5;           // voxels: 515 samples
constexpr double kBlurVariance = 1.22;  // voxel^2: kernel, edge ramp and interpolation
constexpr double kArea = kPi * kRadius * kRadius;

/// Solid below z = 20, its face through voxel centres.
TestVolume half_space(VoxelGrid grid = {40, 40, 40}) {
  return solid(grid, [](double, double, double z) { return z - 20.0; });
}

double theory(double depth) {
  return kPi * (2 * kRadius * depth - depth * depth);
}

/// F / p0 in voxel^2 of the ball, `depth` voxels deep in the half-space.
template <class Method>
double force_at_depth(const Method& method, double depth) {
  using N = typename Method::Numbers;
  return -method.at(odd_ball(5), pose_at<N>({20, 20, 20 + kRadius - depth}))[2];
}

/// The same with samples every `pitch_vox`.
double sampled_force(const TestVolume& volume, std::span<const Gradient<FixedNumbers>> field,
                     double pitch_vox, double depth) {
  const auto ball = odd_ball(static_cast<int>(kRadius / pitch_vox));
  const auto pose = pose_at<FixedNumbers>({20, 20, 20 + kRadius - depth}, pitch_vox);
  return -contact_gradient<FixedNumbers>(volume, field, ball, pose)[2] * pitch_vox * pitch_vox *
         pitch_vox;
}

}  // namespace

#define KERF_ALL_METHODS Gathered<FixedNumbers>, Gathered<DoubleNumbers>, Aligned

// F1
TEST_CASE_TEMPLATE("a ball pressed into a flat feels its contact area", Method, KERF_ALL_METHODS) {
  const TestVolume volume = half_space();
  const Method method(GradientKernel::farid, volume);
  const std::array<std::array<double, 2>, 3> expected = {{{1, 27.61}, {3, 62.43}, {5, 73.65}}};
  for (const auto& [depth, force] : expected) {
    const double felt = force_at_depth(method, depth);
    CHECK(felt == doctest::Approx(force).epsilon(0.001));
    CHECK(felt == doctest::Approx(theory(depth)).epsilon(0.07));
  }
}

// F2
TEST_CASE_TEMPLATE("a tool wholly inside the material feels nothing", Method, KERF_ALL_METHODS) {
  const TestVolume volume = half_space();
  const Method method(GradientKernel::farid, volume);
  for (const double depth : {2 * kRadius + 3, 13.3, 14.0}) {
    CHECK(std::abs(force_at_depth(method, depth)) <= 1e-6);
  }
}

// F6
TEST_CASE_TEMPLATE(
    "the force peaks at a depth of one radius with K0 R / 2 and weakens beyond, as the paper's "
    "model does",
    Method, KERF_ALL_METHODS) {
  const TestVolume volume = half_space();
  const Method method(GradientKernel::farid, volume);
  constexpr double kStep = 0.25;
  double peak = 0, peak_depth = 0, before = 0;
  for (double depth = kStep; depth <= 2 * kRadius; depth += kStep) {
    const double force = force_at_depth(method, depth);
    if (force > peak) {
      peak = force;
      peak_depth = depth;
    }
    // The stiffness is positive above the equator and negative below it.
    if (depth <= kRadius - 0.5) CHECK(force > before);
    if (depth > kRadius + 0.5) CHECK(force < before);
    before = force;
  }
  constexpr double kStiffness = 2 * kPi * kRadius;  // K0 / p0 of a sharp edge
  CHECK(std::abs(peak_depth - kRadius) <= 0.5);
  CHECK(peak == doctest::Approx(kStiffness * kRadius / 2).epsilon(0.07));
  CHECK(peak == doctest::Approx(kArea - kPi * kBlurVariance).epsilon(0.02));
}

// F3
TEST_CASE("sampling the tool four times finer changes the force by two percent at most") {
  const TestVolume volume = half_space();
  const auto field = gradients<FixedNumbers>(GradientKernel::farid, volume);
  for (const double depth : {1.0, 2.0, 3.0, 4.0, 5.0}) {
    const double fine = sampled_force(volume, field, 0.25, depth);
    CHECK(sampled_force(volume, field, 1.0, depth) == doctest::Approx(fine).epsilon(0.02));
    CHECK(fine == doctest::Approx(theory(depth)).epsilon(0.07));
  }
}

// F4
TEST_CASE("halving the voxel changes the force by the blur only") {
  // One ball of radius 5 h against voxels of h and of h / 2; lengths in h, samples every h / 2.
  const TestVolume coarse = half_space();
  const TestVolume fine = solid({60, 60, 60}, [](double, double, double z) { return z - 30.0; });
  const auto coarse_field = gradients<FixedNumbers>(GradientKernel::farid, coarse);
  const auto fine_field = gradients<FixedNumbers>(GradientKernel::farid, fine);
  const auto ball = odd_ball(10);
  for (const double depth : {1.0, 2.0, 3.0, 4.0, 5.0}) {
    const auto a = contact_gradient<FixedNumbers>(coarse, coarse_field, ball,
                                                  pose_at<FixedNumbers>({20, 20, 25 - depth}, 0.5));
    const auto b = contact_gradient<FixedNumbers>(
        fine, fine_field, ball, pose_at<FixedNumbers>({30, 30, 30 + 2 * (5 - depth)}, 1.0));
    // a^3 = h^3 / 8; a gradient per fine voxel is doubled to be per h.
    const double change = std::abs(a[2] - 2 * b[2]) / 8;
    CHECK(change <= kPi * kBlurVariance);
    CHECK(change > 0.0);
  }
}
