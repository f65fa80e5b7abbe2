// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "hil/lab/extremes/ct_edge.hpp"
#include "hil/lab/extremes/led.hpp"
#include "hil/lab/extremes/loft.hpp"
#include "hil/lab/extremes/measures.hpp"
#include "hil/lab/extremes/posed_tool.hpp"

namespace kerf::extremes {
namespace {

using N = FixedNumbers;

constexpr double kBump = 40, kDepth = 2, kStep = 0.5;

/// Where a tool touches the bump: its centre, and the bump's normal.
struct Touch {
  Point centre, normal;

  [[nodiscard]] Point hand(double depth) const { return centre - depth * normal; }
};

/// The way of a tool that keeps its pose over the bump about `frame.place`, by hands a step apart:
/// the normal turns, and the tool touches with the point that is farthest against it. Where that
/// jumps, along an edge or over a face, the tool slides on with the same normal.
std::vector<Touch> way_over(const Frame& frame, const Axes& axes, const Reach& reach) {
  constexpr int kFine = 4000;
  constexpr double kEnd = 0.175;  // rad to each side
  const auto touch = [&](double angle) {
    const Point normal = std::cos(angle) * frame.up + std::sin(angle) * frame.along;
    const Point touching = axes.to_world(reach.farthest(axes.to_tool(-1 * normal)));
    return Touch{frame.place + kBump * normal - touching, normal};
  };
  std::vector<Touch> way{touch(-kEnd)};
  Touch before = way.front();
  double walked = 0;
  for (int i = 1; i <= kFine; ++i) {
    const Touch next = touch(kEnd * (2.0 * i / kFine - 1));
    const double gap = length(next.hand(kDepth) - before.hand(kDepth));
    for (double to = kStep - walked; to <= gap; to += kStep) {
      const double share = to / gap;
      way.push_back({before.centre + share * (next.centre - before.centre),
                     unit(before.normal + share * (next.normal - before.normal))});
    }
    walked = std::fmod(walked + gap, kStep);
    before = next;
  }
  return way;
}

struct Figures {
  double force_step = 0, degrees = 0, height_sd = 0;
};

/// `share` of full density by signed distance.
void slide(const SampledTool& tool, const Reach& reach, const std::function<double(double)>& share,
           Dice& dice, Figures& figures) {
  Frame frame(dice, {28, 28, 28});
  frame.place = frame.at(0, -4 - kBump, 0);
  const Axes axes = standing_on(dice.direction(), dice);
  const Body body =
      body_of({60, 60, 60}, [&](Point p) { return share(length(p - frame.place) - kBump); });
  const std::vector<Touch> way = way_over(frame, axes, reach);
  const ToolTurn<N> turn = axes.turn<N>();
  constexpr double kHigh = 20;  // the tool turns first
  Led<N> led(tool, body, way.front().hand(-kHigh));
  for (int i = 0; i < 100 && !(led.pose().turn == turn); ++i) {
    led.tick(way.front().hand(-kHigh), turn);
  }
  for (double depth = -kHigh; depth < kDepth; depth += 0.1) led.tick(way.front().hand(depth), turn);
  Roughness roughness;
  double sum = 0, squares = 0;
  for (const Touch& touch : way) {
    const Point force = led.tick(touch.hand(kDepth), turn);
    roughness.add(force);
    figures.degrees = std::max(figures.degrees, degrees_between(force, touch.normal));
    const double off = dot(led.proxy() - touch.centre, touch.normal);
    sum += off;
    squares += off * off;
  }
  const auto count = static_cast<double>(way.size());
  const double mean = sum / count;
  figures.force_step = std::max(figures.force_step, roughness.ratio());
  figures.height_sd =
      std::max(figures.height_sd, std::sqrt(std::max(0.0, squares / count - mean * mean)));
}

}  // namespace

void measure_shape_slides(const Effort& effort, const Told& told) {
  struct Limit {
    double must, aim;
  };
  struct Limits {
    Limit step, degrees, sd;
  };
  struct Subject {
    const char* name;
    SceneTool tool;
  };
  for (const Subject& subject :
       {Subject{"cylinder, any pose", tool_of_units("cylinder", 5, 16)},
        Subject{"cone, any pose", tool_of_units("cone", 5, 16)},
        Subject{"STL, square bar, any pose", mesh_of_units("bar", prism(6, 16, 4))}}) {
    const Reach reach(subject.tool);
    const SampledTool tool(subject.tool);
    CtEdge ct;
    const auto measure = [&](const std::string& name, const std::function<double(double)>& share,
                             const Limits& limits) {
      Dice dice(5);
      Figures figures;
      for (int k = 0; k < effort.slides; ++k) slide(tool, reach, share, dice, figures);
      const auto row = [&](const char* what, double value, const char* unit, Limit limit) {
        told({"shapes", subject.name + name + what, value, unit, limit.must, limit.aim});
      };
      row(", force step over the mean", 100 * figures.force_step, "%", limits.step);
      row(", angle", figures.degrees, "deg", limits.degrees);
      row(", surface sd", figures.height_sd, "voxels", limits.sd);
    };
    measure(": sliding", [](double distance) { return 0.5 - distance / 2; },
            {{3, 2.1}, {0.75, 0.45}, {0.0075, 0.003}});
    measure(": sliding on CT with noise", std::ref(ct), {{4.5, 2.7}, {1.8, 1.35}, {0.03, 0.0225}});
  }
}

}  // namespace kerf::extremes
