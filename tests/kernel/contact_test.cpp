// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "controller/kernel/overlap_methods.hpp"
#include "controller/kernel/sampling.hpp"
#include "tests/kernel/aligned_support.hpp"
#include "tests/kernel/support.hpp"
#include "tests/support/property.hpp"
#include "tests/support/voxels.hpp"

namespace kerf::contact_test {

using namespace kerf::test;

namespace {

using Point = std::array<double, 3>;

constexpr double kPi = std::numbers::pi;

/// The contact force of an unturned tool of the volume's pitch by one method: SUM_i grad(rho /
/// rho_max) per voxel, so minus it is F / p0 in voxel^2.
struct ContactMethod {
  std::string name;
  std::function<Point(std::span<const ToolOffset>, const Point&)> force;
};

/// All methods on one volume, which has to outlive them.
std::vector<ContactMethod> contact_methods(GradientKernel kernel, const TestVolume& volume) {
  const auto gather = [&]<class N>(N) -> ContactMethod {
    return {std::string("gather, ") + N::kName,
            [&volume, field = gradients<N>(kernel, volume)](auto tool, const Point& centre) {
              return contact_gradient<N>(volume, field, tool, pose_at<N>(centre));
            }};
  };
  const ExactTaps& taps = exact_taps(kernel);
  const auto aligned = [&taps, field = ExactField(taps, volume)](auto tool, const Point& centre) {
    const auto sum = aligned_contact_sum(taps, field, tool, pose_at(centre));
    constexpr double kScale = 1.0 / (256.0 * kDensityMax);  // 8 kept bits
    return Point{double(sum.x) * kScale, double(sum.y) * kScale, double(sum.z) * kScale};
  };
  return {gather(FixedNumbers{}), gather(DoubleNumbers{}), {"aligned, fixed", aligned}};
}

/// The definition once more, without cells: hat weights of every voxel, in double.
std::array<double, 3> obvious_contact(const TestVolume& volume,
                                      std::span<const Gradient<DoubleNumbers>> field,
                                      std::span<const ToolOffset> offsets,
                                      const ToolPose<DoubleNumbers>& pose) {
  const VoxelGrid& grid = volume.grid;
  std::array<double, 3> sum{};
  for (const ToolOffset& offset : offsets) {
    const auto at = sample_position(pose, offset);
    const auto in = [](double p, std::int32_t n) { return p >= 0 && p < n - 1; };
    if (!in(at.x, grid.nx) || !in(at.y, grid.ny) || !in(at.z, grid.nz)) continue;
    for (const auto& [x, y, z] : voxels(grid)) {
      const double w = std::max(0.0, 1 - std::abs(at.x - x)) *
                       std::max(0.0, 1 - std::abs(at.y - y)) *
                       std::max(0.0, 1 - std::abs(at.z - z));
      const auto& g = field[grid.index(x, y, z)];
      sum[0] += w * g.x;
      sum[1] += w * g.y;
      sum[2] += w * g.z;
    }
  }
  return sum;
}

}  // namespace

TEST_CASE("fixed and double differ by at most 1.7e-4 of full scale, at any pose") {
  const TestVolume ball_volume = solid({40, 40, 40}, [](double x, double y, double z) {
    return std::hypot(x - 19.3, y - 20.1, z - 20.4) - 12.0;
  });
  const auto fixed = gradients(GradientKernel::farid, ball_volume);
  const auto exact = gradients<DoubleNumbers>(GradientKernel::farid, ball_volume);
  const auto tool = odd_ball(5);
  constexpr double kFullScale = 75.0;  // largest F / p0 of this tool on a flat
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(5.0, 35.0), turn(-1.0, 1.0);
  double worst = 0;
  for (int n = 0; n < 2000; ++n) {
    const std::array<double, 3> centre{place(random), place(random), place(random)};
    const std::array<double, 4> q{turn(random), turn(random), turn(random), turn(random) + 1.5};
    const auto a = contact_gradient<FixedNumbers>(ball_volume, fixed, tool, turned_pose(centre, q));
    const auto b = contact_gradient<DoubleNumbers>(ball_volume, exact, tool,
                                                   turned_pose<DoubleNumbers>(centre, q));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      worst = std::max(worst, std::abs(a[axis] - b[axis]) / kFullScale);
    }
  }
  MESSAGE("largest difference: " << worst << " of full scale");
  CHECK(worst <= 1.7e-4);
}

