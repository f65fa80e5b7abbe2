// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>

#include "lab/rig/guided_tool.hpp"

namespace kerf::extremes {

/// A hand that slides a ball of radius 8 over a bump.
struct BumpSlide {
  double bump = 40;   ///< its radius
  double step = 0.5;  ///< of the hand in a tick
  double depth = 2;   ///< of the hand below where the ball rests
  /// Share of full density by signed distance.
  std::function<double(double)> share = [](double distance) { return 0.5 - distance / 2; };
};

/// What it felt, the largest of all slides.
struct SlideFigures {
  double force_step = 0;  ///< over the mean force
  double degrees = 0;     ///< between force and normal
  double height_sd = 0;   ///< of the proxy about its mean height
  double height = 0;      ///< of the proxy over where the ball should be: its mean's magnitude
  int queries = 0;        ///< in a tick
};

inline constexpr double kSlideRadius = 8;

/// A bump in a cube of 60, turned at random, and the path of the hand over it.
class Bump {
 public:
  Bump(const BumpSlide& slide, Dice& dice) : slide_(slide), frame_(dice, {28, 28, 28}) {
    frame_.place = frame_.at(0, -4 - slide.bump, 0);
  }

  [[nodiscard]] Body body() const {
    return body_of({60, 60, 60}, [&](Point p) { return slide_.share(height(p)); });
  }
  [[nodiscard]] double height(Point p) const { return length(p - frame_.place) - slide_.bump; }
  [[nodiscard]] Point up(Point p) const { return unit(p - frame_.place); }
  [[nodiscard]] Point hand(double angle, double depth) const {
    const double r = slide_.bump + kSlideRadius - depth;
    return frame_.at(r * std::sin(angle), r * std::cos(angle), 0);
  }
  /// Angles from -end to end, `step` apart on the path of the ball's centre.
  [[nodiscard]] double end() const { return std::min(0.6, 7 / slide_.bump); }
  [[nodiscard]] double angle_step() const { return slide_.step / (slide_.bump + kSlideRadius); }

 private:
  BumpSlide slide_;
  Frame frame_;
};

/// F8 of docs/validation.md: slides once over the bump.
template <class N>
void slide_over(const BumpSlide& slide, Dice& dice, SlideFigures& figures) {
  const Bump bump(slide, dice);
  const Body body = bump.body();
  GuidedTool<N> guided(tool_of_units("ball", kSlideRadius, 2 * kSlideRadius), body,
                       bump.hand(-bump.end(), -2));
  for (double depth = -2; depth < slide.depth; depth += 0.1) {
    guided.tick(bump.hand(-bump.end(), depth));
  }
  Roughness roughness;
  double sum = 0, squares = 0;
  int count = 0;
  for (double angle = -bump.end(); angle < bump.end(); angle += bump.angle_step()) {
    const Point hand = bump.hand(angle, slide.depth);
    const Point force = guided.tick(hand);
    roughness.add(force);
    figures.degrees = std::max(figures.degrees, degrees_between(force, bump.up(hand)));
    const double off = bump.height(guided.proxy()) - kSlideRadius;
    sum += off;
    squares += off * off;
    ++count;
  }
  const double mean = sum / count;
  figures.force_step = std::max(figures.force_step, roughness.ratio());
  figures.height = std::max(figures.height, std::abs(mean));
  figures.height_sd =
      std::max(figures.height_sd, std::sqrt(std::max(0.0, squares / count - mean * mean)));
  figures.queries = std::max(figures.queries, guided.most_queries());
}

}  // namespace kerf::extremes
