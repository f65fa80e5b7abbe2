// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numbers>

#include "hil/lab/extremes/measures.hpp"
#include "hil/lab/extremes/rest.hpp"

namespace kerf::extremes {
namespace {

using N = FixedNumbers;

constexpr VoxelGrid kGrid{44, 44, 44};
constexpr Point kMiddle{21, 21, 21};

enum class Pose { any, upright, lying };

/// The turn that takes the tool's axis to `axis`.
ToolTurn<N> turn_to(Point axis, Dice& dice) {
  const Point a = dice.across(axis), b = cross(a, axis);
  TurnRows<N> rows;
  for (std::size_t i = 0; i < 3; ++i) {
    rows[i] = {N::Unit(a[i]), N::Unit(axis[i]), N::Unit(b[i])};
  }
  return turn_of<N>(rows);
}

/// How far the tool reaches along a direction that has `cosine` with its axis.
double reach_along(const std::vector<std::array<double, 2>>& profile, double cosine) {
  const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
  double most = 0;
  for (const auto& [y, radius] : profile) most = std::max(most, y * cosine + radius * sine);
  return most;
}

}  // namespace

void measure_shapes(const Effort& effort, const Told& told) {
  struct Subject {
    const char* name;
    const char* shape;
    double radius, length;
    Pose pose;
  };
  // 1.5 times what a ball may.
  constexpr double kOffset = 0.075, kOffsetAim = 0.03, kDegrees = 0.75, kDegreesAim = 0.45;
  for (const Subject& subject :
       {Subject{"cylinder, any pose", "cylinder", 5, 16, Pose::any},
        Subject{"cylinder on its end", "cylinder", 5, 16, Pose::upright},
        Subject{"cylinder on its side", "cylinder", 5, 16, Pose::lying},
        Subject{"cone, any pose", "cone", 5, 16, Pose::any},
        Subject{"inverted cone, any pose", "inverted_cone", 5, 10, Pose::any},
        Subject{"flame, any pose", "flame", 4, 16, Pose::any},
        Subject{"wheel, any pose", "wheel", 8, 4, Pose::any},
        Subject{"needle 2 voxels thick, any pose", "cylinder", 1, 16, Pose::any}}) {
    const SceneTool tool = tool_of_units(subject.shape, subject.radius, subject.length);
    const auto profile = tool_profile(tool, 512);
    Dice dice(8);
    double sum = 0, most = 0, degrees = 0;
    for (int k = 0; k < effort.tilts; ++k) {
      const Frame frame(dice, kMiddle);
      const Point axis = subject.pose == Pose::upright ? frame.up
                         : subject.pose == Pose::lying ? frame.along
                                                       : dice.direction();
      const double support = reach_along(profile, -dot(axis, frame.up));
      const Body body = blurred(kGrid, [&](Point p) { return frame.of(p)[1] + support; });
      const ToolTurn<N> turn = turn_to(axis, dice);
      // From so high that the tool can turn first.
      const Point rest = rest_of<N>(tool, body, frame.place, frame.up, turn, 20);
      const double off = frame.of(rest)[1];
      sum += off;
      most = std::max(most, std::abs(off));
      degrees = std::max(degrees, degrees_between(rest - frame.at(0, -1, 0), frame.up));
    }
    const auto row = [&](const char* what, double value, const char* unit, double must,
                         double aim) {
      told({"shapes", std::string(subject.name) + what, value, unit, must, aim});
    };
    row(": mean offset", std::abs(sum / effort.tilts), "voxels", kOffset, kOffsetAim);
    row(": largest offset", most, "voxels", kOffset, kOffsetAim);
    row(": angle", degrees, "deg", kDegrees, kDegreesAim);
  }
}

}  // namespace kerf::extremes
