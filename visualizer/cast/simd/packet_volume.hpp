// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "visualizer/cast/simd/packet_rays.hpp"

// For the files that define `Simd` only: how a packet of rays samples a volume and passes over its
// empty cells, and the material and the light of a surface, as in shaders/iso.frag, which gives the
// reason for each length. Positions are in voxel edges from the border (`CastVolumeJob`).

namespace kerf {
namespace {

/// A cell of 2^3 voxels: the entry of its lowest one, and the position within it.
struct CellSample {
  I at;
  Vec3 fraction;
};

/// Beyond the border everything is as on it: air. `Rows` is a volume or its gradient.
template <class Rows>
Vec3 within(const Rows& rows, Vec3 p) {
  return {Simd::min(positive(p.x), Simd::set(rows.last[0])),
          Simd::min(positive(p.y), Simd::set(rows.last[1])),
          Simd::min(positive(p.z), Simd::set(rows.last[2]))};
}

template <class Rows>
CellSample cell_place(const Rows& rows, Vec3 p) {
  const Vec3 q = within(rows, p);
  const I x = Simd::to_int(q.x);
  const I y = Simd::to_int(q.y);
  const I z = Simd::to_int(q.z);
  return {x + y * rows.row + z * rows.plane,
          {q.x - Simd::to_float(x), q.y - Simd::to_float(y), q.z - Simd::to_float(z)}};
}

inline F mix(F a, F b, F fraction) {
  return a + fraction * (b - a);
}
inline Vec3 mix(Vec3 a, Vec3 b, F fraction) {
  return a + fraction * (b - a);
}

/// Trilinear, 0..1. Two loads of 64 bits bring all eight corners: `PairedRows`.
inline F density_in(const CastVolumeJob& volume, const CellSample& cell) {
  const auto plane = [&](const std::uint32_t* entries) {
    I left{};
    I right{};
    Simd::gather_two<4>(entries, cell.at, left, right);
    const F low =
        mix(Simd::to_float(left & 0xffff), Simd::to_float(right & 0xffff), cell.fraction.x);
    const F high = mix(Simd::to_float(Simd::high_half(left)),
                       Simd::to_float(Simd::high_half(right)), cell.fraction.x);
    return mix(low, high, cell.fraction.y);
  };
  return mix(plane(volume.density), plane(volume.density + volume.plane), cell.fraction.z) *
         Simd::set(1.0F / 65535.0F);
}

inline F density_at(const CastVolumeJob& volume, Vec3 p) {
  return density_in(volume, cell_place(volume, p));
}

/// Per voxel edge, of a gradient as it is stored.
inline Vec3 per_edge(const CastGradient& field, Vec3 gradient) {
  return {Simd::set(field.per_edge[0]) * gradient.x, Simd::set(field.per_edge[1]) * gradient.y,
          Simd::set(field.per_edge[2]) * gradient.z};
}

/// The density gradient as it is stored, trilinear. One load of 64 bits brings all of a voxel's.
inline Vec3 gradient_at(const CastGradient& field, Vec3 p) {
  const CellSample cell = cell_place(field, p);
  const auto row_at = [&](std::int32_t step) {
    const std::uint16_t* const entries = field.entries + std::int64_t{4} * step;
    I left_xy{}, left_z{}, right_xy{}, right_z{};
    Simd::gather_two<8>(entries, cell.at, left_xy, left_z);
    Simd::gather_two<8>(entries + 4, cell.at, right_xy, right_z);
    const auto between = [&](I left, I right) {
      return mix(Simd::to_float(left), Simd::to_float(right), cell.fraction.x);
    };
    return Vec3{between(left_xy & 0xffff, right_xy & 0xffff),
                between(Simd::high_half(left_xy), Simd::high_half(right_xy)),
                between(left_z, right_z)};
  };
  const auto plane_at = [&](std::int32_t step) {
    return mix(row_at(step), row_at(step + field.row), cell.fraction.y);
  };
  const Vec3 mean = mix(plane_at(0), plane_at(field.plane), cell.fraction.z);
  const F none = Simd::set(32768.0F);
  return Simd::set(0.5F / 32767.0F) * (mean - Vec3{none, none, none});
}

/// The part of each ray between the near, the far and the clip plane (ray.frag).
struct Shown {
  F begin_mm, end_mm;
};

inline Shown shown_of(const CastEye& from, Vec3 eye) {
  const F zero = Simd::set(0.0F);
  const F away = Simd::set(from.clip_plane[3]);
  const F slope = Simd::set(from.clip_plane[0]) * eye.x + Simd::set(from.clip_plane[1]) * eye.y +
                  Simd::set(from.clip_plane[2]) * eye.z;
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
  F begin_mm, end_mm;  ///< in the volume's box; none if begin is beyond end
  F mm_per_edge;
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

/// Clips the rays to the volume along all axes.
inline void clip_to(const float (&size)[3], VolumeRays& rays) {
  clip_to(size[0], rays.origin.x, rays.direction.x, rays.inverse.x, rays.begin_mm, rays.end_mm);
  clip_to(size[1], rays.origin.y, rays.direction.y, rays.inverse.y, rays.begin_mm, rays.end_mm);
  clip_to(size[2], rays.origin.z, rays.direction.z, rays.inverse.z, rays.begin_mm, rays.end_mm);
}

inline VolumeRays rays_through(const CastVolumeJob& volume, const CastBlock& block,
                               const Shown& shown, Vec3 eye) {
  VolumeRays rays;
  rays.origin = vec3(volume.origin);
  rays.direction = transformed(volume.from_eye, eye);
  rays.mm_per_edge = Simd::set(1.0F) / Simd::sqrt(dot(rays.direction, rays.direction));
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

/// To read the cells costs as much as a sample and serves only those lanes that do not know what
/// is around them; a sample in an empty cell is wasted and never wrong. So a few lanes go on
/// unknowing.
inline bool cells_are_worth_reading(M unknowing, M alive) {
  constexpr int kOneIn = 4;
  return Simd::any(unknowing) && kOneIn * Simd::count(unknowing) >= Simd::count(alive);
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

constexpr float kSmall = 1e-6F;  // counts as none, and is no zero to divide by

/// Linear colour and extinction (`CastVolumeJob`).
struct Material {
  Vec3 rgb;
  F extinction;
};

inline Material mix(Material a, Material b, F fraction) {
  return {mix(a.rgb, b.rgb, fraction), mix(a.extinction, b.extinction, fraction)};
}
inline Material select(M m, Material yes, Material no) {
  return {select(m, yes.rgb, no.rgb), Simd::select(m, yes.extinction, no.extinction)};
}

/// An entry of 256 x 4.
inline Material entry_of(const float* table, I index) {
  F entry[4];
  Simd::gather_four(table, index << 2, entry);
  return {{entry[0], entry[1], entry[2]}, entry[3]};
}

/// As a texture of 256 entries that is filtered and clamped to its edges.
inline Material by_density(const CastVolumeJob& volume, F density) {
  const F at =
      Simd::min(positive(density * Simd::set(256.0F) - Simd::set(0.5F)), Simd::set(254.9999F));
  const I index = Simd::to_int(at);
  return mix(entry_of(volume.by_density, index), entry_of(volume.by_density, index + 1),
             at - Simd::to_float(index));
}

/// The nearest entry: half the loads, for means over many samples.
inline Material nearest_by_density(const CastVolumeJob& volume, F density) {
  return entry_of(volume.by_density, Simd::to_int(density * Simd::set(255.0F) + Simd::set(0.5F)));
}

/// The mean of the labelled voxels around, and the fraction of these voxels.
struct Labelled {
  Material mean;
  F fraction;
};

/// Labels around, blended so that their borders are smooth. Where all eight agree, which is nearly
/// everywhere, that is one look-up; `needed` are the lanes whose result counts.
inline Labelled by_labels(const CastVolumeJob& volume, Vec3 p, M needed) {
  const CellSample cell = cell_place(volume, p);
  const F zero = Simd::set(0.0F);
  const F one = Simd::set(1.0F);
  const I labels[2] = {Simd::gather_bytes<2>(volume.labels, cell.at),
                       Simd::gather_bytes<2>(volume.labels + volume.plane, cell.at)};
  const I first = labels[0] & 0xff;
  const M alike =
      Simd::both(Simd::equal(labels[0], labels[1]), Simd::equal(labels[0], first * 0x01010101));
  const Labelled same{entry_of(volume.by_label, first),
                      Simd::select(Simd::equal(first, I{}), zero, one)};
  if (!Simd::any(Simd::but_not(needed, alike))) return same;

  Material sum{};
  F fraction{};
  for (int corner = 0; corner < 8; ++corner) {
    // Bytes of a gathered entry: (x, y), (x, y + 1), (x + 1, y), (x + 1, y + 1).
    const int x = corner & 1;
    const int y = corner >> 1 & 1;
    const int z = corner >> 2;
    const I label = labels[z] >> (16 * x + 8 * y) & 0xff;
    const F wx = x != 0 ? cell.fraction.x : one - cell.fraction.x;
    const F wy = y != 0 ? cell.fraction.y : one - cell.fraction.y;
    const F wz = z != 0 ? cell.fraction.z : one - cell.fraction.z;
    const F w = Simd::select(Simd::equal(label, I{}), zero, wx * wy * wz);
    const Material material = entry_of(volume.by_label, label);
    sum = {sum.rgb + w * material.rgb, sum.extinction + w * material.extinction};
    fraction = fraction + w;
  }
  const F per_fraction = one / Simd::max(fraction, Simd::set(kSmall));
  return {select(alike, same.mean, {per_fraction * sum.rgb, per_fraction * sum.extinction}),
          Simd::select(alike, same.fraction, fraction)};
}

/// Which way an iso-surface faces.
struct Facing {
  Vec3 inward;     ///< one voxel edge long
  Vec3 normal;     ///< eye space, towards the eye
  F edges_per_mm;  ///< of `inward`
  F voxel_mm;      ///< extent of a voxel along the normal
};

/// `square_edges` in mm^2, by axis.
inline Facing facing_of(const float (&voxel_from_eye)[3][3], const float (&square_edges)[3],
                        Vec3 gradient, Vec3 to_eye) {
  // A gradient in voxel edges goes to the eye's millimetres by the transposed Jacobian.
  const Vec3 slope = transformed_back(voxel_from_eye, gradient);
  const F zero = Simd::set(0.0F);
  Vec3 normal = select(Simd::less(zero, dot(slope, slope)), -normalized(slope), to_eye);
  const F facing = dot(normal, to_eye);
  const Vec3 turned = normalized(normal - (Simd::set(1.02F) * facing) * to_eye);
  normal = select(Simd::less(facing, zero), turned, normal);
  const Vec3 per_mm = transformed(voxel_from_eye, -normal);
  const F edges_per_mm = Simd::sqrt(dot(per_mm, per_mm));
  const Vec3 edges{Simd::set(square_edges[0]) * per_mm.x, Simd::set(square_edges[1]) * per_mm.y,
                   Simd::set(square_edges[2]) * per_mm.z};
  return {(Simd::set(1.0F) / edges_per_mm) * per_mm, normal, edges_per_mm,
          Simd::sqrt(dot(edges, edges))};
}

/// A sample of ambient occlusion: how many voxel edges outwards, and its weight.
struct OcclusionTap {
  F vox, weight;
};

/// `kOcclusionTapsMm` has the reasons.
inline OcclusionTap occlusion_tap(const Facing& facing, int i) {
  const F length_mm = Simd::set(kOcclusionTapsMm[i]);
  const F clear_mm = Simd::set(kClearVox) * facing.voxel_mm;
  const F most_vox = Simd::set(kMostTapVox);
  const F weight = Simd::set(kOcclusionWeights[i]);
  if (i + 1 == kOcclusionTaps) {
    return {Simd::min(Simd::max(length_mm, clear_mm) * facing.edges_per_mm, most_vox), weight};
  }
  const F clear = clamped(Simd::set(3.0F) * length_mm / clear_mm - Simd::set(2.0F));
  return {Simd::min(length_mm * facing.edges_per_mm, most_vox), weight * clear};
}

/// A point of an iso-surface.
struct SurfacePoint {
  Vec3 position;  ///< voxel edges
  Facing facing;
};

inline SurfacePoint surface_point(const CastVolumeJob& volume, const VolumeRays& rays, F t,
                                  Vec3 to_eye) {
  const Vec3 p = rays.origin + t * rays.direction;
  return {p, facing_of(volume.from_eye, volume.square_edges,
                       per_edge(volume.gradient, gradient_at(volume.gradient, p)), to_eye)};
}

/// The mean of the labels over 3.5 voxels: in a clip plane their borders are steps of voxels.
inline Labelled by_labels_around(const CastVolumeJob& volume, Vec3 p, M needed) {
  constexpr float kReachVox = 0.75F;
  Material sum{};
  F fraction{};
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 side{Simd::set((corner & 1) != 0 ? kReachVox : -kReachVox),
                    Simd::set((corner & 2) != 0 ? kReachVox : -kReachVox),
                    Simd::set((corner & 4) != 0 ? kReachVox : -kReachVox)};
    const Labelled one = by_labels(volume, p + side, needed);
    sum = {sum.rgb + one.fraction * one.mean.rgb, sum.extinction};
    fraction = fraction + one.fraction;
  }
  const F per_fraction = Simd::set(1.0F) / Simd::max(fraction, Simd::set(kSmall));
  return {{per_fraction * sum.rgb, sum.extinction}, Simd::set(0.125F) * fraction};
}

/// Below the surface, because the surface itself is half air; soft tissue on it coats it. A face in
/// the clip plane has no inward direction: it shows what lies there.
inline Vec3 material_at(const CastVolumeJob& volume, const SurfacePoint& at, M needed) {
  const F depth_vox = Simd::set(1.25F);
  const F full_depth_vox = Simd::set(2.5F);
  const F coat_density = Simd::set(0.14F);
  const Vec3 inward = at.facing.inward;
  const Vec3 below = at.position + depth_vox * inward;
  Vec3 colour{};
  M plain = needed;
  if (volume.labels != nullptr) {
    Labelled labelled = by_labels(volume, below, needed);
    const Vec3 above = at.position - depth_vox * inward;
    const M on_face = Simd::both(needed, Simd::equal(dot(inward, inward), Simd::set(0.0F)));
    if (Simd::any(on_face)) {
      const Labelled around = by_labels_around(volume, at.position, on_face);
      labelled = {select(on_face, around.mean, labelled.mean),
                  Simd::select(on_face, around.fraction, labelled.fraction)};
    }
    const M coated = Simd::both(Simd::but_not(needed, on_face),
                                Simd::less(coat_density, density_at(volume, above)));
    if (Simd::any(coated)) {
      const Labelled coat = by_labels(volume, above, coated);
      const F cover = Simd::select(coated, coat.fraction, Simd::set(0.0F));
      const F fraction = labelled.fraction * (Simd::set(1.0F) - cover) + cover * cover;
      labelled = {
          mix(labelled.mean, coat.mean, cover * cover / Simd::max(fraction, Simd::set(kSmall))),
          fraction};
    }
    colour = labelled.mean.rgb;
    plain = Simd::but_not(needed, Simd::less(Simd::set(0.0F), labelled.fraction));
    if (!Simd::any(plain)) return colour;
  }
  const F density = Simd::max(density_at(volume, below),
                              density_at(volume, at.position + full_depth_vox * inward));
  return select(plain, by_density(volume, density).rgb, colour);
}

/// 1 in the open, less where the neighbourhood along the normal is solid: cavities read as such.
inline F ao_factor_at(const CastVolumeJob& volume, const SurfacePoint& at) {
  const F per_iso = Simd::set(1.0F / volume.iso);
  F solid{};
  for (int i = 0; i < kOcclusionTaps; ++i) {
    const OcclusionTap tap = occlusion_tap(at.facing, i);
    const F density = density_at(volume, at.position - tap.vox * at.facing.inward);
    solid = solid + tap.weight * clamped(density * per_iso);
  }
  return Simd::set(1.0F) - solid;
}

}  // namespace
}  // namespace kerf
