// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "controller/kernel/point_shell/point_table.hpp"
#include "shared/volume/voxel_grid.hpp"

// Sums over the samples of a point shell, and power sums over close samples: the definitions, whose
// bits every instruction set has.

namespace kerf {

/// The reading of one sample: the density of contact, 0..1 (fixed: 0..32767), and its gradient
/// along the voxel axes. The gradient of fixed is that of the volume's densities over 2, before
/// `DensityScale`.
template <class N>
struct PointSample {
  PointNumber<N> density{};
  PointNumber<N> gradient[3] = {};
};

/// A sample below 1/16 has weight 0: it is noise, and w has no bits left for it.
template <class N>
inline constexpr PointNumber<N> kFaintest = N::kIsFixed ? PointNumber<N>(2048)
                                                        : PointNumber<N>(0.0625);

/// a + (b - a) w; fixed: w in Q0.15, rounded half up.
template <class N>
[[nodiscard]] constexpr PointNumber<N> point_lerp(PointNumber<N> a, PointNumber<N> b,
                                                  PointNumber<N> w) noexcept {
  if constexpr (N::kIsFixed) {
    return a + (((b - a) * w + (1 << 14)) >> 15);
  } else {
    return a + (b - a) * w;
  }
}

/// Reads the volume at a position in voxels (fixed: Q15.16), trilinear (docs/theory.md 2.2).
/// Returns 0 if one of the eight voxels would be outside: volumes end in air. A density that is
/// clipped at 1 has no gradient.
///
/// Fixed keeps 15 bits of density and rounds at each of the three blends: within 2.5 steps of the
/// exact value. Differences have 16 bits, products 31.
template <class N>
[[nodiscard]] constexpr PointSample<N> point_sample(const DensityField& field,
                                                    const PointNumber<N> (&place)[3]) noexcept {
  using S = PointNumber<N>;
  std::int32_t low[3] = {};
  S w[3] = {};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if constexpr (N::kIsFixed) {
      low[axis] = place[axis] >> 16;
      w[axis] = (place[axis] & 0xffff) >> 1;
    } else {
      low[axis] = static_cast<std::int32_t>(place[axis]);
      if (S(low[axis]) > place[axis]) --low[axis];
      w[axis] = place[axis] - S(low[axis]);
    }
  }
  const VoxelGrid& grid = field.grid;
  if (low[0] < 0 || low[1] < 0 || low[2] < 0 || low[0] >= grid.nx - 1 || low[1] >= grid.ny - 1 ||
      low[2] >= grid.nz - 1) {
    return {};
  }
  const Density* voxel = field.density + grid.index(low[0], low[1], low[2]);
  const auto row = static_cast<std::size_t>(grid.nx);
  const std::size_t plane = row * static_cast<std::size_t>(grid.ny);
  const auto blend = [](S a, S b, S t) { return point_lerp<N>(a, b, t); };
  S at[2], along_y[2], along_z[2];  // by the x of the corner
  for (std::size_t x = 0; x < 2; ++x) {
    const auto corner = [&](std::size_t y, std::size_t z) {
      const Density d = voxel[x + y * row + z * plane];
      return N::kIsFixed ? S(d >> 1) : S(d) / S(2);
    };
    const S near_z = blend(corner(0, 0), corner(1, 0), w[1]);
    const S far_z = blend(corner(0, 1), corner(1, 1), w[1]);
    const S near_y = blend(corner(0, 0), corner(0, 1), w[2]);
    const S far_y = blend(corner(1, 0), corner(1, 1), w[2]);
    at[x] = blend(near_z, far_z, w[2]);
    along_y[x] = far_y - near_y;
    along_z[x] = far_z - near_z;
  }
  PointSample<N> sample;
  const S read = blend(at[0], at[1], w[0]);
  sample.gradient[0] = at[1] - at[0];
  sample.gradient[1] = blend(along_y[0], along_y[1], w[0]);
  sample.gradient[2] = blend(along_z[0], along_z[1], w[0]);
  bool clipped = false;
  if constexpr (N::kIsFixed) {
    const std::uint32_t scaled =
        static_cast<std::uint32_t>(read) * field.scale.mantissa >> field.scale.shift;
    clipped = scaled > 32767;
    sample.density = clipped ? 32767 : static_cast<S>(scaled);
  } else {
    const S scale = scale_factor<S>(field.scale) / S(32768);
    clipped = read * scale > S(1);
    sample.density = clipped ? S(1) : read * scale;
    for (S& slope : sample.gradient) slope *= scale;
  }
  if (clipped) sample.gradient[0] = sample.gradient[1] = sample.gradient[2] = S(0);
  return sample;
}