// N7
TEST_CASE("the order of the samples does not change a fixed sum") {
  const TestVolume volume = random_volume({30, 30, 30}, 11);
  const auto field = gradients(GradientKernel::farid, volume);
  auto tool = paper_ball(10);
  const auto pose = turned_pose({14.3, 15.2, 13.9}, {0.3, -0.2, 0.5, 0.8});
  const auto first = contact_sum<FixedNumbers>(volume.grid, field, tool, pose);
  std::mt19937 random(7);
  bool same = true;
  for (int n = 0; n < 1000; ++n) {
    std::shuffle(tool.begin(), tool.end(), random);
    same = same && contact_sum<FixedNumbers>(volume.grid, field, tool, pose) == first;
  }
  CHECK(same);
}

TEST_CASE("samples count when their cell is inside the volume and not otherwise") {
  CHECK(property([] {
    const auto seed = any<std::uint32_t>();
    const VoxelGrid grid{in_range(1, 9), in_range(1, 8), in_range(1, 7)};
    const TestVolume volume = random_volume(grid, seed);
    const auto field = gradients<DoubleNumbers>(GradientKernel::sobel5, volume);
    const auto place = [] { return double(in_range(-4000, 12000)) / 1000.0; };
    const double x = place(), y = place(), z = place();
    const auto pose = turned_pose<DoubleNumbers>({x, y, z}, {0.1, 0.2, -0.4, 0.9});
    const auto tool = odd_ball(2);
    const auto sum = contact_sum<DoubleNumbers>(grid, field, tool, pose);
    const auto expected = obvious_contact(volume, field, tool, pose);
    HOLDS(std::abs(sum.x - expected[0]) < 1e-6);
    HOLDS(std::abs(sum.y - expected[1]) < 1e-6);
    HOLDS(std::abs(sum.z - expected[2]) < 1e-6);
  }));
}

TEST_CASE_TEMPLATE("a tool far outside, at the range ends or nowhere feels nothing", N,
                   FixedNumbers, DoubleNumbers) {
  const TestVolume volume = random_volume({9, 8, 7}, 2);
  const auto field = gradients<N>(GradientKernel::farid, volume);
  const auto tool = odd_ball(3);
  const double inf = std::numeric_limits<double>::infinity();
  for (const double far : {-40.0, 40.0, -1e9, 1e9, -inf, inf}) {
    CHECK(contact_sum<N>(volume.grid, field, tool, pose_at<N>({far, 4, 3})) == SumVec<N>{});
    CHECK(contact_sum<N>(volume.grid, field, tool, pose_at<N>({far, far, far})) == SumVec<N>{});
  }
  CHECK(contact_sum<N>(volume.grid, field, {}, pose_at<N>({4, 4, 3})) == SumVec<N>{});
  if constexpr (!N::kIsFixed) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    CHECK(contact_sum<N>(volume.grid, field, tool, pose_at<N>({4, nan, 3})) == SumVec<N>{});
  }
}

namespace {

template <class N>
VoxelVec<typename N::Unit> direction(double x, double y, double z) {
  using Unit = typename N::Unit;
  return {Unit(x), Unit(y), Unit(z)};
}

}  // namespace

TEST_CASE_TEMPLATE("a ball in a flat is as deep as it is sunk, within a pitch", N, FixedNumbers,
                   DoubleNumbers) {
  const TestVolume volume = solid({40, 40, 40}, [](double, double, double z) { return z - 20.0; });
  for (const double pitch : {1.0, 0.5, 0.25}) {
    const auto ball = odd_ball(static_cast<int>(6 / pitch));
    for (double depth = 0.6; depth < 12; depth += 0.37) {
      const double felt = double(penetration_extent<N>(volume.grid, volume.density, ball,
                                                       pose_at<N>({20, 20, 26 - depth}, pitch),
                                                       32768, direction<N>(0, 0, 1)));
      CHECK(felt > depth + 0.5 - pitch - 1e-4);
      CHECK(felt <= depth + 0.5 + 1e-4);
    }
  }
}

