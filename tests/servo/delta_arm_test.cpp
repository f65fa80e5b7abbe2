// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>

#include <doctest/doctest.h>

#include "controller/plan/plan_device.hpp"
#include "controller/servo/kinematics.hpp"
#include "shared/wire/falcon.hpp"

namespace kerf::delta_arm_test {
namespace {

using Point = std::array<double, 3>;

/// Crank angles by the closed form of Stamper's thesis; nothing out of reach.
std::optional<std::array<double, 3>> angles_at(const Point& tip) {
  std::array<double, 3> angles{};
  for (std::size_t i = 0; i < 3; ++i) {
    const double s = std::sin(falcon::kLegAzimuthRad[i]);
    const double c = std::cos(falcon::kLegAzimuthRad[i]);
    const double u = c * tip[0] + s * tip[1] - falcon::kHipOutMm;
    const double v = c * tip[1] - s * tip[0] - falcon::kHipAcrossMm;
    const double w = tip[2] + falcon::kOriginDepthMm;
    const double a = falcon::kThighMm;
    const double cos_t3 = (v + falcon::kPlateAcrossMm) / falcon::kShinMm;
    const double along =
        falcon::kShinEndMm + falcon::kKneeEndMm + falcon::kShinMm * std::sqrt(1 - cos_t3 * cos_t3);
    const double out = u + falcon::kPlateOutMm;
    const double far = std::hypot(out, w);
    const double cosine = (far * far + a * a - along * along) / (2 * a * far);
    if (std::abs(cosine) > 1) return std::nullopt;
    angles[i] = std::atan2(w, out) - std::acos(cosine);
  }
  return angles;
}

template <class N>
ForwardKinematics<N> pose_at(const std::array<double, 3>& angles) {
  using Angle = typename N::Angle;
  return delta_arm_pose(device_parts::delta_arm<N>(),
                        {Angle(angles[0]), Angle(angles[1]), Angle(angles[2])});
}

/// Calls `check(tip, angles)` on a grid over the device's workspace, a cube of 100 mm and a little.
template <class Check>
int over_the_workspace(const Check& check) {
  int places = 0;
  for (double x = -55; x <= 55; x += 11) {
    for (double y = -55; y <= 55; y += 11) {
      for (double z = -55; z <= 55; z += 5) {
        const Point tip{x, y, z};
        const auto angles = angles_at(tip);
        if (!angles || *std::ranges::min_element(*angles) < -0.6 ||
            *std::ranges::max_element(*angles) > 1.7) {
          continue;  // beyond the end stops
        }
        check(tip, *angles);
        ++places;
      }
    }
  }
  return places;
}

}  // namespace

TEST_CASE("the closed form gives the published angles") {
  constexpr double kZMm = 110 - falcon::kOriginDepthMm;  // published from the plane of the hips
  const auto middle = angles_at({0, 0, kZMm});
  REQUIRE(middle);
  for (const double angle : *middle) {
    CHECK(angle / falcon::kRadPerDegree == doctest::Approx(16.188).epsilon(1e-4));
  }
  const auto aside = angles_at({20, 0, kZMm});
  REQUIRE(aside);
  CHECK((*aside)[0] / falcon::kRadPerDegree == doctest::Approx(22.1981).epsilon(1e-5));
  CHECK((*aside)[1] / falcon::kRadPerDegree == doctest::Approx(3.8035).epsilon(1e-4));
  CHECK((*aside)[2] / falcon::kRadPerDegree == doctest::Approx(27.3623).epsilon(1e-5));
}

TEST_CASE_TEMPLATE("forward kinematics undo the closed form everywhere in the workspace", N,
                   FixedNumbers, DoubleNumbers) {
  const double tolerance_mm = sizeof(typename N::Real) == 8 ? 1e-9 : 1e-3;
  double worst_mm = 0;
  const int places = over_the_workspace([&](const Point& tip, const auto& angles) {
    const auto found = pose_at<N>(angles).tip_mm;
    const double error_mm =
        std::max({std::abs(double(found.x) - tip[0]), std::abs(double(found.y) - tip[1]),
                  std::abs(double(found.z) - tip[2])});
    worst_mm = std::max(worst_mm, error_mm);
    CAPTURE(tip[0]);
    CAPTURE(tip[1]);
    CAPTURE(tip[2]);
    REQUIRE(error_mm < tolerance_mm);
  });
  MESSAGE(std::string(N::kName) << ": " << places << " places, worst " << worst_mm << " mm");
  CHECK(places > 1000);
}

TEST_CASE_TEMPLATE("the Jacobian is right, by differences of the closed form", N, FixedNumbers,
                   DoubleNumbers) {
  constexpr double kStepMm = 1e-3;
  const int places = over_the_workspace([&](const Point& tip, const auto& angles) {
    const auto jacobian_t = pose_at<N>(angles).jacobian_t_mm;
    // d tip = SUM_i row_i^T d angle_i: the columns of J are the rows of J^T.
    for (std::size_t axis = 0; axis < 3; ++axis) {
      Point ahead = tip, behind = tip;
      ahead[axis] += kStepMm;
      behind[axis] -= kStepMm;
      const auto later = angles_at(ahead);
      const auto earlier = angles_at(behind);
      if (!later || !earlier) return;
      for (std::size_t along = 0; along < 3; ++along) {
        double moved = 0;
        for (std::size_t i = 0; i < 3; ++i) {
          const double turned = ((*later)[i] - (*earlier)[i]) / (2 * kStepMm);
          moved += double(jacobian_t.row[i][along]) * turned;
        }
        REQUIRE(std::abs(moved - (along == axis ? 1.0 : 0.0)) < 2e-4);
      }
    }
  });
  CHECK(places > 1000);
}

TEST_CASE_TEMPLATE("a pose closes everywhere in the workspace, and for no other angles", N,
                   FixedNumbers, DoubleNumbers) {
  const int places = over_the_workspace([&](const Point& tip, const auto& angles) {
    CAPTURE(tip[0]);
    CAPTURE(tip[1]);
    CAPTURE(tip[2]);
    REQUIRE(pose_at<N>(angles).closes);
    for (std::size_t i = 0; i < 3; ++i) {
      for (const double turns : {-1, 1}) {
        auto turned = angles;
        turned[i] += turns * 2 * falcon::kPi;
        REQUIRE_FALSE(pose_at<N>(turned).closes);
      }
    }
  });
  CHECK(places > 1000);
  int closed = 0;
  for (double a = -7.9; a <= 7.9; a += 0.37) {
    for (double b = -7.9; b <= 7.9; b += 0.37) {
      for (double c = -7.9; c <= 7.9; c += 0.37) {
        const auto pose = pose_at<N>({a, b, c});
        if (!pose.closes) continue;
        ++closed;
        CAPTURE(a);
        CAPTURE(b);
        CAPTURE(c);
        const auto back =
            angles_at({double(pose.tip_mm.x), double(pose.tip_mm.y), double(pose.tip_mm.z)});
        REQUIRE(back);
        for (std::size_t i = 0; i < 3; ++i) {
          const double off_rad =
              std::remainder((*back)[i] - std::array{a, b, c}[i], 2 * falcon::kPi);
          CHECK(std::abs(off_rad) < 2e-2);  // near a singular pose
        }
      }
    }
  }
  CHECK(closed > 50);
}

TEST_CASE("angles that no grip can have give a finite place in fixed point") {
  for (const double a : {-7.9, -2.0, 0.0, 1.0, 3.0, 7.9}) {
    for (const double b : {-7.9, 0.0, 2.0, 7.9}) {
      const auto pose = pose_at<FixedNumbers>({a, b, -a});
      CHECK(std::abs(double(pose.tip_mm.x)) <= 32768.0);
    }
  }
}

}  // namespace kerf::delta_arm_test