/// Adds sample i. Fixed: r^2 in Q16, r^3 and the weights in Q24, each product of 32 unsigned
/// bits.
template <class N>
constexpr void add_sample(PointSums<N>& sums, std::int32_t i, const PointSample<N>& sample,
                          const PointNumber<N> (&offset)[3], bool round) noexcept {
  using Sum = typename N::Sum;
  const PointNumber<N> r = sample.density;
  if (r < kFaintest<N>) return;
  Sum square{}, weight{}, pull{}, lift{};  // r^2, w, w_g, w_x
  if constexpr (N::kIsFixed) {
    const auto density = static_cast<std::uint32_t>(r);
    const std::uint32_t r2 = (density * density + (1 << 13)) >> 14;
    const std::uint32_t r3 = (r2 >> 1) * density >> 6;
    const std::uint32_t r4 = (r2 * r2 + (1 << 15)) >> 16;
    square = r2;
    weight = round ? r2 * r2 >> 8 : r4 * r2 >> 8;
    pull = round ? 3 * weight - r3 : weight;
    lift = round ? (r3 >> 8) * r2 >> 8 : weight;
  } else {
    square = r * r;
    weight = round ? square * square : square * square * square;
    pull = round ? Sum(3) * weight - square * r : weight;
    lift = round ? weight * r : weight;
  }
  sums.weight += weight;
  sums.density += weight * r;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    sums.gradient[axis] += pull * sample.gradient[axis];
    sums.offset[axis] += lift * offset[axis];
  }
  if (r >= sums.top) {
    sums.top = r;
    sums.top_sample = i;
  }
  sums.square += weight * square;
  if (round) return;
  Sum high = weight * square;
  if constexpr (N::kIsFixed) high = (weight >> 8) * square >> 8;
  sums.high += high;
  for (std::size_t axis = 0; axis < 3; ++axis) sums.high_offset[axis] += high * offset[axis];
}

/// One axis of an offset in voxels: see PointStep.
template <class N>
[[nodiscard]] constexpr PointNumber<N> point_offset(const PointStep<N>& step, std::size_t axis,
                                                    const PointNumber<N> (&offset)[3]) noexcept {
  const auto& row = step.row[axis];
  const PointNumber<N> turned = row[0] * offset[0] + row[1] * offset[1] + row[2] * offset[2];
  if constexpr (N::kIsFixed) {
    return (turned + (1 << (step.shift - 1))) >> step.shift;
  } else {
    return turned;
  }
}

template <class N>
constexpr void transform_points(const PointTable<N>& table, const PointStep<N>& step,
                                const PointPositions<N>& places) noexcept {
  const auto place = [&step](const auto& from, const auto& to, std::int32_t count) {
    for (std::int32_t i = 0; i < count; ++i) {
      const PointNumber<N> offset[3] = {from[0][i], from[1][i], from[2][i]};
      for (std::size_t axis = 0; axis < 3; ++axis)
        to[axis][i] = point_offset<N>(step, axis, offset);
    }
  };
  place(table.offset, places.offset_vox, table.count);
  place(table.middle, places.middle, table.groups);
  constexpr PointNumber<N> kNone(N::kIsFixed ? kNoSampleVox << 16 : kNoSampleVox);
  for (std::int32_t i = table.count; i < table.groups * kPointGroup; ++i) {
    places.offset_vox[0][i] = kNone;
  }
}

