// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <functional>
#include <string>

#include "lab/accuracy/contact_method.hpp"
#include "tests/rig/contact_motions.hpp"
#include "tests/rig/contact_rig.hpp"
#include "tests/studies/contact/hands.hpp"

namespace kerf::extremes {
namespace {

constexpr double kVoxelMm = 0.1;

/// The paper's force on a ball in a body of voxels of kVoxelMm, by the servo's method for round
/// tools.
class PaperForce {
 public:
  PaperForce(double radius, const Body& body)
      : volume_{body.grid, kVoxelMm, body.density},
        method_(
            accuracy::contact_method({.storage = accuracy::Storage::aligned, .voxel_mm = kVoxelMm},
                                     volume_, accuracy::ball_tool(radius * kVoxelMm, kVoxelMm))) {}

  /// F = -p0 a^3 SUM grad, a the pitch and the edge of a voxel; N.
  [[nodiscard]] Point at(Point centre) const {
    const double p0_n_per_mm2 = ForceSettings{}.p0_n_per_mm2;
    const auto sum = method_->tool_sum({centre[0], centre[1], centre[2]});
    return -p0_n_per_mm2 * kVoxelMm * kVoxelMm * Point{sum.x, sum.y, sum.z};
  }

 private:
  accuracy::AnalyticVolume volume_;
  std::unique_ptr<accuracy::ContactMethod> method_;
};

using N = FixedNumbers;

constexpr double kRadius = 8;
constexpr double kAbove = 12;    // a stroke begins so high over the face
constexpr double kThrough = 11;  // and is through if the ball's centre is so far behind it
constexpr double kMostMmPerS = 10000;
constexpr double kLeastShare = 0.01;  // of the paper's largest force: less is not felt
const double kNPerUnit = ForceSettings{}.stiffness_n_per_mm * kVoxelMm;

/// Force along the face's normal with the ball's centre so high over the face, N.
using ForceAt = std::function<double(double height)>;

/// A wall, tilted, with both ways to feel it.
class TwoModels {
 public:
  explicit TwoModels(double thickness)
      : body_(blurred({66, 66, 66},
                      [&](Point p) {
                        const double height = frame_.of(p)[1];
                        return thickness > 40 ? height
                                              : std::abs(height + thickness / 2) - thickness / 2;
                      })),
        paper_(kRadius, body_),
        guided_(tool_of_units("ball", kRadius, 2 * kRadius), body_, at(kAbove)) {}

  [[nodiscard]] double paper_n(double height) const {
    return dot(paper_.at(at(height)), frame_.up);
  }
  [[nodiscard]] double proxy_n(double height) {
    return kNPerUnit * dot(guided_.tick(at(height)), frame_.up);
  }
  /// Moves the proxy back to the start of a stroke.
  void lift() { guided_.start(at(kAbove)); }

 private:
  [[nodiscard]] Point at(double height) const { return frame_.at(0, height, 0); }

