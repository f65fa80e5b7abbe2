// SPDX-License-Identifier: Apache-2.0
// For the files that define `Simd` only: the material and the light of a surface, as in
// shaders/iso.frag, which says why each length is what it is.
#pragma once

#include "visualizer/cast/packet_volume.hpp"

namespace kerf {
namespace {

/// Linear colour and a fourth value: share of labelled voxels, or extinction.
struct Colour {
  Vec3 rgb;
  F a;
};

/// An entry of 256 x 4.
inline Colour entry_of(const float* table, I index) {
  const I at = index << 2;
  return {{Simd::gather(table, at), Simd::gather(table + 1, at), Simd::gather(table + 2, at)},
          Simd::gather(table + 3, at)};
}

/// As a texture of 256 entries that is filtered and clamped to its edges.
inline Colour by_density(const CastJob& job, F density) {
  const F at =
      Simd::min(positive(density * Simd::set(256.0F) - Simd::set(0.5F)), Simd::set(254.9999F));
  const I index = Simd::to_int(at);
  const F share = at - Simd::to_float(index);
  const Colour low = entry_of(job.colour_by_density, index);
  const Colour high = entry_of(job.colour_by_density, index + 1);
  return {mix(low.rgb, high.rgb, share), mix(low.a, high.a, share)};
}

/// Colour of the labels around, blended so that their borders are smooth, times the share of voxels
/// that have one. Where all eight labels agree, which is nearly everywhere, that is one look-up;
/// `needed` are the lanes whose result counts.
inline Colour by_labels(const CastJob& job, const CastVolumeJob& volume, Vec3 p, M needed) {
  const CellPlace cell = cell_place(volume, p);
  const F zero = Simd::set(0.0F);
  const F one = Simd::set(1.0F);
  const I labels[2] = {Simd::gather_bytes<2>(volume.labels, cell.at),
                       Simd::gather_bytes<2>(volume.labels + volume.plane, cell.at)};
  const I first = labels[0] & 0xff;
  const M alike =
      Simd::both(Simd::equal(labels[0], labels[1]), Simd::equal(labels[0], first * 0x01010101));
  const M unlabelled = Simd::equal(first, I{});
  const F a = Simd::select(unlabelled, zero, one);
  const Colour same{a * entry_of(job.colour_by_label, first).rgb, a};
  if (!Simd::any(Simd::but_not(needed, alike))) return same;

  Colour sum{};
  for (int corner = 0; corner < 8; ++corner) {
    // Bytes of a gathered entry: (x, y), (x, y + 1), (x + 1, y), (x + 1, y + 1).
    const int x = corner & 1;
    const int y = corner >> 1 & 1;
    const int z = corner >> 2;
    const I label = labels[z] >> (16 * x + 8 * y) & 0xff;
    const F wx = x != 0 ? cell.share.x : one - cell.share.x;
    const F wy = y != 0 ? cell.share.y : one - cell.share.y;
    const F wz = z != 0 ? cell.share.z : one - cell.share.z;
    const F w = Simd::select(Simd::equal(label, I{}), zero, wx * wy * wz);
    sum.rgb = sum.rgb + w * entry_of(job.colour_by_label, label).rgb;
    sum.a = sum.a + w;
  }
  return {select(alike, same.rgb, sum.rgb), Simd::select(alike, same.a, sum.a)};
}

/// A point of an iso-surface.
struct SurfacePoint {
  Vec3 place;   ///< voxel edges
  Vec3 inward;  ///< one voxel edge long
  Vec3 normal;  ///< eye space, towards the eye
};

inline SurfacePoint surface_point(const CastVolumeJob& volume, const VolumeRays& rays, F t,
                                  Vec3 to_eye) {
  const Vec3 p = rays.origin + t * rays.direction;
  // A gradient in voxel edges goes to the eye's millimetres by the transposed Jacobian.
  const Vec3 slope = transformed_back(volume.from_eye, gradient_at(volume, p));
  const F zero = Simd::set(0.0F);
  Vec3 normal = select(Simd::less(zero, dot(slope, slope)), -normalized(slope), to_eye);
  const F facing = dot(normal, to_eye);
  const Vec3 turned = normalized(normal - (Simd::set(1.02F) * facing) * to_eye);
  normal = select(Simd::less(facing, zero), turned, normal);
  return {p, normalized(transformed(volume.from_eye, -normal)), normal};
}

/// Below the surface, because the surface itself is half air; soft tissue on it coats it.
inline Vec3 material_at(const CastJob& job, const CastVolumeJob& volume, const SurfacePoint& at,
                        M needed) {
  const F depth_vox = Simd::set(1.25F);
  const F full_depth_vox = Simd::set(2.5F);
  const F coat_density = Simd::set(0.14F);
  const Vec3 below = at.place + depth_vox * at.inward;
  Colour labelled{};
  M plain = needed;
  if (volume.labels != nullptr) {
    labelled = by_labels(job, volume, below, needed);
    const Vec3 above = at.place - depth_vox * at.inward;
    const M coated = Simd::both(needed, Simd::less(coat_density, density_at(volume, above)));
    if (Simd::any(coated)) {
      const Colour coat = by_labels(job, volume, above, coated);
      const F share = Simd::select(coated, coat.a, Simd::set(0.0F));
      labelled = {mix(labelled.rgb, coat.rgb, share), mix(labelled.a, coat.a, share)};
    }
    const M has_label = Simd::less(Simd::set(0.0F), labelled.a);
    labelled.rgb = (Simd::set(1.0F) / labelled.a) * labelled.rgb;
    plain = Simd::but_not(needed, has_label);
    if (!Simd::any(plain)) return labelled.rgb;
  }
  const F density = Simd::max(density_at(volume, below),
                              density_at(volume, at.place + full_depth_vox * at.inward));
  return select(plain, by_density(job, density).rgb, labelled.rgb);
}

/// 1 in the open, less where the neighbourhood along the normal is solid: cavities read as such.
inline F openness_at(const CastVolumeJob& volume, const SurfacePoint& at) {
  const F per_iso = Simd::set(1.0F / volume.iso);
  const auto solid = [&](float reach_vox) {
    return clamped(density_at(volume, at.place - Simd::set(reach_vox) * at.inward) * per_iso);
  };
  return Simd::set(1.0F) - (Simd::set(0.30F) * solid(2.5F) + Simd::set(0.30F) * solid(6.0F) +
                            Simd::set(0.25F) * solid(12.0F));
}

}  // namespace
}  // namespace kerf
