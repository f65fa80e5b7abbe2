// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

#include "controller/law/virtual_coupling.hpp"
#include "controller/scene/scene.hpp"
#include "tests/rig/contact_rig.hpp"
#include "tests/rig/geometry.hpp"

/// Motions that judge a contact, each with its figures: flights in air, slides over a bump, slides
/// at a sharp edge, rests on faces of any iso, random steps at a wall. Lengths in units.
namespace kerf::extremes {

/// A flat wall at a random tilt, and the air above it.
struct AirWall {
  static constexpr std::int32_t kEdge = 96;

  Frame frame;
  Body body;

  explicit AirWall(RandomNumbers& random)
      : frame(random, {kEdge / 2.0, kEdge / 2.0, kEdge / 2.0}),
        body(blurred({kEdge, kEdge, kEdge}, [&](Point p) { return frame.of(p)[1]; })) {}
};

/// A tool that moves to and fro along an AirWall, in the air.
struct AirFlight {
  double units_per_tick = 1;  ///< large values: the path leaves the volume
  double gap_units = 1;       ///< from the wall's iso-surface
  double turn_rad = 0;        ///< rotation per tick about a random axis; if not 0, the gap is
                              ///< that of the sphere around the tool
  double unit_mm = 0.1, period_s = 0.001;  ///< of the force alone
};

/// The largest values of a flight; in air spring and force should be 0.
struct Flown {
  int ticks = 0;
  double longest_spring = 0;  ///< units
  /// Force of a coupling with 0.4 N/mm: the larger one without damping and with the highest
  /// damping that a scene may have.
  double force_n = 0;
  int most_queries = 0;
};

/// Adds the coupling's force for a `spring` from the hand to the proxy and a motion of the hand.
template <class N>
void add_air_force(const AirFlight& flight, Point spring, Point moved, Flown& flown) {
  const auto at_device = [](Point p, double scale) {
    using Real = typename N::Real;
    return DeviceVec<typename N::Real>{Real(p[0] * scale), Real(p[1] * scale), Real(p[2] * scale)};
  };
  for (const double damping : {0.0, kMaxDampingNsPerMm}) {
    const VirtualCoupling<N> coupling{typename N::Ratio(0.4), typename N::Unit(damping)};
    const auto force = virtual_coupling_force(coupling, at_device(spring, flight.unit_mm),
                                              at_device(moved, flight.unit_mm / flight.period_s));
    flown.force_n = std::max(flown.force_n, double(norm(force)));
  }
}

template <class N>
void fly(const SampledTool& tool, const AirWall& wall, const AirFlight& flight, int ticks,
         RandomNumbers& random, Flown& flown) {
  Orientation<N> orientation = random.rotation<N>(random.uniform(0, 3));
  const auto rows = rows_of(orientation);
  double below = 0, reach = 0;
  for (const Point& sample : tool.samples) {
    double height = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) {
        height += wall.frame.up[i] * double(rows[i][j]) * sample[j];
      }
    }
    below = std::max(below, -height);
    reach = std::max(reach, length(sample));
  }
  const double height = (flight.turn_rad > 0 ? reach : below) + flight.gap_units;
  const double half = std::max(0.3 * AirWall::kEdge, 0.65 * flight.units_per_tick);
  double at = random.uniform(-half, half), way = flight.units_per_tick;
  const Point far = wall.frame.at(at, 3 * reach, 0);
  GuidedTool<N> guided(tool, wall.body, far);
  for (int i = 0; i < 20; ++i)
    static_cast<void>(guided.tick(far, orientation));  // it takes time to turn
  guided.start(wall.frame.at(at, height, 0));
  Point last = wall.frame.at(at, height, 0);
  for (int i = 0; i <= ticks; ++i) {
    const Point hand = wall.frame.at(at, height, 0);
    // The hand, as the numbers of the sweep have it.
    const Point hand_felt = point_of<N>(place_of<N>(hand));
    static_cast<void>(guided.tick(hand, orientation));
    const Point spring = guided.proxy() - hand_felt;
    if (i > 0) {
      ++flown.ticks;
      add_air_force<N>(flight, spring, hand - last, flown);
      flown.longest_spring = std::max(flown.longest_spring, length(spring));
      flown.most_queries = std::max(flown.most_queries, guided.swept().queries);
    }
    last = hand;
    if (std::abs(at + way) > half) way = -way;
    at += way;
    if (flight.turn_rad > 0)
      orientation = compose(random.rotation<N>(flight.turn_rad), orientation);
  }
}

