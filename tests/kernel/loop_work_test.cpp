// SPDX-License-Identifier: Apache-2.0
// What the paper's force gives back around a closed loop on a static ball: a true gradient field
// would give nothing, an interpolated gradient leaks a little, and each kernel has its figure.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include <doctest/doctest.h>

#include "tests/kernel/contact_methods.hpp"

using namespace kerf;
using namespace kerf::test;

namespace {

using Point = std::array<double, 3>;

constexpr double kPi = std::numbers::pi;
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
template <class Method>
double leak(GradientKernel kernel, std::span<const ToolOffset> tool, double height_vox, int loops) {
  using N = typename Method::Numbers;
  const TestVolume volume = ball();
  const Method method(kernel, volume);
  double leaked = 0, moved = 0;
  for (int n = 0; n < loops; ++n) {
    const Loop loop(n, loops, height_vox);
    double work = 0;
    for (int i = 0; i < kPoints; ++i) {
      const Point force = method.at(tool, pose_at<N>(loop.at(i)));
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

constexpr int kManyLoops = 24;
const std::vector<ToolOffset> kSample{{0, 0, 0}};

}  // namespace

// F5
TEST_CASE_TEMPLATE("a sample led round a loop gets back no more than its gradient kernel allows",
                   Method, Gathered<FixedNumbers>, Gathered<DoubleNumbers>, Aligned) {
  const double farid = leak<Method>(GradientKernel::farid, kSample, kBallRadius, kManyLoops);
  const double sobel = leak<Method>(GradientKernel::sobel5, kSample, kBallRadius, kManyLoops);
  MESSAGE(Method::name() << ": farid " << farid << ", sobel5 " << sobel);
  CHECK(farid <= 5e-3);
  CHECK(sobel <= 8e-3);
  CHECK(farid < sobel);
  CHECK(farid > 0);
}

TEST_CASE_TEMPLATE("a sample led round a loop gets back most with the central difference", Method,
                   Gathered<FixedNumbers>, Gathered<DoubleNumbers>, Aligned) {
  const double central = leak<Method>(GradientKernel::central, kSample, kBallRadius, kManyLoops);
  MESSAGE(Method::name() << ": central " << central);
  CHECK(central <= 8e-2);
  CHECK(central > 3 * leak<Method>(GradientKernel::farid, kSample, kBallRadius, kManyLoops));
}

TEST_CASE_TEMPLATE("a ball led round a loop gets back less than a sample, for each kernel", Method,
                   Gathered<FixedNumbers>, Gathered<DoubleNumbers>, Aligned) {
  const auto tool = odd_ball(5);
  const double touching = kBallRadius + kLoopRadius;  // at most 2 to 8 voxels deep
  const double farid = leak<Method>(GradientKernel::farid, tool, touching, 6);
  const double sobel = leak<Method>(GradientKernel::sobel5, tool, touching, 6);
  MESSAGE(Method::name() << ": farid " << farid << ", sobel5 " << sobel);
  CHECK(farid <= 1.3e-3);
  CHECK(sobel <= 2.6e-3);
}
