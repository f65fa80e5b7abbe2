// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "controller/volume/phantom.hpp"
#include "shared/numeric/linear_algebra.hpp"

// The implicit fields of phantom.hpp. Sizes follow textbook averages of the lower first molar:
// crown 11 x 10 x 7 mm, roots 12 mm. x is mesial, y buccal, z occlusal. No libm besides sqrt, so
// the bits do not depend on the machine.

namespace kerf::phantom {
namespace {

/// Minimum with a rounded edge if the arguments differ by less than `k`, with a slope not above
/// theirs. If they differ by more, it is the smaller one, bit by bit.
double smooth_min(double a, double b, double k) noexcept {
  const double h = std::max(k - std::abs(a - b), 0.0);
  return std::min(a, b) - h * h / (4.0 * k);
}
double smooth_max(double a, double b, double k) noexcept {
  return -smooth_min(-a, -b, k);
}

/// 1 at 0, falls smoothly to 0 at |t| = 1.
double bump(double t) noexcept {
  const double s = 1.0 - std::min(t * t, 1.0);
  return s * s;
}

/// 0 below `lo`, 1 above `hi`, smooth between.
double ramp(double lo, double hi, double x) noexcept {
  const double t = std::clamp((x - lo) / (hi - lo), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

/// A smooth curve through knots over z (cubic Hermite, slopes from the neighbours), constant
/// outside.
template <std::size_t N>
struct Profile {
  struct Knot {
    double z, value;
  };
  std::array<Knot, N> knot;

  [[nodiscard]] double operator()(double z) const noexcept {
    if (z <= knot.front().z) return knot.front().value;
    if (z >= knot.back().z) return knot.back().value;
    std::size_t i = 0;
    while (z > knot[i + 1].z) ++i;
    const double step = knot[i + 1].z - knot[i].z;
    const double t = (z - knot[i].z) / step;
    const double rise = knot[i + 1].value - knot[i].value;
    const double in = slope(i) * step - rise;
    const double out = rise - slope(i + 1) * step;
    return knot[i].value + t * (rise + (1.0 - t) * (in * (1.0 - t) + out * t));
  }

 private:
  [[nodiscard]] double slope(std::size_t i) const noexcept {
    const Knot& before = knot[i == 0 ? 0 : i - 1];
    const Knot& after = knot[std::min(i + 1, N - 1)];
    return (after.value - before.value) / (after.z - before.z);
  }
};

// --- Crown -------------------------------------------------------------------------------------

constexpr Profile<7> kHalfWidthX{
    {{{-2.0, 4.1}, {0.8, 4.3}, {2.2, 4.55}, {4.0, 5.1}, {6.0, 5.4}, {8.0, 5.3}, {10.0, 4.8}}}};
constexpr Profile<7> kHalfWidthY{
    {{{-2.0, 3.9}, {0.8, 4.2}, {2.2, 4.45}, {3.8, 4.95}, {5.5, 4.95}, {7.8, 4.35}, {10.0, 3.3}}}};
constexpr Profile<4> kTiltY{{{{1.0, 0.0}, {4.0, 0.05}, {7.0, -0.3}, {10.0, -0.8}}}};  // lingual

/// Height above the line where enamel ends: lower on the buccal and lingual sides.
double above_neck(Point p) noexcept {
  const double xx = p.x * p.x;
  return p.z - 1.9 - 0.9 * xx / (xx + p.y * p.y + 4.0);
}

/// Vertical groove of the crown's side: at `x`, on the side of `sign` (+1 buccal, -1 lingual).
double side_groove(Point p, const Level& level, double sign, double x, double width,
                   double depth) noexcept {
  return depth * bump((p.x - x) / width) * ramp(1.0, 3.0, sign * p.y) * level.groove;
}

double crown_side(Point p, const Level& level) noexcept {
  const double a = level.half_x;
  const double b = level.half_y;
  const double u = p.x / a;
  // The mesial half is a little wider than the distal one.
  const double v = (p.y - level.tilt_y) / (b * (1.0 + 0.06 * std::clamp(u, -1.0, 1.0)));
  const double uu = u * u;
  const double vv = v * v;
  // Between an ellipse and a rounded rectangle.
  const double rho = 0.5 * (std::sqrt(uu + vv) + std::sqrt(std::sqrt(uu * uu + vv * vv)));
  return (rho - 1.0) * 0.5 * (a + b) + side_groove(p, level, 1.0, 1.1, 1.0, 0.55) +
         side_groove(p, level, 1.0, -2.6, 0.8, 0.4) + side_groove(p, level, -1.0, 0.1, 1.0, 0.5);
}

/// A cusp: a rounded tip, and a ridge that falls from it towards the middle of the tooth.
struct Cusp {
  double x, y, height;
  double ridge_x, ridge_y;  ///< where the ridge ends
  double drop;              ///< how far the ridge has fallen there
};
constexpr std::array<Cusp, 5> kCusps{{{3.0, 2.6, 9.0, 1.5, 0.2, 1.25},        // mesiobuccal
                                      {-0.7, 2.8, 8.9, -0.6, 0.2, 1.25},      // distobuccal
                                      {-3.6, 1.35, 8.4, -2.2, 0.0, 0.8},      // distal
                                      {2.6, -3.0, 9.45, 1.2, -0.6, 1.7},      // mesiolingual
                                      {-2.1, -3.0, 9.3, -1.2, -0.6, 1.55}}};  // distolingual
constexpr std::array<Cusp, 2> kMarginalRidges{
    {{4.5, 1.4, 7.9, 4.5, -1.7, 0.0}, {-4.5, 0.3, 7.65, -4.1, -1.8, -0.1}}};

double ridge_height(const Cusp& c, Point p, double slope, double radius) noexcept {
  const double dx = c.ridge_x - c.x;
  const double dy = c.ridge_y - c.y;
  const double along = ((p.x - c.x) * dx + (p.y - c.y) * dy) / (dx * dx + dy * dy);
  const double t = std::clamp(along, 0.0, 1.0);
  const double side = vec3::length({p.x - c.x - t * dx, p.y - c.y - t * dy, radius});
  const double fall = t * t * (2.0 - t);  // level at the tip
  return c.height - c.drop * fall - slope * (side - radius);
}

constexpr double kLowestOcclusal = 5.6;

/// Height of the chewing surface over (x, y). Grooves are where the slopes of two cusps meet.
double occlusal_height(Point p) noexcept {
  constexpr double kCuspSlope = 1.25;
  double height = kLowestOcclusal;
  for (const Cusp& cusp : kCusps) {
    height = smooth_max(height, ridge_height(cusp, p, kCuspSlope, 1.5), 0.2);
  }
  for (const Cusp& ridge : kMarginalRidges) {
    height = smooth_max(height, ridge_height(ridge, p, 1.2, 0.8), 0.3);
  }
  return height;
}

// --- Roots -------------------------------------------------------------------------------------

/// A root: an oval tube along a bent axis, rounded at the apex.
struct Root {
  Profile<4> axis_x;
  Profile<4> half_x, half_y;
  double apex_z;  ///< middle of the rounded end
  double hollow;  ///< depth of the lengthwise furrow that faces the other root, mm
  double facing;  ///< x direction of the other root
};
constexpr Root kMesialRoot{{{{{-9.0, 2.0}, {-5.5, 2.95}, {-2.5, 3.0}, {0.5, 2.2}}}},
                           {{{{-9.0, 0.7}, {-5.0, 1.3}, {-1.5, 1.75}, {1.5, 1.1}}}},
                           {{{{-9.0, 1.25}, {-5.0, 2.6}, {-1.5, 3.5}, {1.5, 2.5}}}},
                           -8.9,
                           0.35,
                           -1.0};
constexpr Root kDistalRoot{{{{{-9.0, -3.7}, {-5.5, -3.25}, {-2.5, -2.75}, {0.5, -2.1}}}},
                           {{{{-9.0, 0.65}, {-5.0, 1.2}, {-1.5, 1.7}, {1.5, 1.1}}}},
                           {{{{-9.0, 0.95}, {-5.0, 2.1}, {-1.5, 3.1}, {1.5, 2.3}}}},
                           -8.3,
                           0.2,
                           1.0};

constexpr double kRootTop = 1.5;  // inside the stem
constexpr double kThickestRoot = 1.8;

Level::Root level_of(const Root& root, double height) noexcept {
  const double z = std::clamp(height, root.apex_z, kRootTop);
  return {z, root.half_x(z), root.half_y(z), root.axis_x(z)};
}

double root_field(const Root& root, const Level::Root& level, Point p) noexcept {
  const double z = level.z;
  const double a = level.half_x;
  const double b = level.half_y;
  const double dx = p.x - level.axis_x;
  const double squeezed_y = p.y * a / b;
  const double furrow = root.hollow * bump(p.y / (0.6 * b)) * ramp(0.0, a, root.facing * dx);
  return vec3::length({dx, squeezed_y, z - p.z}) - a + furrow;
}

double roots_field(Point p, const Level& level) noexcept {
  const auto field = [&](bool mesial) {
    return mesial ? root_field(kMesialRoot, level.mesial_root, p)
                  : root_field(kDistalRoot, level.distal_root, p);
  };
  const bool mesial = p.x > 0.0;
  const double near = field(mesial);
  // Both axes lie at least so far from the middle.
  constexpr double kAside = 2.0;
  if (near <= std::abs(p.x) + kAside - kThickestRoot) return near;
  return std::min(near, field(!mesial));
}

// --- Stem --------------------------------------------------------------------------------------

/// Down to where the roots part; an arch between them.
double stem_bottom(Point p) noexcept {
  return -1.3 + 0.03 * p.y * p.y - p.z;
}

/// The crown, the neck and the stem.
double stem_field(Point p, const Level& level) noexcept {
  constexpr double kEdge = 0.9;
  // The enamel bulges slightly at its margin.
  const double step = 0.14 * ramp(0.0, 0.9, above_neck(p));
  const double side = crown_side(p, level) - step;
  const bool top_is_far = side >= p.z - kLowestOcclusal + kEdge;
  const double crown = top_is_far ? side : smooth_max(side, p.z - occlusal_height(p), kEdge);
  return smooth_max(crown, stem_bottom(p), 1.2);
}

// --- Pulp --------------------------------------------------------------------------------------

/// A straight rod whose radius goes from one end to the other.
double rod(Point p, Point from, double from_radius, Point to, double to_radius) noexcept {
  const double dx = to.x - from.x;
  const double dy = to.y - from.y;
  const double dz = to.z - from.z;
  const double along = ((p.x - from.x) * dx + (p.y - from.y) * dy + (p.z - from.z) * dz) /
                       (dx * dx + dy * dy + dz * dz);
  const double t = std::clamp(along, 0.0, 1.0);
  return vec3::length({p.x - from.x - t * dx, p.y - from.y - t * dy, p.z - from.z - t * dz}) -
         (from_radius + t * (to_radius - from_radius));
}

double pulp_chamber(Point p) noexcept {
  constexpr double kRound = 0.85;
  const double x = std::max(std::abs(p.x) - 1.7, 0.0);
  const double y = std::max(std::abs(p.y) - 1.2, 0.0);
  const double z = std::max(std::abs(p.z - 1.7) - 0.3, 0.0);
  return vec3::length({x, y, z}) - kRound;
}

/// A canal follows the axis of its root, `offset_y` beside it at the orifice and nearer below.
double canal(const Level::Canal& level, double offset_y, Point p) noexcept {
  const double t = level.down;
  const double x = p.x - level.axis_x;
  const double y = p.y - offset_y * (0.3 + 0.7 * t);
  return vec3::length({x, y, p.z - level.z}) - (0.17 + 0.38 * t);
}

Level::Canal canal_level(const Root& root, double height) noexcept {
  const double bottom = root.apex_z - 0.2;
  const double z = std::clamp(height, bottom, kRootTop);
  return {z, (z - bottom) / (kRootTop - bottom), root.axis_x(z)};
}

constexpr double kStep = 1.0 / 128.0;  // mm; a power of two, far below the smallest radius

}  // namespace

// Parts that a bound keeps out of a smooth minimum or maximum are not computed.

Level::Level(double z) noexcept
    : half_x(kHalfWidthX(z)),
      half_y(kHalfWidthY(z)),
      tilt_y(kTiltY(z)),
      groove(ramp(4.0, 7.5, z)),
      mesial_root(level_of(kMesialRoot, z)),
      distal_root(level_of(kDistalRoot, z)),
      mesial_canal(canal_level(kMesialRoot, z)),
      distal_canal(canal_level(kDistalRoot, z)) {}

Levels::Levels(double z) noexcept : here(z), above(z + kStep), below(z - kStep) {}

double outer_field(Point p, const Level& level) noexcept {
  constexpr double kFork = 1.3;
  if (p.z < 0.0) {
    const double roots = roots_field(p, level);
    const bool stem_is_far = roots <= stem_bottom(p) - kFork;
    return stem_is_far ? roots : smooth_min(stem_field(p, level), roots, kFork);
  }
  const double stem = stem_field(p, level);
  const bool roots_are_far = stem <= p.z - kRootTop - kThickestRoot - kFork;
  return roots_are_far ? stem : smooth_min(stem, roots_field(p, level), kFork);
}

double enamel_mm(Point p) noexcept {
  // None at the neck, 1.2 mm at half height, 1.8 mm under the cusps.
  const double above = std::max(above_neck(p), 0.0);
  return 2.4 * above / (above + 2.3);
}

bool is_bare(Point p) noexcept {
  constexpr double kFarMm = 0.1;  // beyond the range of `distance` for every slope of the line
  return above_neck(p) < -kFarMm;
}

double dentin_field(Point p, const Level& level) noexcept {
  return outer_field(p, level) + enamel_mm(p);
}

double pulp_field(Point p, const Level& level) noexcept {
  double field = pulp_chamber(p);
  for (const Cusp& cusp : kCusps) {
    const Point root{0.55 * cusp.x, 0.45 * cusp.y, 1.9};
    const Point tip{0.78 * cusp.x, 0.68 * cusp.y, cusp.height - 4.6};
    field = smooth_min(field, rod(p, root, 0.55, tip, 0.18), 0.4);
  }
  field = smooth_min(field, canal(level.mesial_canal, 1.6, p), 0.3);
  field = smooth_min(field, canal(level.mesial_canal, -1.6, p), 0.3);
  return smooth_min(field, canal(level.distal_canal, 0.0, p), 0.3);
}

double lesion_distance(Point p) noexcept {
  // Below the central fossa, at the border of enamel and dentin.
  constexpr Point kMiddle{0.0, -0.2, 5.2};
  constexpr Point kRadii{1.5, 1.2, 1.2};
  constexpr double kTrackRadius = 0.3;
  const double x = (p.x - kMiddle.x) / kRadii.x;
  const double y = (p.y - kMiddle.y) / kRadii.y;
  const double z = (p.z - kMiddle.z) / kRadii.z;
  const double reach = vec3::length({x, y, z});
  // First order: the ellipsoid's field over the length of its gradient.
  const double steep = vec3::length({x / kRadii.x, y / kRadii.y, z / kRadii.z});
  const double pool = steep > 0.0 ? (reach - 1.0) * reach / steep : -kRadii.z;
  const double track = rod(p, {-0.7, kMiddle.y, 9.0}, kTrackRadius, kMiddle, kTrackRadius);
  const double other = rod(p, {0.7, kMiddle.y, 9.0}, kTrackRadius, kMiddle, kTrackRadius);
  return std::min(pool, std::min(track, other));
}

double solid_distance(std::string_view shape, Point p) noexcept {
  if (shape == "wall") return p.z;
  if (shape == "ball") return vec3::length({p.x, p.y, p.z}) - 8.0;
  const double from_ring = std::sqrt(p.x * p.x + p.y * p.y) - 10.0;
  return std::sqrt(from_ring * from_ring + p.z * p.z) - 4.0;
}

double distance(Field field, Point p, const Levels& levels, double value) noexcept {
  // Where opposite slopes meet, far from a boundary, the gradient vanishes: do not divide by it.
  constexpr double kFlattest = 0.35;
  const Level& here = levels.here;
  const double gx = field({p.x + kStep, p.y, p.z}, here) - field({p.x - kStep, p.y, p.z}, here);
  const double gy = field({p.x, p.y + kStep, p.z}, here) - field({p.x, p.y - kStep, p.z}, here);
  const double gz =
      field({p.x, p.y, p.z + kStep}, levels.above) - field({p.x, p.y, p.z - kStep}, levels.below);
  const double slope = vec3::length({gx, gy, gz}) / (2.0 * kStep);
  return value / std::clamp(slope, kFlattest, kSteepest);
}

}  // namespace kerf::phantom