/// A hand that slides a ball of radius 8 over a bump.
struct BumpSlide {
  double bump = 40;   ///< its radius
  double step = 0.5;  ///< of the hand in a tick
  double depth = 2;   ///< of the hand below the rest position of the ball
  /// Share of full density by signed distance.
  std::function<double(double)> share = [](double distance) { return 0.5 - distance / 2; };
};

/// The largest figures of all slides.
struct SlideFigures {
  double force_step = 0;  ///< over the mean force
  double degrees = 0;     ///< between force and normal
  double height_sd = 0;   ///< of the proxy about its mean height
  double height = 0;      ///< of the proxy over its ideal position: magnitude of the mean
  int queries = 0;        ///< in a tick
};

inline constexpr double kSlideRadius = 8;

/// A bump in a cube of 60, turned at random, and the path of the hand over it.
class Bump {
 public:
  Bump(const BumpSlide& slide, RandomNumbers& random)
      : slide_(slide), frame_(random, {28, 28, 28}) {
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

/// F8 of docs/contact.md: slides once over the bump.
template <class N>
void slide_over(const BumpSlide& slide, RandomNumbers& random, SlideFigures& figures) {
  const Bump bump(slide, random);
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

enum class EdgeWay { along, over };

/// Slides at a sharp convex edge of 90 degrees that lies along `frame.across`, in any pose in a
/// volume. Density is the solid's fraction of a cube of two units, turned with the edge, as in a
/// scan. The ramp of the distance from the solid does not work: a voxel grid holds no ridge of it,
/// and the trilinear iso-surface is a row of bumps (docs/contact.md).
///
/// The hand is `depth` units below the ideal rest position of the tool and goes `step` units a
/// tick, 12 units along the edge, or round it from 0.6 rad on one side to 0.6 on the other. There
/// the ideal force is constant or turns with the hand.
struct EdgeSlide {
  double step = 0.05, depth = 2;
  EdgeWay way = EdgeWay::along;
};

/// One slide's forces, over the stiffness, and their largest angle to the ideal ones.
struct EdgeFigures {
  Roughness roughness;
  double degrees = 0;
};

/// `axes`: of the tool's pose. A ball has the radius 8.
template <class N>
[[nodiscard]] EdgeFigures slide_at_edge(const EdgeSlide& slide, const SceneTool& shape,
                                        const SampledTool& tool, const Frame& frame,
                                        const Axes& axes, double lean) {
  const Reach reach(shape);
  const auto normal_at = [&](double angle) {
    return std::cos(angle) * frame.up + std::sin(angle) * frame.along;
  };
  struct Hand {
    Point centre, normal;
  };
  const auto at = [&](double angle, double along) {
    const Point normal = normal_at(angle);
    Point touching =
        tool.round ? -8.0 * normal : axes.to_world(reach.farthest(axes.to_tool(-1 * normal)));
    touching = touching - dot(touching, frame.across) * frame.across;  // the edge is long
    return Hand{frame.place + along * frame.across - touching, normal};
  };
  constexpr double kEnd = 0.6, kHalf = 6;  // rad, units
  std::vector<Hand> path;
  if (slide.way == EdgeWay::along) {
    for (double s = -kHalf; s < kHalf; s += slide.step) path.push_back(at(lean, s));
  } else {
    constexpr int kFine = 20000;
    for (int i = 0; i <= kFine; ++i) {
      const Hand next = at(kEnd * (2.0 * i / kFine - 1), 0);
      const auto place = [&](const Hand& hand) { return hand.centre - slide.depth * hand.normal; };
      if (path.empty() || length(place(next) - place(path.back())) >= slide.step) {
        path.push_back(next);
      }
    }
  }
  const Body body = body_of({52, 52, 52}, [&](Point p) {
    const Point from = p - frame.place;
    const double height = dot(from, frame.up), aside = dot(from, frame.along);
    const auto covered = [](double d) { return std::clamp(0.5 - d / 2, 0.0, 1.0); };
    return covered((height + aside) * std::sqrt(0.5)) * covered((height - aside) * std::sqrt(0.5));
  });
  const Orientation<N> orientation = axes.orientation<N>();
  const auto hand_of = [&](const Hand& hand, double depth) {
    return hand.centre - depth * hand.normal;
  };
  constexpr double kHigh = 12;  // the tool turns first
  GuidedTool<N> guided(tool, body, hand_of(path.front(), -kHigh));
  for (int i = 0; i < 100; ++i) guided.tick(hand_of(path.front(), -kHigh), orientation);
  for (double depth = -kHigh; depth < slide.depth; depth += 0.1)
    guided.tick(hand_of(path.front(), depth), orientation);
  EdgeFigures figures;
  for (const Hand& hand : path) {
    const Point force = guided.tick(hand_of(hand, slide.depth), orientation);
    figures.roughness.add(force);
    figures.degrees = std::max(figures.degrees, degrees_between(force, hand.normal));
  }
  return figures;
}

/// Rests of a tool in any pose on faces whose iso is not half of full density.
struct IsoRests {
  double degrees = 0;  ///< largest angle between force and normal
  double offset = 0;   ///< largest distance from the ideal place, units
};

/// `count` rests at a fraction `iso` of full density, on planes (`bump` = 0) or on balls of that
/// radius, at random tilts. Density rises to `full` over two units: the face of `iso` lies
/// 1 - 2 iso / full units outside of the face of half density, with the same normal.
template <class N>
[[nodiscard]] IsoRests rest_at_iso(const SceneTool& shape, const SampledTool& tool, double iso,
                                   double bump, int count, double full = 1) {
  const Reach reach(shape);
  RandomNumbers random(8);
  IsoRests found;
  for (int k = 0; k < count; ++k) {
    const Frame frame(random, {21, 21, 21});
    const Axes axes = standing_on(random.direction(), random);
    const Point touching =
        tool.round ? -8.0 * frame.up : axes.to_world(reach.farthest(axes.to_tool(-1 * frame.up)));
    const double outward = 1 - 2 * iso / full;
    const Point middle = frame.place + touching - (bump + outward) * frame.up;
    const Body body = body_of({44, 44, 44}, [&](Point p) {
      const Point from = p - middle;
      const double distance = bump > 0 ? length(from) - bump : dot(from, frame.up);
      return full * std::clamp(0.5 - distance / 2, 0.0, 1.0);
    });
    const auto level = static_cast<Density>(std::lround(iso * kDensityMax));
    const Point rest = rest_of<N>(tool, body, frame.place, frame.up, axes.orientation<N>(),
                                  tool.round ? 4 : 20, level);
    const Point force = rest - frame.at(0, -1, 0);
    found.degrees = std::max(found.degrees, degrees_between(force, frame.up));
    found.offset = std::max(found.offset, std::abs(dot(rest - frame.place, frame.up)));
  }
  return found;
}

/// A ball; or a cylinder or a mesh, which are turned at random.
struct ShakenTool {
  bool round = true;
  double radius = 8, half = 8;
  const SceneTool* mesh = nullptr;  ///< instead of a cylinder; the caller's

  [[nodiscard]] SceneTool made() const {
    return mesh != nullptr ? *mesh : tool_of_units(round ? "ball" : "cylinder", radius, 2 * half);
  }
  [[nodiscard]] double reach() const {
    if (mesh == nullptr) return round ? radius : std::hypot(radius, half);
    double farthest = 0;
    for (const Point& point : mesh->mesh.points_mm) farthest = std::max(farthest, length(point));
    return farthest;
  }
  /// Its reach down along `up` from its centre.
  template <class N>
  [[nodiscard]] double reach_below(const Orientation<N>& orientation, Point up) const {
    if (round) return radius;
    const auto rows = rows_of(orientation);
    Point in_tool{};  // `up` along the tool's axes
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) in_tool[j] += double(rows[i][j]) * up[i];
    }
    if (mesh != nullptr) {
      double lowest = 0;
      for (const Point& point : mesh->mesh.points_mm) {
        lowest = std::min(lowest, dot(point, in_tool));
      }
      return -lowest;
    }
    const double axis = std::abs(in_tool[1]);
    return half * axis + radius * std::sqrt(std::max(0.0, 1 - axis * axis));
  }
};

/// Counts and extremes at the walls.
struct Shaken {
  long ticks = 0;
  long behind = 0;       ///< with the hand behind the face
  long unfelt = 0;       ///< of these: without force
  long crossed = 0;      ///< with the proxy's centre behind the face
  long turned_late = 0;  ///< with less turn than the hand's
  int most_queries = 0;
  double deepest = 0;       ///< of the proxy below the face
  double longest_jump = 0;  ///< of the proxy in a tick
};

/// F7 of docs/contact.md: a hand at the face of a wall of `thickness` units, tilted anyhow, goes
/// random steps of 0.1 to 10 m/s (at 0.1 mm a unit and 1 kHz), with small turns and large ones. No
/// supervisor stops it. `made` is the tool's. Depths and crossings count from density 1/2.
template <class N>
void shake(double thickness, const ShakenTool& tool, const SampledTool& made, int ticks,
           RandomNumbers& random, Shaken& seen, Density iso = kIso) {
  const Frame frame(random, {32, 32, 32});
  const Body wall = blurred({66, 66, 66}, [&](Point p) {
    const double height = frame.of(p)[1];
    return thickness > 40 ? height : std::abs(height + thickness / 2) - thickness / 2;
  });
  Point hand = frame.at(0, tool.reach() + 3, 0);
  Orientation<N> orientation;
  GuidedTool<N> guided(made, wall, hand, 0, iso);
  for (int i = 0; i < ticks; ++i) {
    hand = hand + std::pow(10.0, random.uniform(0, 2)) * random.direction();
    const Point h = frame.of(hand);
    const double aside = std::max(1.0, std::hypot(h[0], h[2]) / 10);  // stay inside of the volume
    hand = frame.at(h[0] / aside, std::clamp(h[1], -14.0, 14.0), h[2] / aside);
    orientation = compose(random.rotation<N>(i % 3 == 0 ? 3 : random.uniform(0, 0.2)), orientation);
    const Point before = guided.proxy();
    const double spring = length(guided.tick(hand, orientation));

    const double below = tool.reach_below(guided.pose().orientation, frame.up);
    const double height = frame.of(guided.proxy())[1];
    ++seen.ticks;
    seen.most_queries = std::max(seen.most_queries, guided.swept().queries);
    seen.deepest = std::max(seen.deepest, below - height);
    seen.longest_jump = std::max(seen.longest_jump, length(guided.proxy() - before));
    seen.crossed += height < 0 ? 1 : 0;
    seen.turned_late += guided.swept().turned ? 0 : 1;
    if (frame.of(hand)[1] < below - 0.1) {
      ++seen.behind;
      seen.unfelt += spring < 0.05 ? 1 : 0;
    }
  }
}

}  // namespace kerf::extremes
