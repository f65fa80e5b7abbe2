// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "visualizer/cast/simd/packet_crossing.hpp"
#include "visualizer/cast/simd/packet_rays.hpp"
#include "visualizer/cast/simd/packet_volume.hpp"

// For the files that define `Simd` only: iso-surfaces by ray casting, as in shaders/iso.frag.

namespace kerf {
namespace {

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
    rays[v] = rays_through(volume, volume.blocks[packet.block], part, eye);
    rays[v].end_mm = Simd::min(rays[v].end_mm, nearest_mm);
    const Hit hit = first_crossing(volume, rays[v], part.begin_mm, drawn);
    if (!Simd::any(hit.found)) continue;
    found[v] = Simd::both(hit.found, Simd::less(hit.t, nearest_mm));
    begins[v] = Simd::but_not(found[v], Simd::less(part.begin_mm, hit.t));
    nearest_mm = Simd::select(found[v], hit.t, nearest_mm);
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
      Facing& facing = at.facing;
      facing.normal = select(on_face, vec3(job.key_light), facing.normal);  // section_normal
      facing.inward = select(on_face, Vec3{}, facing.inward);  // no border: what lies in the plane
      ao_factor = Simd::select(on_face, Simd::set(1.0F), ao_factor);
    }
    const Vec3 albedo = material_at(volume, at, found[v]);
    const Vec3 shown = lit(job, albedo, at.facing.normal, vectors, ao_factor);
    colour = select(found[v], shown, colour);
    normal = select(found[v], at.facing.normal, normal);
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
