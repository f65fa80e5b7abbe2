// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "controller/volume/denoise.hpp"
#include "tests/rig/contact_motions.hpp"
#include "tests/rig/contact_rig.hpp"
#include "tests/rig/exact_contact.hpp"
#include "tests/rig/geometry.hpp"
#include "tests/studies/contact/rows.hpp"

namespace kerf::extremes {
namespace {

using N = FixedNumbers;

constexpr double kBump = 40, kDepth = 2, kStep = 0.5;

/// Contact of a tool with the bump: the tool's centre, and the bump's normal.
struct Touch {
  Point centre, normal;

  [[nodiscard]] Point hand(double depth) const { return centre - depth * normal; }
};

/// The way of a tool that keeps its pose over the bump about `frame.place`, by hands a step apart:
/// the normal turns, and the tool touches with the point that is farthest against it. If that
/// jumps, along an edge or over a face, the tool slides on with the same normal.
std::vector<Touch> path_over(const Frame& frame, const Axes& axes, const Reach& reach) {
  constexpr int kFine = 4000;
  constexpr double kEnd = 0.175;  // rad to each side
  const auto touch = [&](double angle) {
    const Point normal = std::cos(angle) * frame.up + std::sin(angle) * frame.along;
    const Point touching = axes.to_world(reach.farthest(axes.to_tool(-1 * normal)));
    return Touch{frame.place + kBump * normal - touching, normal};
  };
  std::vector<Touch> path{touch(-kEnd)};
  Touch before = path.front();
  double walked = 0;
  for (int i = 1; i <= kFine; ++i) {
    const Touch next = touch(kEnd * (2.0 * i / kFine - 1));
    const double gap = length(next.hand(kDepth) - before.hand(kDepth));
    for (double to = kStep - walked; to <= gap; to += kStep) {
      const double share = to / gap;
      path.push_back({before.centre + share * (next.centre - before.centre),
                      unit(before.normal + share * (next.normal - before.normal))});
    }
    walked = std::fmod(walked + gap, kStep);
    before = next;
  }
  return path;
}

struct Figures {
  double force_step = 0, degrees = 0, height_sd = 0;
};

/// One slide's forces over the stiffness and heights over the ideal place.
class Course {
 public:
  void add(const Touch& touch, Point force, double height) {
    roughness_.add(force);
    degrees_ = std::max(degrees_, degrees_between(force, touch.normal));
    sum_ += height;
    squares_ += height * height;
    ++count_;
  }
  void worsen(Figures& figures) const {
    const double mean = sum_ / count_;
    figures.force_step = std::max(figures.force_step, roughness_.ratio());
    figures.degrees = std::max(figures.degrees, degrees_);
    figures.height_sd =
        std::max(figures.height_sd, std::sqrt(std::max(0.0, squares_ / count_ - mean * mean)));
  }

 private:
  Roughness roughness_;
  double degrees_ = 0, sum_ = 0, squares_ = 0;
  int count_ = 0;
};

/// A bump turned at random, a tool in some pose, and the tool's way over the bump.
class Slide {
 public:
  Slide(const SampledTool& tool, const Reach& reach, RandomNumbers& random)
      : tool_(tool), frame_(random, {28, 28, 28}), axes_(standing_on(random.direction(), random)) {
    frame_.place = frame_.at(0, -4 - kBump, 0);
    path_ = path_over(frame_, axes_, reach);
  }

  /// `share` of full density by signed distance.
  [[nodiscard]] Body body(const std::function<double(double)>& share) const {
    return body_of({60, 60, 60}, [&](Point p) { return share(length(p - frame_.place) - kBump); });
  }
  /// Adds the figures of the tool.
  void feel(const Body& body, Figures& figures) const {
    const Orientation<N> orientation = axes_.orientation<N>();
    constexpr double kHigh = 20;  // the tool turns first
    GuidedTool<N> guided(tool_, body, path_.front().hand(-kHigh));
    for (int i = 0; i < 100 && !(guided.pose().orientation == orientation); ++i) {
      guided.tick(path_.front().hand(-kHigh), orientation);
    }
    for (double depth = -kHigh; depth < kDepth; depth += 0.1)
      guided.tick(path_.front().hand(depth), orientation);
    Course course;
    for (const Touch& touch : path_) {
      const Point force = guided.tick(touch.hand(kDepth), orientation);
      course.add(touch, force, dot(guided.proxy() - touch.centre, touch.normal));
    }
    course.worsen(figures);
  }
  /// Adds the figures of ExactTouch on the same path.
  void touch_exactly(const Body& body, Figures& figures) const {
    const ExactTouch truth(tool_, axes_, body);
    Course course;
    for (const Touch& touch : path_) {
      const double height = truth.height(touch.centre, touch.normal);
      const Point normal = truth.normal(touch.centre, touch.normal);
      course.add(touch, (kDepth + height) * normal, height);
    }
    course.worsen(figures);
  }

