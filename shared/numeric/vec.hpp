// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <concepts>
#include <cstdint>

#include "shared/numeric/numbers.hpp"

// Vectors and matrices of the servo, tagged with their space; clamping, and the work of a force.

namespace kerf {

/// Three numbers in one space. Vectors of different spaces do not mix; a named transform converts.
template <class S, class Space>
struct Vec {
  S x{}, y{}, z{};

  friend constexpr Vec operator+(Vec a, Vec b) noexcept {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
  }
  friend constexpr Vec operator-(Vec a, Vec b) noexcept {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
  }
  friend constexpr Vec operator-(Vec a) noexcept { return {-a.x, -a.y, -a.z}; }
  friend constexpr Vec operator*(Vec a, S s) noexcept { return {a.x * s, a.y * s, a.z * s}; }
  friend constexpr Vec operator*(S s, Vec a) noexcept { return a * s; }
  friend constexpr bool operator==(Vec, Vec) noexcept = default;
};

struct WorldSpace;   ///< mm in the scene; x right, y up, z to the user
struct DeviceSpace;  ///< mm at the device port: world scaled by 1 / workspace_scale
struct VoxelSpace;   ///< voxel edges of one volume; (0, 0, 0) is the centre of the first voxel
struct JointSpace;   ///< radians, or N mm, of the three actuated joints
struct ToolSpace;    ///< mm in the frame of the tool: centre of the cutting head, shaft along +y

template <class S>
using WorldVec = Vec<S, WorldSpace>;
template <class S>
using DeviceVec = Vec<S, DeviceSpace>;
template <class S>
using VoxelVec = Vec<S, VoxelSpace>;
template <class S>
using JointVec = Vec<S, JointSpace>;

/// Converts the space and keeps the numbers: only for transforms, with the reason beside it.
template <class ToSpace, class S, class Space>
[[nodiscard]] constexpr Vec<S, ToSpace> relabel(Vec<S, Space> v) noexcept {
  return {v.x, v.y, v.z};
}

template <class S, class Space>
[[nodiscard]] constexpr S dot(Vec<S, Space> a, Vec<S, Space> b) noexcept {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class S, class Space>
[[nodiscard]] constexpr Vec<S, Space> cross(Vec<S, Space> a, Vec<S, Space> b) noexcept {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
/// Products of any two numbers fit: each is halved, the sum once more, all towards 0, two bits
/// below the last one that is kept; then it is rounded once.
template <int F, class Space>
[[nodiscard]] constexpr Fixed<F> dot(Vec<Fixed<F>, Space> a, Vec<Fixed<F>, Space> b) noexcept {
  const std::int64_t sum = saturating_add(saturating_add(std::int64_t{a.x.raw()} * b.x.raw() / 2,
                                                         std::int64_t{a.y.raw()} * b.y.raw() / 2),
                                          std::int64_t{a.z.raw()} * b.z.raw() / 2);
  return Fixed<F>::from_wide(sum / 2, 2 * F - 2);
}

/// Euclidean length, saturating.
template <int F, class Space>
[[nodiscard]] constexpr Fixed<F> norm(Vec<Fixed<F>, Space> v) noexcept {
  const auto square = [](Fixed<F> c) {
    const std::int64_t raw = c.raw();
    return static_cast<std::uint64_t>(raw * raw);
  };
  // 3 * 2^62 < 2^64; the root keeps F fraction bits.
  const std::uint32_t root = integer_sqrt(square(v.x) + square(v.y) + square(v.z));
  return Fixed<F>::from_raw(saturate_i32(root));
}
template <std::floating_point S, class Space>
[[nodiscard]] inline S norm(Vec<S, Space> v) noexcept {
  return square_root(dot(v, v));
}

/// Row-major 3x3 matrix that takes a vector of `From` to one of `To`.
template <class S, class To, class From>
struct Transform {
  std::array<std::array<S, 3>, 3> row{};
};

/// Matrix times vector; the vector keeps its number format.
template <class V, class S, class To, class From>
[[nodiscard]] constexpr Vec<V, To> operator*(const Transform<S, To, From>& m,
                                             Vec<V, From> v) noexcept {
  const auto component = [&](int i) {
    const auto& r = m.row[static_cast<std::size_t>(i)];
    return multiply<V>(r[0], v.x) + multiply<V>(r[1], v.y) + multiply<V>(r[2], v.z);
  };
  return {component(0), component(1), component(2)};
}

template <class S, class To, class From>
[[nodiscard]] constexpr Transform<S, From, To> transposed(
    const Transform<S, To, From>& m) noexcept {
  Transform<S, From, To> t;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) t.row[j][i] = m.row[i][j];
  }
  return t;
}

/// Shortens `v` to at most `length` and keeps its direction. A shorter vector is returned
/// unchanged.
template <std::floating_point S, class Space>
[[nodiscard]] inline Vec<S, Space> clamped(Vec<S, Space> v, S length) noexcept {
  const S current = norm(v);
  return current <= length ? v : v * (length / current);
}
/// Fixed: `norm` rounds down and so do the products here, so the result is never longer.
template <int F, class Space>
[[nodiscard]] constexpr Vec<Fixed<F>, Space> clamped(Vec<Fixed<F>, Space> v,
                                                     Fixed<F> length) noexcept {
  const Fixed<F> current = norm(v);
  if (current < length) return v;
  const std::int64_t above = std::int64_t{current.raw()} + 1;
  const auto shortened = [&](Fixed<F> component) {
    return Fixed<F>::from_raw(saturate_i32(std::int64_t{component.raw()} * length.raw() / above));
  };
  return {shortened(v.x), shortened(v.y), shortened(v.z)};
}

/// A number of the loop as a double, for the output.
template <class S>
[[nodiscard]] constexpr double as_double(S value) noexcept {
  return static_cast<double>(value);
}

template <class S, class Space>
[[nodiscard]] constexpr std::array<double, 3> as_doubles(Vec<S, Space> v) noexcept {
  return {as_double(v.x), as_double(v.y), as_double(v.z)};
}

template <class S, class Space>
[[nodiscard]] constexpr Vec<double, Space> to_double(Vec<S, Space> v) noexcept {
  return {as_double(v.x), as_double(v.y), as_double(v.z)};
}

template <class S, class Space>
[[nodiscard]] bool all_finite(Vec<S, Space> v) noexcept {
  return is_finite(v.x) && is_finite(v.y) && is_finite(v.z);
}

/// -F . d: the work that the hand does against F along d, in mJ. Exact in fixed, where Q16 times
/// Q16 has 32 fraction bits; saturates at 2^31 mJ.
template <class N>
[[nodiscard]] constexpr typename N::Energy work_of_hand(
    DeviceVec<typename N::Real> force_n, DeviceVec<typename N::Real> moved_mm) noexcept {
  if constexpr (N::kIsFixed) {
    const auto term = [](Q16 f, Q16 d) { return -(std::int64_t{f.raw()} * d.raw()); };
    return saturating_add(saturating_add(term(force_n.x, moved_mm.x), term(force_n.y, moved_mm.y)),
                          term(force_n.z, moved_mm.z));
  } else {
    return -dot(force_n, moved_mm);
  }
}

/// a + b, saturating in fixed.
template <class N>
[[nodiscard]] constexpr typename N::Energy sum_of_energy(typename N::Energy a,
                                                         typename N::Energy b) noexcept {
  if constexpr (N::kIsFixed) {
    return saturating_add(a, b);
  } else {
    return a + b;
  }
}

/// a - b, saturating in fixed.
template <class N>
[[nodiscard]] constexpr typename N::Energy difference_of_energy(typename N::Energy a,
                                                                typename N::Energy b) noexcept {
  if constexpr (N::kIsFixed) {
    return saturating_add(a, b == INT64_MIN ? INT64_MAX : -b);
  } else {
    return a - b;
  }
}

}  // namespace kerf