TEST_CASE_TEMPLATE("depth is measured along the normal, in its units and whatever its sign", N,
                   FixedNumbers, DoubleNumbers) {
  const TestVolume volume = filled({40, 40, 40}, 65535);
  const auto ball = odd_ball(5);
  const auto extent = [&](VoxelVec<typename N::Unit> normal) {
    return double(penetration_extent<N>(volume.grid, volume.density, ball,
                                        turned_pose<N>({20, 20, 20}, {0.5, 0.5, 0.5, 0.5}), 1,
                                        normal));
  };
  CHECK(extent(direction<N>(0, 0, 1)) == doctest::Approx(10).epsilon(1e-4));
  CHECK(extent(direction<N>(0, -1, 0)) == doctest::Approx(10).epsilon(1e-4));
  CHECK(extent(direction<N>(0.125, 0, 0)) == doctest::Approx(1.25).epsilon(1e-4));
  CHECK(extent(direction<N>(0.6, 0.8, 0)) == doctest::Approx(10).epsilon(1e-4));
}

TEST_CASE_TEMPLATE("no depth in air, outside the volume or without samples", N, FixedNumbers,
                   DoubleNumbers) {
  const TestVolume volume = solid({40, 40, 40}, [](double, double, double z) { return z - 20.0; });
  const auto ball = odd_ball(3);
  const auto felt = [&](std::span<const ToolOffset> tool, double z) {
    return double(penetration_extent<N>(volume.grid, volume.density, tool, pose_at<N>({20, 20, z}),
                                        32768, direction<N>(0, 0, 1)));
  };
  CHECK(felt(ball, 30) == 0.0);
  CHECK(felt(ball, -50) == 0.0);
  CHECK(felt(ball, 1e9) == 0.0);
  CHECK(felt({}, 10) == 0.0);
  CHECK(felt(ball, 10) == 6.0);
}

// The paper's contact force against what it must be on a flat, by every method and number type: it
// measures the area of the tool's cut with the face, F = p0 pi (2 R d - d^2) at depth d.

namespace {

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
double force_at_depth(const ContactMethod& method, double depth) {
  return -method.force(odd_ball(5), {20, 20, 20 + kRadius - depth})[2];
}

}  // namespace

// F1, F2, F6
TEST_CASE(
    "a ball pressed into a flat is pushed by its contact area, most at a depth of one radius, and "
    "by nothing inside") {
  const TestVolume volume = half_space();
  for (const ContactMethod& method : contact_methods(GradientKernel::farid, volume)) {
    CAPTURE(method.name);
    for (const auto& [depth, force] : {std::array{1.0, 27.61}, {3.0, 62.43}, {5.0, 73.65}}) {
      const double found = force_at_depth(method, depth);
      CHECK(found == doctest::Approx(force).epsilon(0.001));
      CHECK(found == doctest::Approx(theory(depth)).epsilon(0.07));
    }
    for (const double depth : {2 * kRadius + 3, 13.3, 14.0}) {
      CHECK(std::abs(force_at_depth(method, depth)) <= 1e-6);
    }
    double peak = 0, peak_depth = 0, before = 0;
    for (double depth = 0.25; depth <= 2 * kRadius; depth += 0.25) {
      const double force = force_at_depth(method, depth);
      if (force > peak) {
        peak = force;
        peak_depth = depth;
      }
      // The stiffness is positive above the equator and negative below it, as in the paper's model.
      if (depth <= kRadius - 0.5) CHECK(force > before);
      if (depth > kRadius + 0.5) CHECK(force < before);
      before = force;
    }
    constexpr double kStiffness = 2 * kPi * kRadius;  // K0 / p0 of a sharp edge
    CHECK(std::abs(peak_depth - kRadius) <= 0.5);
    CHECK(peak == doctest::Approx(kStiffness * kRadius / 2).epsilon(0.07));
    CHECK(peak == doctest::Approx(kArea - kPi * kBlurVariance).epsilon(0.02));
  }
}

