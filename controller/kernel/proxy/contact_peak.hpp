// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "controller/kernel/point_shell/point_table.hpp"
#include "controller/kernel/proxy/constraint_set.hpp"
#include "controller/kernel/proxy/contact_space.hpp"
#include "shared/numeric/numbers.hpp"
#include "shared/numeric/vec.hpp"

namespace kerf {

/// The sums of a query over their weights, in contact space. Ratio (Q7.24) holds them; only a
/// gradient can saturate, in a volume whose iso is below 1 % of its range.
template <class N>
struct PointMeans {
  using Ratio = typename N::Ratio;

  Ratio density{}, square{};     ///< of r and of r^2, weighted with w
  ContactVec<Ratio> gradient{};  ///< weighted with w_g, density per unit
  ContactVec<Ratio> offset{};    ///< weighted with w_x, over the tool's reach
  Ratio top{};                   ///< the largest r
};

/// Transform of contact space to one volume: position q is at voxel_from_contact * q + origin_vox.
/// A voxel's edge is at least one unit, so no entry of the matrix is above 1.
template <class N>
struct ContactFrame {
  Transform<typename N::Ratio, VoxelSpace, ContactSpace> voxel_from_contact{};
  VoxelVec<typename N::Real> origin_vox{};
};

/// sum / weight; the weight is above 0. `bits`: 24 less the sum's fraction bits, plus the weight's.
/// Fixed: numerators stay below 2^62 for kMaxShellPoints.
template <class N>
[[nodiscard]] constexpr typename N::Ratio mean_of(typename N::Sum sum, typename N::Sum weight,
                                                  [[maybe_unused]] int bits) noexcept {
  if constexpr (N::kIsFixed) {
    return N::Ratio::from_raw(saturate_i32((sum << bits) / weight));
  } else {
    return sum / weight;
  }
}

/// Rotates an offset from the tool's axes to those of the world.
template <class N>
[[nodiscard]] constexpr ContactVec<typename N::Ratio> turned_offset(
    const typename N::Ratio (&offset)[3], const RotationRows<N>& rotation) noexcept {
  using Ratio = typename N::Ratio;
  const auto turned = [&](const std::array<typename N::Unit, 3>& row) {
    return multiply<Ratio>(row[0], offset[0]) + multiply<Ratio>(row[1], offset[1]) +
           multiply<Ratio>(row[2], offset[2]);
  };
  return {turned(rotation[0]), turned(rotation[1]), turned(rotation[2])};
}

/// All means of a query; `rotation` rotates the mean offset from the tool's axes to the world's.
template <class N>
[[nodiscard]] constexpr PointMeans<N> point_means(const PointSums<N>& sums,
                                                  const DensityScale& scale,
                                                  const ContactFrame<N>& frame,
                                                  const RotationRows<N>& rotation,
                                                  bool round) noexcept {
  using Ratio = typename N::Ratio;
  PointMeans<N> means;
  means.density = mean_of<N>(sums.density, sums.weight, 9);
  means.square = mean_of<N>(sums.square, sums.weight, 8);
  const auto along = [&](typename N::Sum part) {
    const Ratio unscaled = mean_of<N>(part, sums.weight, 9);
    if constexpr (N::kIsFixed) {
      const std::int64_t raw = unscaled.raw();  // 2^28 at most; times 2^16
      return Ratio::from_raw(saturate_i32(round_shift(raw * scale.mantissa, scale.shift)));
    } else {
      return unscaled;
    }
  };
  const VoxelVec<Ratio> in_voxels{along(sums.gradient[0]), along(sums.gradient[1]),
                                  along(sums.gradient[2])};
  means.gradient = transposed(frame.voxel_from_contact) * in_voxels;
  typename N::Sum lift = round ? sums.density : sums.weight;  // SUM w_x
  if constexpr (N::kIsFixed) lift >>= round ? 15 : 0;         // Q24 of Q39: 16 at least
  const Ratio offset[3] = {mean_of<N>(sums.offset[0], lift, 9), mean_of<N>(sums.offset[1], lift, 9),
                           mean_of<N>(sums.offset[2], lift, 9)};
  means.offset = turned_offset<N>(offset, rotation);
  if constexpr (N::kIsFixed) {
    means.top = Ratio::from_raw(sums.top << 9);
  } else {
    means.top = sums.top;
  }
  return means;
}

/// The direction of a vector; 0 if it is too short to have one.
template <class N>
[[nodiscard]] constexpr ContactVec<typename N::Unit> direction(
    ContactVec<typename N::Ratio> v) noexcept {
  using Unit = typename N::Unit;
  const typename N::Ratio length = norm(v);
  if constexpr (N::kIsFixed) {
    if (length.raw() == 0) return {};
    const auto over = [&](typename N::Ratio part) {
      return Unit::from_raw(
          saturate_i32((std::int64_t{part.raw()} << Unit::kFractionBits) / length.raw()));
    };
    return {over(v.x), over(v.y), over(v.z)};
  } else {
    if (!(length > Unit(0))) return {};
    return {v.x / length, v.y / length, v.z / length};
  }
}

/// The exponent e from y = m2 / m1^2 = (p + 2) (p + 1 + e) / ((p + 1) (p + 2 + e)), 0 to 2
/// (docs/theory.md 3.2); p is 4 of a ball, 6 of other shapes.
template <class N>
[[nodiscard]] constexpr typename N::Ratio fall_of(const PointMeans<N>& means, bool round) noexcept {
  using Ratio = typename N::Ratio;
  const Ratio low(round ? 5 : 7), high(round ? 6 : 8), product(round ? 30 : 56);
  const Ratio spread = std::max(Ratio(1), means.square / means.density / means.density);
  const Ratio rest = high - low * spread;
  return rest > Ratio(0.001) ? std::min(product * (spread - Ratio(1)) / rest, Ratio(2)) : Ratio(2);
}

/// Height of the peak of density over the tool's surface, from its power sums (docs/theory.md 3.2).
/// e is half the number of dimensions over which r falls: 1 for a ball; of another shape the mean
/// of r^2 tells it.
template <class N>
[[nodiscard]] constexpr typename N::Ratio peak_height(const PointMeans<N>& means,
                                                      bool round) noexcept {
  using Ratio = typename N::Ratio;
  // A ball touches in a point, e = 1, but where all about it is alike. p = 4 gives 1.2; but samples
  // below 1/16 are left out, and trilinear reads are raised where density begins: on planes the
  // mean is 0.75 % low.
  const Ratio e = fall_of(means, round);
  const Ratio factor =
      Ratio(1) + (round ? static_cast<Ratio>(0.209) * std::min(e, Ratio(1)) : e / Ratio(7));
  // A single spike has few samples and hardly changes the mean, so the height is at least that of
  // the highest sample less kSpike.
  constexpr auto kSpike = static_cast<Ratio>(0.2);
  return std::max(factor * means.density, means.top - kSpike);
}

/// Limits of the slope in a depth (docs/theory.md 3.3), density per unit: flatter is noise, and no
/// face of a volume is steeper.
inline constexpr double kFlattestSlope = 0.2;
inline constexpr double kSteepestSlope = 1.2;

/// A slope that a face may have.
template <class Ratio>
[[nodiscard]] constexpr Ratio slope_of_face(Ratio slope) noexcept {
  return std::clamp(slope, Ratio(kFlattestSlope), Ratio(kSteepestSlope));
}

/// 0 if `value` is `from` or above, 1 if it is `to` or below, linear between; `to` < `from`.
template <class N>
[[nodiscard]] constexpr typename N::Unit falling_ramp(typename N::Unit value, double from,
                                                      double to) noexcept {
  using Unit = typename N::Unit;
  const auto top = static_cast<Unit>(from), bottom = static_cast<Unit>(to);
  return (top - std::clamp(value, bottom, top)) / (top - bottom);
}

/// The direction of (1 - share) a + share b.
template <class N>
[[nodiscard]] constexpr ContactVec<typename N::Unit> between(ContactVec<typename N::Unit> a,
                                                             ContactVec<typename N::Unit> b,
                                                             typename N::Unit share) noexcept {
  using Unit = typename N::Unit;
  using Ratio = typename N::Ratio;
  const Unit rest = Unit(1) - share;
  const auto mixed = [&](Unit p, Unit q) { return Ratio(rest * p + share * q); };
  return direction<N>(ContactVec<Ratio>{mixed(a.x, b.x), mixed(a.y, b.y), mixed(a.z, b.z)});
}

/// A ball's normal (docs/theory.md 3.4): minus the weighted mean offset. In a groove of the ball's
/// own radius that points out of the bottom, whichever wall the ball is in: `downhill`, the
/// derivative of the peak, takes over as the mean falls from 0.85 to 0.7 of the reach and as the
/// two directions part from 20 to 50 degrees. (With 30 to 60 the force steps by 5 % there, not 2.)
/// Without a gradient there is no normal, as of any shape.
template <class N>
[[nodiscard]] constexpr ContactVec<typename N::Unit> ball_normal(
    const PointMeans<N>& means, ContactVec<typename N::Unit> downhill) noexcept {
  using Unit = typename N::Unit;
  using Ratio = typename N::Ratio;
  if (downhill == ContactVec<Unit>{}) return downhill;
  const ContactVec<Unit> offset = direction<N>(-means.offset);
  const Unit cancelled = falling_ramp<N>(Unit(std::min(norm(means.offset), Ratio(1))), 0.85, 0.7);
  const Unit share = cancelled * falling_ramp<N>(dot(offset, downhill), 0.9397, 0.6428);
  return share <= Unit{} ? offset : between<N>(offset, downhill, share);
}

/// How fast density falls along a normal, per unit (docs/theory.md 3.3). w_g holds half of a
/// ball's.
template <class N>
[[nodiscard]] constexpr typename N::Ratio slope_along(const PointMeans<N>& means,
                                                      ContactVec<typename N::Unit> normal,
                                                      bool round) noexcept {
  using Ratio = typename N::Ratio;
  const auto along = [](Ratio gradient, typename N::Unit n) {
    return multiply<Ratio>(gradient, n);
  };
  const Ratio uphill = -(along(means.gradient.x, normal.x) + along(means.gradient.y, normal.y) +
                         along(means.gradient.z, normal.z));
  return slope_of_face(round ? uphill + uphill : uphill);
}

/// (H - 1/2) / slope: how deep the tool is in the solid, units.
template <class N>
[[nodiscard]] constexpr typename N::Real depth_of(typename N::Ratio height,
                                                  typename N::Ratio slope) noexcept {
  return typename N::Real((height - typename N::Ratio(0.5)) / slope);
}

/// The constraint plane of one volume's contact, by the samples of the point shell alone. `reach`
/// of the tool is in units. contact_refinement.hpp corrects it near rest. Its normal is 0 if the
/// density is the same all round the tool.
template <class N>
[[nodiscard]] constexpr ConstraintPlane<N> plane_of(const PointMeans<N>& means,
                                                    typename N::Real reach, bool round) noexcept {
  using Real = typename N::Real;
  const auto downhill = direction<N>(-means.gradient);
  ConstraintPlane<N> plane;
  plane.normal = round ? ball_normal<N>(means, downhill) : downhill;
  plane.depth = depth_of<N>(peak_height(means, round), slope_along(means, plane.normal, round));
  plane.lever = {multiply<Real>(means.offset.x, reach), multiply<Real>(means.offset.y, reach),
                 multiply<Real>(means.offset.z, reach)};
  return plane;
}

}  // namespace kerf
