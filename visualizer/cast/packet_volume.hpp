// SPDX-License-Identifier: Apache-2.0
// For the files that define `Simd` only: how a packet of rays samples a volume and passes over its
// empty cells. Places are in voxel edges from the border (`CastVolumeJob`).
#pragma once

#include "visualizer/cast/packet_math.hpp"

namespace kerf {
namespace {

/// A cell of 2^3 voxels: the entry of its lowest one, and the place within it.
struct CellPlace {
  I at;
  Vec3 share;
};

/// Beyond the border everything is as on it: air.
inline Vec3 within(const CastVolumeJob& volume, Vec3 p) {
  return {Simd::min(positive(p.x), Simd::set(volume.last[0])),
          Simd::min(positive(p.y), Simd::set(volume.last[1])),
          Simd::min(positive(p.z), Simd::set(volume.last[2]))};
}

inline CellPlace cell_place(const CastVolumeJob& volume, Vec3 p, std::int32_t plane) {
  const Vec3 q = within(volume, p);
  const I x = Simd::to_int(q.x);
  const I y = Simd::to_int(q.y);
  const I z = Simd::to_int(q.z);
  return {x + y * volume.row + z * plane,
          {q.x - Simd::to_float(x), q.y - Simd::to_float(y), q.z - Simd::to_float(z)}};
}

inline CellPlace cell_place(const CastVolumeJob& volume, Vec3 p) {
  return cell_place(volume, p, volume.plane);
}

inline F mix(F a, F b, F share) {
  return a + share * (b - a);
}
inline Vec3 mix(Vec3 a, Vec3 b, F share) {
  return a + share * (b - a);
}

/// Trilinear, 0..1. Two loads of 64 bits bring all eight corners: `PairedRows`.
inline F density_in(const CastVolumeJob& volume, const CellPlace& cell) {
  const auto plane = [&](const std::uint32_t* entries) {
    I left{};
    I right{};
    Simd::gather_two<4>(entries, cell.at, left, right);
    const F low = mix(Simd::to_float(left & 0xffff), Simd::to_float(right & 0xffff), cell.share.x);
    const F high = mix(Simd::to_float(Simd::high_half(left)),
                       Simd::to_float(Simd::high_half(right)), cell.share.x);
    return mix(low, high, cell.share.y);
  };
  return mix(plane(volume.density), plane(volume.density + volume.plane), cell.share.z) *
         Simd::set(1.0F / 65535.0F);
}

inline F density_at(const CastVolumeJob& volume, Vec3 p) {
  return density_in(volume, cell_place(volume, p));
}

/// The density gradient per voxel edge, from the eight corners of a cube around p: differences
/// along one axis, means along the others (iso.frag). All corners have the same place within their
/// cells.
inline Vec3 gradient_at(const CastVolumeJob& volume, Vec3 p) {
  const F one = Simd::set(1.0F);
  const auto inner = [&](F x, float last) {  // the whole cube is inside the border
    return Simd::max(Simd::min(x, Simd::set(last - 1.0F)), one);
  };
  const CellPlace middle = cell_place(
      volume, {inner(p.x, volume.last[0]), inner(p.y, volume.last[1]), inner(p.z, volume.last[2])});
  Vec3 sum{};
  for (int corner = 0; corner < 8; ++corner) {
    const int x = (corner & 1) != 0 ? 1 : -1;
    const int y = (corner & 2) != 0 ? 1 : -1;
    const int z = (corner & 4) != 0 ? 1 : -1;
    const F density =
        density_in(volume, {middle.at + (x + y * volume.row + z * volume.plane), middle.share});
    sum.x = x > 0 ? sum.x + density : sum.x - density;
    sum.y = y > 0 ? sum.y + density : sum.y - density;
    sum.z = z > 0 ? sum.z + density : sum.z - density;
  }
  return Simd::set(0.125F) * sum;
}

/// The same from stored gradients, in 8 bits: a quarter of the loads.
inline Vec3 stored_gradient_at(const CastVolumeJob& volume, Vec3 p) {
  const CellPlace cell = cell_place(volume, p, volume.gradient_plane);
  I corner[4][2];  // by y and z, by x
  for (int i = 0; i < 4; ++i) {
    const std::int32_t step = (i & 1) * volume.row + (i >> 1) * volume.gradient_plane;
    Simd::gather_two<4>(volume.gradient + step, cell.at, corner[i][0], corner[i][1]);
  }
  const auto component = [&](int shift) {  // of bytes where they lie, times 2^shift
    const std::int32_t byte = 0xff << shift;
    F row[4];
    for (int i = 0; i < 4; ++i) {
      row[i] = mix(Simd::to_float(corner[i][0] & byte), Simd::to_float(corner[i][1] & byte),
                   cell.share.x);
    }
    const F mean =
        mix(mix(row[0], row[1], cell.share.y), mix(row[2], row[3], cell.share.y), cell.share.z);
    const auto unit = static_cast<float>(1 << shift);
    return (mean - Simd::set(128.0F * unit)) * Simd::set(0.5F / 127.0F / unit);
  };
  return {component(0), component(8), component(16)};
}

/// The part of each ray between the near, the far and the clip plane (ray.frag).
struct Shown {
  F begin_mm, end_mm;
};

inline Shown shown_of(const CastEye& from, Vec3 eye) {
  const F zero = Simd::set(0.0F);
  const F away = Simd::set(from.shown[3]);
  const F slope = Simd::set(from.shown[0]) * eye.x + Simd::set(from.shown[1]) * eye.y +
                  Simd::set(from.shown[2]) * eye.z;
  const F cut = -away / slope;
  const F near_mm = Simd::set(from.near_mm);
  const F far_mm = Simd::set(from.far_mm);
  const M hidden = Simd::both(
      Simd::less(away, zero),
      Simd::but_not(Simd::all(), Simd::either(Simd::less(slope, zero), Simd::less(zero, slope))));
  const F end_mm = Simd::select(Simd::less(slope, zero), Simd::min(far_mm, cut), far_mm);
  return {Simd::select(Simd::less(zero, slope), Simd::max(near_mm, cut), near_mm),
          Simd::select(hidden, zero, end_mm)};
}

/// The rays of one packet through one volume, by their distance t along the view axis.
struct VolumeRays {
  Vec3 origin, direction;
  Vec3 inverse;        ///< of the direction
  F begin_mm, end_mm;  ///< in the volume's box; none where begin is beyond end
  F step_mm, steps_per_mm;
};

inline bool is_met(const CastBlock& block) {
  return block.begin_mm < block.end_mm;
}

/// Ends rays where they leave 0..size along one axis.
inline void clip_to(float size, F origin, F& direction, F& inverse, F& begin_mm, F& end_mm) {
  // A ray along a face never meets the next one, but its inverse stays a number.
  const F least = Simd::set(1e-12F);
  direction = Simd::select(Simd::less(direction * direction, least * least), least, direction);
  inverse = Simd::set(1.0F) / direction;
  const F a = -origin * inverse;
  const F b = (Simd::set(size) - origin) * inverse;
  begin_mm = Simd::max(begin_mm, Simd::min(a, b));
  end_mm = Simd::min(end_mm, Simd::max(a, b));
}

/// The same along all axes.
inline void clip_to(const float (&size)[3], VolumeRays& rays) {
  clip_to(size[0], rays.origin.x, rays.direction.x, rays.inverse.x, rays.begin_mm, rays.end_mm);
  clip_to(size[1], rays.origin.y, rays.direction.y, rays.inverse.y, rays.begin_mm, rays.end_mm);
  clip_to(size[2], rays.origin.z, rays.direction.z, rays.inverse.z, rays.begin_mm, rays.end_mm);
}

inline VolumeRays rays_through(const CastJob& job, const CastVolumeJob& volume,
                               const CastBlock& block, const Shown& shown, Vec3 eye) {
  VolumeRays rays;
  rays.origin = vec3(volume.origin);
  rays.direction = transformed(volume.from_eye, eye);
  const F edges_per_mm = Simd::sqrt(dot(rays.direction, rays.direction));
  rays.step_mm = Simd::set(job.step_vox) / edges_per_mm;
  rays.steps_per_mm = edges_per_mm / Simd::set(job.step_vox);
  rays.begin_mm = Simd::max(Simd::set(block.begin_mm), shown.begin_mm);
  rays.end_mm = Simd::min(Simd::set(block.end_mm), shown.end_mm);
  clip_to(volume.last, rays);
  rays.begin_mm = Simd::min(rays.begin_mm, rays.end_mm);
  return rays;
}

/// What is around a sample: whether it can show anything, and up to where that holds.
struct Surroundings {
  M visible;
  F exit_mm;
};

/// A look at the cells costs as much as a sample and serves only those lanes that do not know what
/// is around them; a sample in an empty cell is wasted and never wrong. So a few lanes go on
/// unknowing.
inline bool worth_a_look(M unknowing, M alive) {
  constexpr int kShare = 4;
  return Simd::any(unknowing) && kShare * Simd::count(unknowing) >= Simd::count(alive);
}

inline Surroundings surroundings_at(const CastVolumeJob& volume, const VolumeRays& rays, F t) {
  const Vec3 q = within(volume, rays.origin + t * rays.direction);
  const F cells = Simd::set(1.0F / kCastCellVox);
  const I x = Simd::to_int(q.x * cells);
  const I y = Simd::to_int(q.y * cells);
  const I z = Simd::to_int(q.z * cells);
  const I active =
      Simd::gather_bytes<1>(volume.active, x + y * volume.cell_row + z * volume.cell_plane) & 0xff;
  const auto exit = [](I cell, F origin, F inverse) {
    const F low = Simd::set(static_cast<float>(kCastCellVox)) * Simd::to_float(cell);
    const F high = low + Simd::set(static_cast<float>(kCastCellVox));
    return Simd::max((low - origin) * inverse, (high - origin) * inverse);
  };
  return {Simd::but_not(Simd::all(), Simd::equal(active, I{})),
          Simd::min(Simd::min(exit(x, rays.origin.x, rays.inverse.x),
                              exit(y, rays.origin.y, rays.inverse.y)),
                    exit(z, rays.origin.z, rays.inverse.z))};
}

}  // namespace
}  // namespace kerf