/// The densities of `count` samples, a multiple of kPointGroup.
template <class N>
constexpr void read_points(const PointPositions<N>& places, std::int32_t count,
                           const PointNumber<N> (&centre)[3], const DensityField& field,
                           PointNumber<N>* density) noexcept {
  for (std::int32_t i = 0; i < count; ++i) {
    const PointNumber<N> place[3] = {place_at<N>(centre[0], places.offset_vox[0][i]),
                                     place_at<N>(centre[1], places.offset_vox[1][i]),
                                     place_at<N>(centre[2], places.offset_vox[2][i])};
    density[i] = point_sample<N>(field, place).density;
  }
}

/// Whether the volume is free around a group, so that its samples would read air.
template <class N>
[[nodiscard]] constexpr bool is_free(const PointTable<N>& table, const PointPositions<N>& places,
                                     const PointNumber<N> (&centre)[3], const DensityField& field,
                                     std::int32_t group) noexcept {
  std::int32_t middle[3] = {};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto at = place_at<N>(centre[axis], places.middle[axis][group]);
    middle[axis] =
        N::kIsFixed ? static_cast<std::int32_t>(at) >> 16 : static_cast<std::int32_t>(at);
  }
  return field.free.at(middle[0], middle[1], middle[2]) >= table.needed[group];
}

/// The sums of one query. Skips groups in free space.
/// `centre` of the tool is in voxels (fixed: Q15.16).
template <class N>
[[nodiscard]] constexpr PointSums<N> point_sums(const PointTable<N>& table,
                                                const PointPositions<N>& places,
                                                const PointNumber<N> (&centre)[3],
                                                const DensityField& field) noexcept {
  PointSums<N> sums;
  const VoxelGrid& grid = field.grid;
  if (grid.nx < 2 || grid.ny < 2 || grid.nz < 2) return sums;  // no cell
  for (std::int32_t group = 0; group < table.groups; ++group) {
    if (is_free(table, places, centre, field, group)) continue;
    sums.read += kPointGroup;
    for (std::int32_t i = group * kPointGroup; i < (group + 1) * kPointGroup; ++i) {
      const PointNumber<N> place[3] = {place_at<N>(centre[0], places.offset_vox[0][i]),
                                       place_at<N>(centre[1], places.offset_vox[1][i]),
                                       place_at<N>(centre[2], places.offset_vox[2][i])};
      const PointNumber<N> offset[3] = {table.offset[0][i], table.offset[1][i], table.offset[2][i]};
      add_sample<N>(sums, i, point_sample<N>(field, place), offset, table.round);
    }
  }
  return sums;
}

/// The close samples of one closeup, in whole groups. Padding in the last group has density 0.
template <class N>
struct CloseSampleView {
  std::int32_t count = 0;
  const PointNumber<N>* offset[3] = {};  ///< as in CloseTable
  const PointNumber<N>* normal[3] = {};
  PointNumber<N> middle[3] = {}, radius{};  ///< of the query, in the units of the offsets
  const PointNumber<N>* density = nullptr;
  PointNumber<N>* window = nullptr;  ///< memory for the window of each
};

/// Sums over samples, weighted with a power p of t, their density over the highest (docs/theory.md
/// 3.5). Fixed: t, its powers, offsets and normals in Q15.
template <class N>
struct PowerSums {
  typename N::Sum weight{}, density{}, offset[3]{};  ///< SUM t^p, SUM t^p t, SUM t^p offset
};
template <class N>
struct NormalSums {
  typename N::Sum weight{}, normal[3]{};  ///< SUM t^p, SUM t^p normal
};

/// The sums of a closeup (closeup.hpp) over its samples. If every sample is faint only `top` is
/// set.
template <class N>
struct CloseSums {
  static constexpr int kLowPower = 32, kHighPower = 64;  ///< of height and place
  static constexpr int kNormalPower = 16;                ///< of the tool's normal