// What the paper's force gives back around a closed loop on a static ball: a true gradient field
// would give nothing, an interpolated gradient leaks a little, and each kernel has its figure.

namespace {

constexpr double kBallRadius = 12, kLoopRadius = 3;  // voxels
constexpr int kPoints = 2000;                        // of a loop
constexpr Point kBallCentre{23.3, 22.9, 23.6};

TestVolume ball() {
  return solid({48, 48, 48}, [](double x, double y, double z) {
    return std::hypot(x - kBallCentre[0], y - kBallCentre[1], z - kBallCentre[2]) - kBallRadius;
  });
}

/// A loop of radius 3 in a plane tilted against the ball's surface, around a point `height_vox`
/// from the centre in the `n`-th of `count` directions that cover the sphere evenly.
class Loop {
 public:
  Loop(int n, int count, double height_vox) : height_(height_vox) {
    const double turn = n * kPi * (3 - std::sqrt(5.0));  // the golden angle
    const double z = 1 - 2 * (n + 0.5) / count;
    const double r = std::sqrt(1 - z * z);
    const double c = std::cos(turn), s = std::sin(turn);
    out_ = {r * c, r * s, z};
    across_ = {-s, c, 0};
    constexpr double kTilt = 0.6;  // radians out of the radial plane
    const Point along{-z * c, -z * s, r};
    for (std::size_t a = 0; a < 3; ++a) {
      up_[a] = std::cos(kTilt) * out_[a] + std::sin(kTilt) * along[a];
    }
  }
  [[nodiscard]] Point at(int i) const {
    const double phase = 2 * kPi * i / kPoints;
    Point p{};
    for (std::size_t a = 0; a < 3; ++a) {
      p[a] = kBallCentre[a] + height_ * out_[a] +
             kLoopRadius * (std::cos(phase) * up_[a] + std::sin(phase) * across_[a]);
    }
    return p;
  }

 private:
  double height_;
  Point out_{}, across_{}, up_{};
};

/// |closed-loop work| / SUM |dW|, both added up over some loops.
double leak(const ContactMethod& method, std::span<const ToolOffset> tool, double height_vox,
            int loops) {
  double leaked = 0, moved = 0;
  for (int n = 0; n < loops; ++n) {
    const Loop loop(n, loops, height_vox);
    double work = 0;
    for (int i = 0; i < kPoints; ++i) {
      const Point force = method.force(tool, loop.at(i));
      const Point before = loop.at(i - 1), after = loop.at(i + 1);
      double step = 0;
      for (std::size_t a = 0; a < 3; ++a) step -= force[a] * (after[a] - before[a]) / 2;
      work += step;
      moved += std::abs(step);
    }
    leaked += std::abs(work);
  }
  return leaked / moved;
}

}  // namespace

// F5
TEST_CASE(
    "a tool led round a loop gets back no more than its gradient kernel allows, by each method") {
  const TestVolume volume = ball();
  const std::vector<ToolOffset> sample{{0, 0, 0}}, tool = odd_ball(5);
  const double touching = kBallRadius + kLoopRadius;  // at most 2 to 8 voxels deep
  const auto farid = contact_methods(GradientKernel::farid, volume);
  const auto sobel = contact_methods(GradientKernel::sobel5, volume);
  const auto central = contact_methods(GradientKernel::central, volume);
  for (std::size_t i = 0; i < farid.size(); ++i) {
    CAPTURE(farid[i].name);
    const double of_farid = leak(farid[i], sample, kBallRadius, 24);
    const double of_sobel = leak(sobel[i], sample, kBallRadius, 24);
    const double of_central = leak(central[i], sample, kBallRadius, 24);
    CHECK(of_farid > 0);
    CHECK(of_farid <= 5e-3);
    CHECK(of_farid < of_sobel);
    CHECK(of_sobel <= 8e-3);
    CHECK(3 * of_farid < of_central);
    CHECK(of_central <= 8e-2);
    CHECK(leak(farid[i], tool, touching, 6) <= 1.3e-3);
    CHECK(leak(sobel[i], tool, touching, 6) <= 2.6e-3);
  }
}

}  // namespace kerf::contact_test
