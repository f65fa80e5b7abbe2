// SPDX-License-Identifier: Apache-2.0
// For the files that define `Simd` only: volumes as translucent matter, front to back.
//
// All volumes share one lattice of samples along the ray, at the step of the finest, so that they
// intersect as matter does. A sample of opacity a per voxel edge has 1 - (1 - a)^s over s edges.
#pragma once

#include "visualizer/cast/packet_pixels.hpp"
#include "visualizer/cast/packet_shading.hpp"

namespace kerf {
namespace {

constexpr float kOpaque = 0.98F;          // what lies behind would be a twentieth of a step of sRGB
constexpr float kNoticeable = 1.0F / 64;  // samples below have no light of their own
constexpr float kNonEmpty = 1.0F / 16;    // opacity gathered where depth is set
constexpr float kNever = 1e9F;            // steps

/// A ray's way through one volume.
struct Walk {
  VolumeRays rays;
  F edges_per_step;
  F exit_k;   ///< from this step on the surroundings are not known
  M visible;  ///< until then
};

/// Looks around where a lane of `alive` leaves what it knows. Returns the lanes that see something.
inline M look_around(const CastVolumeJob& volume, Walk& walk, M alive, F k, F step_mm) {
  const M leaving = Simd::but_not(alive, Simd::less(k, walk.exit_k));
  if (Simd::any(leaving)) {
    const F one = Simd::set(1.0F);
    const F t = k * step_mm;
    const M inside = Simd::less(t, walk.rays.end_mm);
    const Surroundings around = surroundings_at(volume, walk.rays, t);
    const F exit_mm = Simd::min(around.exit_mm, walk.rays.end_mm);
    const F next = Simd::max(k + one, whole(exit_mm / step_mm) + one);
    walk.exit_k = Simd::select(leaving, Simd::select(inside, next, Simd::set(kNever)), walk.exit_k);
    const M sees = Simd::both(Simd::both(leaving, inside), around.visible);
    walk.visible = Simd::either(Simd::but_not(walk.visible, leaving), sees);
  }
  return walk.visible;
}

/// What is gathered along the rays.
struct Gathered {
  Vec3 rgb{};  ///< linear, times opacity
  F clear = Simd::set(1.0F);
  F depth_mm;
  M has_depth = Simd::none();
};

inline Vec3 light_of(const CastJob& job, const CastVolumeJob& volume, const VolumeRays& rays, F t,
                     Vec3 albedo, Vec3 to_eye) {
  const SurfacePoint at = surface_point(volume, rays, t, to_eye);
  return lit(job, albedo, at.normal, to_eye, Simd::set(1.0F));
}

inline void add_sample(const CastJob& job, const CastVolumeJob& volume, const Walk& walk, M alive,
                       F t, Vec3 to_eye, Gathered& sum) {
  const F zero = Simd::set(0.0F);
  const F one = Simd::set(1.0F);
  const M on = Simd::both(alive, walk.visible);
  if (!Simd::any(on)) return;
  const Vec3 p = walk.rays.origin + t * walk.rays.direction;
  const Colour matter = by_density(job, density_at(volume, p));
  const F opacity = Simd::select(on, one - exp2_of(matter.a * walk.edges_per_step), zero);
  const M noticeable = Simd::less(Simd::set(kNoticeable), opacity);
  const M faint = Simd::less(zero, opacity);
  if (!Simd::any(faint)) return;
  Vec3 albedo = matter.rgb;
  if (volume.labels != nullptr) {
    const Colour labelled = by_labels(job, volume, p, faint);
    albedo = select(Simd::less(zero, labelled.a), (one / labelled.a) * labelled.rgb, albedo);
  }
  Vec3 shown = Simd::set(0.75F) * albedo;
  if (Simd::any(noticeable)) {
    shown = select(noticeable, light_of(job, volume, walk.rays, t, albedo, to_eye), shown);
  }
  sum.rgb = sum.rgb + (sum.clear * opacity) * shown;
  sum.clear = sum.clear * (one - opacity);
  const M set = Simd::both(Simd::but_not(on, sum.has_depth),
                           Simd::less(sum.clear, Simd::set(1.0F - kNonEmpty)));
  sum.depth_mm = Simd::select(set, t, sum.depth_mm);
  sum.has_depth = Simd::either(sum.has_depth, set);
}

inline void put(const CastJob& job, const Packet& packet, const Gathered& sum) {
  const F zero = Simd::set(0.0F);
  const F one = Simd::set(1.0F);
  const F gathered = one - sum.clear;
  const M any = Simd::less(zero, gathered);
  const Vec3 rgb = (one / gathered) * sum.rgb;
  const F opacity = Simd::select(Simd::less(gathered, Simd::set(kOpaque)), gathered, one);
  const F depth = Simd::set(job.depth_far) - Simd::set(job.depth_slope) / sum.depth_mm;
  put(packet, Simd::select(any, srgb_bytes(rgb, opacity), I{}), job.pixels.rgba);
  put(packet, Simd::select(sum.has_depth, depth, one), job.pixels.depth);
}

inline void blend_packet(const CastJob& job, const Packet& packet) {
  const F one = Simd::set(1.0F);
  const Vec3 eye = eye_directions(job, packet);
  const Vec3 to_eye = -normalized(eye);
  F end_mm = Simd::set(job.far_mm);
  if (job.pixels.end_depth != nullptr) {
    const F end_depth = taken(packet, job.pixels.end_depth);
    end_mm = Simd::min(Simd::set(job.depth_slope) / (Simd::set(job.depth_far) - end_depth), end_mm);
  }
  Walk walks[kMaxCastVolumes];
  F step_mm = end_mm;
  for (int v = 0; v < job.volume_count; ++v) {
    walks[v].rays = rays_through(job, job.volumes[v], job.volumes[v].blocks[packet.block], eye);
    step_mm = Simd::min(step_mm, walks[v].rays.step_mm);
  }
  F k = Simd::set(kNever);
  for (int v = 0; v < job.volume_count; ++v) {
    Walk& walk = walks[v];
    walk.edges_per_step = step_mm * walk.rays.steps_per_mm * Simd::set(job.step_vox);
    const M meets = Simd::less(walk.rays.begin_mm, walk.rays.end_mm);
    walk.exit_k = Simd::select(meets, whole(walk.rays.begin_mm / step_mm) + one, Simd::set(kNever));
    walk.visible = Simd::none();
    k = Simd::min(k, walk.exit_k);
  }
  Gathered sum;
  sum.depth_mm = end_mm;
  M alive = Simd::both(drawn_lanes(packet), Simd::less(k * step_mm, end_mm));
  while (Simd::any(alive)) {
    M seeing = Simd::none();
    F soonest = Simd::set(kNever);
    for (int v = 0; v < job.volume_count; ++v) {
      seeing = Simd::either(seeing, look_around(job.volumes[v], walks[v], alive, k, step_mm));
      soonest = Simd::min(soonest, walks[v].exit_k);
    }
    const M skipping = Simd::but_not(alive, seeing);
    if (Simd::any(skipping)) {
      k = Simd::select(skipping, soonest, k);
    } else {
      const F t = k * step_mm;
      for (int v = 0; v < job.volume_count; ++v) {
        add_sample(job, job.volumes[v], walks[v], alive, t, to_eye, sum);
      }
      k = k + one;
      alive = Simd::both(alive, Simd::less(Simd::set(1.0F - kOpaque), sum.clear));
    }
    alive = Simd::both(alive, Simd::less(k * step_mm, end_mm));
  }
  put(job, packet, sum);
}

void cast_blend(const CastJob& job, const PixelRect& rect) {
  for_packets(job, rect, [&](const Packet& packet) { blend_packet(job, packet); });
}

}  // namespace
}  // namespace kerf
