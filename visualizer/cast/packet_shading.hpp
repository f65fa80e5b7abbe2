// SPDX-License-Identifier: Apache-2.0
// For the files that define `Simd` only: the material and the light of a surface, as in
// shaders/iso.frag, which says why each length is what it is.
#pragma once

#include "visualizer/cast/packet_volume.hpp"

namespace kerf {
namespace {

constexpr float kSmall = 1e-6F;  // a share that is nothing, and no zero to divide by

/// Linear colour and extinction (`CastVolumeJob`).
struct Matter {
  Vec3 rgb;
  F extinction;
};

inline Matter mix(Matter a, Matter b, F share) {
  return {mix(a.rgb, b.rgb, share), mix(a.extinction, b.extinction, share)};
}
inline Matter select(M m, Matter yes, Matter no) {
  return {select(m, yes.rgb, no.rgb), Simd::select(m, yes.extinction, no.extinction)};
}

/// An entry of 256 x 4.
inline Matter entry_of(const float* table, I index) {
  F entry[4];
  Simd::gather_four(table, index << 2, entry);
  return {{entry[0], entry[1], entry[2]}, entry[3]};
}

/// As a texture of 256 entries that is filtered and clamped to its edges.
inline Matter by_density(const CastVolumeJob& volume, F density) {
  const F at =
      Simd::min(positive(density * Simd::set(256.0F) - Simd::set(0.5F)), Simd::set(254.9999F));
  const I index = Simd::to_int(at);
  return mix(entry_of(volume.by_density, index), entry_of(volume.by_density, index + 1),
             at - Simd::to_float(index));
}

/// The nearest entry: half the loads, for means over many samples.
inline Matter nearest_by_density(const CastVolumeJob& volume, F density) {
  return entry_of(volume.by_density, Simd::to_int(density * Simd::set(255.0F) + Simd::set(0.5F)));
}

/// The mean of the labelled voxels around, and their share.
struct Labelled {
  Matter mean;
  F share;
};

/// Labels around, blended so that their borders are smooth. Where all eight agree, which is nearly
/// everywhere, that is one look-up; `needed` are the lanes whose result counts.
inline Labelled by_labels(const CastVolumeJob& volume, Vec3 p, M needed) {
  const CellPlace cell = cell_place(volume, p);
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

  Matter sum{};
  F share{};
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
    const Matter matter = entry_of(volume.by_label, label);
    sum = {sum.rgb + w * matter.rgb, sum.extinction + w * matter.extinction};
    share = share + w;
  }
  const F per_share = one / Simd::max(share, Simd::set(kSmall));
  return {select(alike, same.mean, {per_share * sum.rgb, per_share * sum.extinction}),
          Simd::select(alike, same.share, share)};
}

/// Which way an iso-surface faces.
struct Facing {
  Vec3 inward;  ///< one voxel edge long
  Vec3 normal;  ///< eye space, towards the eye
};

inline Facing facing_of(const float (&voxel_from_eye)[3][3], Vec3 gradient, Vec3 to_eye) {
  // A gradient in voxel edges goes to the eye's millimetres by the transposed Jacobian.
  const Vec3 slope = transformed_back(voxel_from_eye, gradient);
  const F zero = Simd::set(0.0F);
  Vec3 normal = select(Simd::less(zero, dot(slope, slope)), -normalized(slope), to_eye);
  const F facing = dot(normal, to_eye);
  const Vec3 turned = normalized(normal - (Simd::set(1.02F) * facing) * to_eye);
  normal = select(Simd::less(facing, zero), turned, normal);
  return {normalized(transformed(voxel_from_eye, -normal)), normal};
}

/// A point of an iso-surface.
struct SurfacePoint {
  Vec3 place;  ///< voxel edges
  Vec3 inward, normal;
};

inline SurfacePoint surface_point(const CastVolumeJob& volume, const VolumeRays& rays, F t,
                                  Vec3 to_eye) {
  const Vec3 p = rays.origin + t * rays.direction;
  const Facing facing = facing_of(volume.from_eye, gradient_at(volume, p), to_eye);
  return {p, facing.inward, facing.normal};
}

/// Below the surface, because the surface itself is half air; soft tissue on it coats it.
inline Vec3 material_at(const CastVolumeJob& volume, const SurfacePoint& at, M needed) {
  const F depth_vox = Simd::set(1.25F);
  const F full_depth_vox = Simd::set(2.5F);
  const F coat_density = Simd::set(0.14F);
  const Vec3 below = at.place + depth_vox * at.inward;
  Vec3 colour{};
  M plain = needed;
  if (volume.labels != nullptr) {
    Labelled labelled = by_labels(volume, below, needed);
    const Vec3 above = at.place - depth_vox * at.inward;
    const M coated = Simd::both(needed, Simd::less(coat_density, density_at(volume, above)));
    if (Simd::any(coated)) {
      const Labelled coat = by_labels(volume, above, coated);
      const F cover = Simd::select(coated, coat.share, Simd::set(0.0F));
      const F share = labelled.share * (Simd::set(1.0F) - cover) + cover * cover;
      labelled = {
          mix(labelled.mean, coat.mean, cover * cover / Simd::max(share, Simd::set(kSmall))),
          share};
    }
    colour = labelled.mean.rgb;
    plain = Simd::but_not(needed, Simd::less(Simd::set(0.0F), labelled.share));
    if (!Simd::any(plain)) return colour;
  }
  const F density = Simd::max(density_at(volume, below),
                              density_at(volume, at.place + full_depth_vox * at.inward));
  return select(plain, by_density(volume, density).rgb, colour);
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
