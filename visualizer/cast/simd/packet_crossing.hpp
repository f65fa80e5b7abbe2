// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "visualizer/cast/simd/packet_volume.hpp"

// For the files that define `Simd` only: where rays first meet an iso-surface, as in
// shaders/iso.frag.
//
// Within a cell of eight voxels the density along a ray is a cubic, whose first root is the
// surface: no part is too thin to be met (iso.frag names the paper). Each cell is looked into for
// itself, so skipping others changes the time, never the picture.

namespace kerf {
namespace {

/// Density less iso along a part of a ray, of s from 0 to 1: a + s (b + s (c + s d)).
struct Cubic {
  F a, b, c, d;
};

inline F value_at(const Cubic& g, F s) {
  return g.a + s * (g.b + s * (g.c + s * g.d));
}

/// Of a face of a cell of eight voxels: the density at its corner, 0..65535, what it gains along x
/// and along y, and along both.
struct CellFace {
  F corner, x, y, both;
};

inline CellFace face_at(const std::uint32_t* density, I at) {
  I left{}, right{};
  Simd::gather_two<4>(density, at, left, right);  // `PairedRows`
  const F corner = Simd::to_float(left & 0xffff);
  const F x = Simd::to_float(right & 0xffff) - corner;
  const F y = Simd::to_float(Simd::high_half(left)) - corner;
  const F both = Simd::to_float(Simd::high_half(right)) - corner;
  return {corner, x, y, both - x - y};
}

/// The cubic in the cell with entry `at`, from `p` in it on over `step`.
inline Cubic cubic_along(const CastVolumeJob& volume, I at, Vec3 p, Vec3 step) {
  CellFace face = face_at(volume.density, at);
  const CellFace far = face_at(volume.density + volume.plane, at);
  const CellFace gain{far.corner - face.corner, far.x - face.x, far.y - face.y,
                      far.both - face.both};  // along z
  face = {face.corner + p.z * gain.corner, face.x + p.z * gain.x, face.y + p.z * gain.y,
          face.both + p.z * gain.both};
  // Half a step of the density less: what is iso itself is solid, whatever is rounded.
  const F above = face.corner - Simd::set(volume.iso * 65535.0F - 0.5F);
  const F along_y = face.y + face.both * p.x;
  const Vec3 slope{face.x + face.both * p.y, along_y,
                   gain.corner + gain.x * p.x + p.y * (gain.y + gain.both * p.x)};
  const F twist_x = gain.x + gain.both * p.y;  // of the slopes along x and y, along z
  const F twist_y = gain.y + gain.both * p.x;
  return {above + face.x * p.x + p.y * along_y, dot(slope, step),
          step.x * step.y * face.both + step.z * (step.x * twist_x + step.y * twist_y),
          step.x * step.y * step.z * gain.both};
}

struct Root {
  M found;
  F s;
};

/// The first s that is not below iso. The cubic may touch iso before it falls again: its one
/// maximum splits it into parts with one root at most.
inline Root first_root(const Cubic& g, M needed) {
  constexpr int kRefinements = 4;
  const F zero = Simd::set(0.0F);
  const F half = Simd::set(0.5F);
  const F one = Simd::set(1.0F);
  const F turn = g.c * g.c - Simd::set(3.0F) * (g.b * g.d);
  const F top = g.b / (Simd::sqrt(positive(turn)) - g.c);  // where the slope falls through 0
  const M inner = Simd::but_not(Simd::both(Simd::less(zero, top), Simd::less(top, one)),
                                Simd::less(turn, zero));
  const F at_top = value_at(g, top);
  const F at_end = value_at(g, one);
  const M falls = Simd::both(inner, Simd::less(at_top, zero));
  const M rises = Simd::but_not(inner, falls);
  const M begins = Simd::but_not(needed, Simd::less(g.a, zero));
  F low = Simd::select(falls, top, zero);
  F high = Simd::select(rises, top, one);
  F below = Simd::select(falls, at_top, g.a);
  F above = Simd::select(rises, at_top, at_end);
  const M found = Simd::either(begins, Simd::but_not(needed, Simd::less(above, zero)));
  F s = high;
  if (!Simd::any(Simd::but_not(found, begins))) return {found, zero};
  // Regula falsi (Illinois).
  for (int i = 0; i < kRefinements; ++i) {
    s = mix(low, high, below / (below - above));
    const F value = value_at(g, s);
    const M outside = Simd::less(value, zero);
    low = Simd::select(outside, s, low);
    high = Simd::select(outside, high, s);
    const F other_below = half * below;
    const F other_above = half * above;
    below = Simd::select(outside, value, other_below);
    above = Simd::select(outside, other_above, value);
  }
  return {found, Simd::select(begins, zero, s)};
}

/// The cell of eight voxels in which a ray goes on, or a larger one in which no sample reaches iso.
struct CellAround {
  I entry;  ///< `PairedRows`, of the small one
  M solid;  ///< a sample in it may reach iso
  Vec3 low;
  F from_mm, to_mm;  ///< of the ray
};

inline CellAround cell_around(const CastVolumeJob& volume, const VolumeRays& rays, F t) {
  const Vec3 q = within(volume, rays.origin + t * rays.direction);
  const I x = Simd::to_int(q.x);
  const I y = Simd::to_int(q.y);
  const I z = Simd::to_int(q.z);
  static_assert(kCastCellVox == 2);  // its octants are the cells of eight voxels
  const I larger_x = x >> 1, larger_y = y >> 1, larger_z = z >> 1;
  const I octants = Simd::gather_bytes<1>(volume.active, larger_x + larger_y * volume.cell_row +
                                                             larger_z * volume.cell_plane) &
                    0xff;
  // The bits of the half on each side: 0x55 or 0xaa, 0x33 or 0xcc, 0x0f or 0xf0.
  const I own = ((x & 1) * 0x55 + 0x55) & ((y & 1) * 0x99 + 0x33) & ((z & 1) * 0xe1 + 0x0f);
  const M empty = Simd::equal(octants, I{});
  const F edge = Simd::select(empty, Simd::set(2.0F), Simd::set(1.0F));
  const auto low = [&](I cell, I larger) {
    return Simd::to_float(Simd::select(empty, larger << 1, cell));
  };
  CellAround around{x + y * volume.row + z * volume.plane,
                    Simd::but_not(Simd::all(), Simd::equal(octants & own, I{})),
                    {low(x, larger_x), low(y, larger_y), low(z, larger_z)},
                    {},
                    {}};
  const auto between = [&](F from, F origin, F inverse) {
    const F a = (from - origin) * inverse;
    const F b = (from + edge - origin) * inverse;
    return Shown{Simd::min(a, b), Simd::max(a, b)};
  };
  const Shown along_x = between(around.low.x, rays.origin.x, rays.inverse.x);
  const Shown along_y = between(around.low.y, rays.origin.y, rays.inverse.y);
  const Shown along_z = between(around.low.z, rays.origin.z, rays.inverse.z);
  around.from_mm = Simd::max(Simd::max(along_x.begin_mm, along_y.begin_mm), along_z.begin_mm);
  around.to_mm = Simd::min(Simd::min(along_x.end_mm, along_y.end_mm), along_z.end_mm);
  return around;
}

struct Hit {
  M found;
  F t;  ///< mm along the view axis
};

/// Where `alive` rays first are in what is solid, from where they begin to be shown.
inline Hit first_crossing(const CastVolumeJob& volume, const VolumeRays& rays, F shown_from_mm,
                          M alive) {
  // A point so far ahead is in the cell that begins there however its coordinates, of up to some
  // thousand, are rounded; and t grows whatever it is.
  const F ahead_mm =
      Simd::max(Simd::set(1.0F / 2048) * rays.mm_per_edge, Simd::set(1.0F / 1048576) * rays.end_mm);
  F t = rays.begin_mm;
  Hit hit{Simd::none(), t};
  alive = Simd::both(alive, Simd::less(t, rays.end_mm));
  while (Simd::any(alive)) {
    const CellAround around = cell_around(volume, rays, t + ahead_mm);
    const M solid = Simd::both(alive, around.solid);
    if (Simd::any(solid)) {
      // A cell that begins just ahead of where the ray is shown from holds that point, too: what is
      // solid there is a face. Twice, since both are rounded.
      const F from_mm =
          Simd::select(Simd::less(around.from_mm, shown_from_mm + (ahead_mm + ahead_mm)),
                       shown_from_mm, around.from_mm);
      const F span_mm = Simd::min(around.to_mm, rays.end_mm) - from_mm;
      const Vec3 p = rays.origin + from_mm * rays.direction - around.low;
      const Root root =
          first_root(cubic_along(volume, around.entry, p, span_mm * rays.direction), solid);
      hit.found = Simd::either(hit.found, root.found);
      hit.t = Simd::select(root.found, from_mm + root.s * span_mm, hit.t);
      alive = Simd::but_not(alive, root.found);
    }
    t = Simd::max(around.to_mm, t + ahead_mm);
    alive = Simd::both(alive, Simd::less(t, rays.end_mm));
  }
  return hit;
}

}  // namespace
}  // namespace kerf
