// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "visualizer/cast/simd/packet_rays.hpp"
#include "visualizer/cast/simd/packet_volume.hpp"

// For the files that define `Simd` only: iso-surfaces by ray casting, as in shaders/iso.frag.
//
// Samples stand at whole multiples of the step whatever was skipped before: skipping changes the
// time, never the picture.

namespace kerf {
namespace {

struct Hit {
  M found;
  F t;        ///< mm along the view axis
  F density;  ///< at t, not below iso
  M begins;   ///< the ray begins in what is solid
};

/// The first sample of `alive` rays that is not below iso: where the rays begin to be shown, or at
/// a multiple of the step.
inline Hit first_sample(const CastVolumeJob& volume, const VolumeRays& rays, F shown_from_mm,
                        M alive) {
  const F one = Simd::set(1.0F);
  const F iso = Simd::set(volume.iso);
  F k = whole(rays.begin_mm * rays.steps_per_mm);
  Hit hit{Simd::none(), rays.begin_mm, k, Simd::none()};
  alive = Simd::both(alive, Simd::less(rays.begin_mm, rays.end_mm));
  const M cut = Simd::but_not(alive, Simd::less(shown_from_mm, rays.begin_mm));
  if (Simd::any(cut)) {
    // What the clip plane takes away must not be hit; where it cuts through solid, there is a face.
    k = Simd::select(cut, k + one, k);
    hit.density = density_at(volume, rays.origin + rays.begin_mm * rays.direction);
    hit.begins = Simd::but_not(cut, Simd::less(hit.density, iso));
    hit.found = hit.begins;
    alive = Simd::but_not(alive, hit.found);
  }
  F exit_k = k;  // of the cell around; not known yet
  alive = Simd::both(alive, Simd::less(k * rays.step_mm, rays.end_mm));
  while (Simd::any(alive)) {
    const M leaving = Simd::but_not(alive, Simd::less(k, exit_k));
    if (cells_are_worth_reading(leaving, alive)) {
      const Surroundings around = surroundings_at(volume, rays, k * rays.step_mm);
      const F next = Simd::max(
          k + one, whole(Simd::min(around.exit_mm, rays.end_mm) * rays.steps_per_mm) + one);
      exit_k = Simd::select(leaving, next, exit_k);
      k = Simd::select(Simd::but_not(leaving, around.visible), next, k);
      alive = Simd::both(alive, Simd::less(k * rays.step_mm, rays.end_mm));
      continue;
    }
    // Several samples at once: while one waits for memory, the others compute.
    F density[Simd::kAhead];
    for (int i = 0; i < Simd::kAhead; ++i) {
      const F t = (k + Simd::set(static_cast<float>(i))) * rays.step_mm;
      density[i] = density_at(volume, rays.origin + t * rays.direction);
    }
    for (const F& here : density) {
      const F t = k * rays.step_mm;
      const M found = Simd::but_not(alive, Simd::less(here, iso));
      hit.found = Simd::either(hit.found, found);
      hit.t = Simd::select(found, t, hit.t);
      hit.density = Simd::select(found, here, hit.density);
      k = k + one;
      alive = Simd::both(Simd::but_not(alive, found), Simd::less(k * rays.step_mm, rays.end_mm));
    }
  }
  return hit;
}

/// Regula falsi (Illinois) between a sample below iso and the first one that is not.
inline F refined_mm(const CastVolumeJob& volume, const VolumeRays& rays, F shown_from_mm,
                    const Hit& hit) {
  constexpr int kRefinements = 3;
  const F zero = Simd::set(0.0F);
  const F half = Simd::set(0.5F);
  const F iso = Simd::set(volume.iso);
  F below_mm = Simd::max(hit.t - rays.step_mm, shown_from_mm);
  F above_mm = hit.t;
  F below = density_at(volume, rays.origin + below_mm * rays.direction) - iso;
  F above = hit.density - iso;
  F t = above_mm;
  for (int i = 0; i < kRefinements; ++i) {
    t = mix(below_mm, above_mm, below / (below - above));
    const F value = density_at(volume, rays.origin + t * rays.direction) - iso;
    const M outside = Simd::less(value, zero);
    below_mm = Simd::select(outside, t, below_mm);
    above_mm = Simd::select(outside, above_mm, t);
    const F other_below = half * below;
    const F other_above = half * above;
    below = Simd::select(outside, value, other_below);
    above = Simd::select(outside, other_above, value);
  }
  return Simd::select(hit.begins, hit.t, t);
}

inline void iso_packet(const CastJob& job, const Packet& packet) {
  const Vec3 eye = eye_directions(job.eye, packet);
  const M drawn = drawn_lanes(packet);
  F nearest_mm = Simd::set(job.eye.far_mm);
  M any_found = Simd::none();
  const Shown part = shown_of(job.eye, eye);
  VolumeRays rays[kMaxCastVolumes];
  M found[kMaxCastVolumes];
  M begins[kMaxCastVolumes];
  for (int v = 0; v < job.volume_count; ++v) {
    const CastVolumeJob& volume = job.volumes[v];
    found[v] = Simd::none();
    if (!is_met(volume.blocks[packet.block])) continue;
    rays[v] = rays_through(job, volume, volume.blocks[packet.block], part, eye);
    rays[v].end_mm = Simd::min(rays[v].end_mm, nearest_mm + rays[v].step_mm);
    const Hit hit = first_sample(volume, rays[v], part.begin_mm, drawn);
    if (!Simd::any(hit.found)) continue;
    const F t = refined_mm(volume, rays[v], part.begin_mm, hit);
    found[v] = Simd::both(hit.found, Simd::less(t, nearest_mm));
    begins[v] = hit.begins;
    nearest_mm = Simd::select(found[v], t, nearest_mm);
    any_found = Simd::either(any_found, found[v]);
    for (int hidden = 0; hidden < v; ++hidden) {
      found[hidden] = Simd::but_not(found[hidden], found[v]);
    }
  }
  if (!Simd::any(any_found)) {
    put(packet, I{}, job.pixels.rgba);
    put(packet, Simd::set(1.0F), job.pixels.depth);
    return;
  }
  const ViewVectors vectors = view_vectors_along(job, eye);
  Vec3 colour{};
  Vec3 normal{};
  for (int v = 0; v < job.volume_count; ++v) {
    if (!Simd::any(found[v])) continue;
    const CastVolumeJob& volume = job.volumes[v];
    SurfacePoint at = surface_point(volume, rays[v], nearest_mm, vectors.to_eye);
    F ao_factor = ao_factor_at(volume, at);
    const M on_face = Simd::both(begins[v], Simd::less(Simd::set(job.eye.near_mm), part.begin_mm));
    if (Simd::any(on_face)) {
      at.normal = select(on_face, vec3(job.key_light), at.normal);  // section_normal
      at.inward = select(on_face, Vec3{}, at.inward);  // no border: it shows what lies in the plane
      ao_factor = Simd::select(on_face, Simd::set(1.0F), ao_factor);
    }
    const Vec3 albedo = material_at(volume, at, found[v]);
    const Vec3 shown = lit(job, albedo, at.normal, vectors, ao_factor);
    colour = select(found[v], shown, colour);
    normal = select(found[v], at.normal, normal);
  }
  const F depth = Simd::set(job.eye.depth_far) - Simd::set(job.eye.depth_slope) / nearest_mm;
  put(packet, Simd::select(any_found, srgb_bytes(colour, Simd::set(1.0F)), I{}), job.pixels.rgba);
  put(packet, Simd::select(any_found, depth, Simd::set(1.0F)), job.pixels.depth);
  if (job.pixels.normal != nullptr) {
    put(packet, normal.x, job.pixels.normal, 3, 0);
    put(packet, normal.y, job.pixels.normal, 3, 1);
    put(packet, normal.z, job.pixels.normal, 3, 2);
  }
}

void cast_iso(const CastJob& job, const PixelRect& rect) {
  for_packets(job.eye, rect, [&](const Packet& packet) { iso_packet(job, packet); });
}

}  // namespace
}  // namespace kerf