 private:
  const SampledTool& tool_;
  Frame frame_;
  Axes axes_;
  std::vector<Touch> path_;
};

/// As a scene loads it with `denoise = "auto"`.
void smooth(Body& body) {
  constexpr Density kIso = 32768;
  denoise(body.grid, body.density, passes_for(noise_of(body.grid, body.density, kIso)));
}

}  // namespace

void measure_slides(const Effort& effort, const RowSink& add_row) {
  struct Limits {
    double must, aim;
  };
  struct Subject {
    std::string name;
    BumpSlide slide;
    Limits step, degrees, sd;
  };
  CtEdge ct;
  const Limits two{0.02, 0.014}, half{0.5, 0.3}, fine{0.005, 0.002};
  for (const Subject& subject :
       {Subject{"R 40, 2 deep, 50 mm/s", {}, two, half, fine},
        Subject{"R 40, 1 deep, 50 mm/s", {.depth = 1}, two, half, fine},
        // F8 asks for 0.08 N at 0.4 N/mm, two units; more than that the direction turns.
        Subject{"R 14, 1 deep, 100 mm/s", {.bump = 14, .step = 1, .depth = 1}, {2, 2}, half, fine},
        Subject{"CT with noise, R 40, 2 deep, 50 mm/s",
                {.share = std::ref(ct)},
                {0.03, 0.018},
                {1.2, 0.9},
                {0.02, 0.015}}}) {
    SlideFigures figures;
    RandomNumbers random(5);
    for (int k = 0; k < effort.slides; ++k) {
      slide_over<FixedNumbers>(subject.slide, random, figures);
    }
    const auto row = [&](const char* what, double value, const char* unit, double scale,
                         const Limits& limits) {
      add_row({"slides", subject.name + what, value * scale, unit, limits.must * scale,
               limits.aim * scale});
    };
    row(": force step over the mean", figures.force_step, "%", 100, subject.step);
    row(": angle", figures.degrees, "deg", 1, subject.degrees);
    row(": surface sd", figures.height_sd, "voxels", 1, subject.sd);
  }
}

void measure_edge_slides(const Effort& effort, const RowSink& add_row) {
  struct Subject {
    std::string name;
    SceneTool tool;
  };
  for (const Subject& subject : {Subject{"ball", tool_of_units("ball", 8, 16)},
                                 Subject{"cylinder", tool_of_units("cylinder", 5, 16)}}) {
    const SampledTool tool(subject.tool);
    for (const EdgeWay way : {EdgeWay::along, EdgeWay::over}) {
      RandomNumbers random(13);
      double step = 0;
      for (int k = 0; k < 2 * effort.slides; ++k) {
        Frame frame(random, {25, 25, 25});
        frame.place = frame.at(0, -4, 0);
        const Axes lying = standing_on(frame.across, random);  // its side on the edge
        const EdgeFigures figures = slide_at_edge<FixedNumbers>(
            {.way = way}, subject.tool, tool, frame, lying, random.uniform(-0.5, 0.5));
        step = std::max(step, figures.roughness.ratio());
      }
      add_row({"edges",
               subject.name + (way == EdgeWay::along ? " along" : " over") +
                   " a sharp edge: force step over the mean",
               100 * step, "%", 5, 2});
    }
  }
}

void measure_shape_slides(const Effort& effort, const RowSink& add_row) {
  struct Limit {
    std::optional<double> must, aim;
  };
  struct Limits {
    Limit step, degrees, sd;
  };
  for (const EdgedTool& subject : edged_tools()) {
    const Reach reach(subject.tool);
    const SampledTool tool(subject.tool);
    const auto tell = [&](const std::string& name, const Figures& figures, const Limits& limits) {
      const auto row = [&](const char* what, double value, const char* unit, const Limit& limit) {
        add_row({"shapes", subject.name + name + what, value, unit, limit.must, limit.aim});
      };
      row(", force step over the mean", 100 * figures.force_step, "%", limits.step);
      row(", angle", figures.degrees, "deg", limits.degrees);
      row(", surface sd", figures.height_sd, "voxels", limits.sd);
    };
    RandomNumbers random(5);
    CtEdge ct;
    Figures clean, smoothed, noisy, exact;
    for (int k = 0; k < 2 * effort.slides; ++k) {
      const Slide slide(tool, reach, random);
      slide.feel(slide.body([](double distance) { return 0.5 - distance / 2; }), clean);
      Body body = slide.body(std::ref(ct));
      slide.feel(body, noisy);
      slide.touch_exactly(body, exact);
      smooth(body);
      slide.feel(body, smoothed);
    }
    tell(": sliding", clean, {{3, 2.1}, {0.75, 0.45}, {0.0075, 0.003}});
    tell(": sliding on CT with noise", smoothed, {{4.5, 2.7}, {1.8, 1.35}, {0.03, 0.0225}});
    tell(": sliding on CT with noise, denoise off", noisy, {});
    tell(": exact contact on CT with noise", exact, {});
  }
}

}  // namespace kerf::extremes