  PointNumber<N> top{};  ///< density of the highest
  NormalSums<N> facing;
  PowerSums<N> low, high;
};

/// Product of two fractions, 0 to 1; fixed: Q15.
template <class N>
[[nodiscard]] constexpr PointNumber<N> share_product(PointNumber<N> a, PointNumber<N> b) noexcept {
  if constexpr (N::kIsFixed) {
    return (a * b + (1 << 14)) >> 15;
  } else {
    return a * b;
  }
}

/// Window of sample i: (1 - d^2/R^2)^2 at the distance d from the middle of the closeup, 0 from its
/// radius R on. So samples enter and leave without a jump as the closeup moves
/// (docs/theory.md 3.5). `over_radius`: 2^30 over the radius; of floating point 1 over it.
template <class N>
[[nodiscard]] constexpr PointNumber<N> close_window(const CloseSampleView<N>& look,
                                                    PointNumber<N> over_radius,
                                                    std::int32_t i) noexcept {
  using Number = PointNumber<N>;
  Number rest = N::kIsFixed ? Number(1 << 15) : Number(1);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Number along =
        std::clamp(look.offset[axis][i] - look.middle[axis], -look.radius, look.radius);
    Number share = along * over_radius;
    if constexpr (N::kIsFixed) share >>= 15;
    rest -= share_product<N>(share, share);
  }
  rest = std::max(rest, Number(0));
  return share_product<N>(rest, rest);
}
template <class N>
[[nodiscard]] constexpr PointNumber<N> over_radius(const CloseSampleView<N>& look) noexcept {
  return (N::kIsFixed ? PointNumber<N>(1 << 30) : PointNumber<N>(1)) / look.radius;
}

/// Sums over the samples of a closeup. The definition: every set has these bits.
template <class N>
[[nodiscard]] constexpr CloseSums<N> close_sums(const CloseSampleView<N>& look) noexcept {
  using Number = PointNumber<N>;
  CloseSums<N> sums;
  const Number over = over_radius(look);
  for (std::int32_t i = 0; i < look.count; ++i) {
    look.window[i] = close_window(look, over, i);
    if (look.window[i] > Number(0)) sums.top = std::max(sums.top, look.density[i]);
  }
  if (sums.top < kFaintest<N>) return sums;
  using Sum = typename N::Sum;
  const auto add_normal = [&look](NormalSums<N>& to, Number power, std::int32_t i) {
    to.weight += power;
    for (std::size_t axis = 0; axis < 3; ++axis)
      to.normal[axis] += Sum(power) * look.normal[axis][i];
  };
  const auto add = [&look](PowerSums<N>& to, Number power, Number t, std::int32_t i) {
    to.weight += power;
    to.density += Sum(power) * t;
    for (std::size_t axis = 0; axis < 3; ++axis)
      to.offset[axis] += Sum(power) * look.offset[axis][i];
  };
  const auto windowed = [&look](Number power, std::int32_t i) {
    return share_product<N>(power, look.window[i]);
  };
  const auto share = [&sums](Number of) {
    if constexpr (N::kIsFixed) {
      const std::uint32_t over_top = (1U << 31) / static_cast<std::uint32_t>(sums.top);
      return static_cast<Number>(static_cast<std::uint32_t>(of) * over_top >> 16);
    } else {
      return of / sums.top;
    }
  };
  for (std::int32_t i = 0; i < look.count; ++i) {
    if (!(look.window[i] > Number(0))) continue;  // it may be higher than the highest of the window
    const Number t = share(look.density[i]);
    Number power = t;
    for (int p = 1; p < CloseSums<N>::kNormalPower; p *= 2) power = share_product<N>(power, power);
    add_normal(sums.facing, windowed(power, i), i);
    power = share_product<N>(power, power);
    add(sums.low, windowed(power, i), t, i);
    add(sums.high, windowed(share_product<N>(power, power), i), t, i);
  }
  return sums;
}

}  // namespace kerf