  RandomNumbers dice_{4};
  Frame frame_{dice_, {32, 32, 32}};
  Body body_;
  PaperForce paper_;
  GuidedTool<N> guided_;
};

/// Whether one tick of a stroke is felt, the first with the ball behind the face included.
bool felt(const ForceAt& force_n, double step, double phase, double least_n) {
  for (double height = kAbove - phase * step;; height -= step) {
    if (force_n(height) > least_n) return true;
    if (height < -kThrough) return false;
  }
}

/// Lowest of speeds 2 % apart at which some phase of the ticks is not felt.
std::optional<double> lost_at(const ForceAt& force_n, const std::function<void()>& lift,
                              double rate_hz, double least_n, const Effort& effort) {
  for (double speed = 10; speed <= kMostMmPerS; speed *= 1.02) {
    const double step = speed / rate_hz / kVoxelMm;
    if (step < kAbove) continue;  // some tick finds the ball half in
    for (int i = 0; i < effort.phases; ++i) {
      lift();
      if (!felt(force_n, step, double(i) / effort.phases, least_n)) return speed;
    }
  }
  return std::nullopt;
}

void press(TwoModels& models, Wall& wall) {
  constexpr double kStep = 0.25, kDeepest = 30, kTouched = 0.1;
  for (double height = kRadius + 1; height > kRadius - kDeepest; height -= kStep) {
    const double depth = kRadius - height;
    const Press press{depth * kVoxelMm, models.paper_n(height), models.proxy_n(height)};
    wall.paper_most_n = std::max(wall.paper_most_n, press.paper_n);
    const bool felt = press.paper_n > kLeastShare * wall.paper_most_n;
    wall.paper_unfelt_mm += depth > kTouched && !felt ? kStep * kVoxelMm : 0;
    wall.presses.push_back(press);
  }
}

void stroke(const Effort& effort, TwoModels& models, Wall& wall) {
  const double least_n = kLeastShare * wall.paper_most_n;
  for (const double rate_hz : {20.0, 50.0, 100.0, 200.0, 500.0, 1000.0}) {
    const auto paper = [&](double height) { return models.paper_n(height); };
    const auto proxy = [&](double height) { return models.proxy_n(height); };
    wall.losses.push_back({rate_hz,
                           lost_at(
                               paper, [] {}, rate_hz, least_n, effort),
                           lost_at(
                               proxy, [&] { models.lift(); }, rate_hz, least_n, effort)});
  }
}

void tell(const Wall& wall, const RowSink& add_row) {
  const auto row = [&](const std::string& what, double value, const char* unit,
                       std::optional<double> must = std::nullopt) {
    add_row({"paper", wall.name + ": " + what, value, unit, must, {}});
  };
  row("paper's largest force of a slow press", wall.paper_most_n, "N");
  row("paper unfelt on a press of 3 mm", wall.paper_unfelt_mm, "mm");
  for (const Loss& loss : wall.losses) {
    const std::string rate = std::to_string(std::lround(loss.rate_hz)) + " Hz";
    row("paper lost at " + rate + " from", loss.paper_mm_per_s.value_or(kMostMmPerS), "mm/s");
    row("proxy lost at " + rate, loss.proxy_mm_per_s ? 1 : 0, "1", 0);
  }
}

Slide slide_both() {
  RandomNumbers random(5);
  const BumpSlide bumped;
  const Bump bump(bumped, random);
  const Body body = bump.body();
  const PaperForce paper(kRadius, body);
  GuidedTool<N> guided(tool_of_units("ball", kRadius, 2 * kRadius), body,
                       bump.hand(-bump.end(), -2));
  for (double depth = -2; depth < bumped.depth; depth += 0.1) {
    guided.tick(bump.hand(-bump.end(), depth));
  }
  Slide slide;
  Roughness paper_steps, proxy_steps;
  double paper_sum = 0, proxy_sum = 0, travel_mm = 0;
  for (double angle = -bump.end(); angle < bump.end(); angle += bump.angle_step()) {
    const Point hand = bump.hand(angle, bumped.depth), up = bump.up(hand);
    const Point old = paper.at(hand), now = guided.tick(hand);
    paper_steps.add(old);
    proxy_steps.add(now);
    slide.paper_degrees = std::max(slide.paper_degrees, degrees_between(old, up));
    slide.proxy_degrees = std::max(slide.proxy_degrees, degrees_between(now, up));
    slide.ticks.push_back({travel_mm, length(old), length(now)});
    paper_sum += length(old);
    proxy_sum += length(now);
    travel_mm += bumped.step * kVoxelMm;
  }
  for (SlideTick& tick : slide.ticks) {
    tick.paper *= double(slide.ticks.size()) / paper_sum;
    tick.proxy *= double(slide.ticks.size()) / proxy_sum;
  }
  slide.paper_step = paper_steps.ratio();
  slide.proxy_step = proxy_steps.ratio();
  return slide;
}

void tell(const Slide& slide, const RowSink& add_row) {
  const auto row = [&](const char* what, double value, const char* unit) {
    add_row({"paper", std::string("slide over R 40: ") + what, value, unit, {}, {}});
  };
  row("paper's force step over the mean", 100 * slide.paper_step, "%");
  row("proxy's force step over the mean", 100 * slide.proxy_step, "%");
  row("paper's angle", slide.paper_degrees, "deg");
  row("proxy's angle", slide.proxy_degrees, "deg");
}

}  // namespace

Comparison compare(const Effort& effort, const RowSink& add_row) {
  Comparison comparison;
  for (Wall& wall : comparison.walls) {
    TwoModels models(wall.thickness);
    press(models, wall);
    stroke(effort, models, wall);
    tell(wall, add_row);
  }
  comparison.slide = slide_both();
  tell(comparison.slide, add_row);
  return comparison;
}

}  // namespace kerf::extremes
