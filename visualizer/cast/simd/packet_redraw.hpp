// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "visualizer/cast/cast_kernels.hpp"
#include "visualizer/cast/simd/packet_rays.hpp"
#include "visualizer/cast/simd/packet_volume.hpp"

// For the files that define `Simd` only: tests packets of rays against the changed cells of a
// volume.
//
// The colour of a ray can change in three ways: the ray crosses a cell marked `kChangedAlong`, it
// ends in a cell marked `kChangedAtEnd`, or it ends on a surface whose shading samples a changed
// cell. A ray of which none is true keeps its colour, bit by bit.

namespace kerf {
namespace {

inline F absolute(F a) {
  return Simd::max(a, -a);
}

/// The points whose cell has `mark`. A point outside the grid counts as its nearest cell.
inline M marked(const RedrawJob& job, Vec3 p, std::uint8_t mark) {
  const auto cell = [](F at, float last) {
    return Simd::to_int(Simd::min(positive(at), Simd::set(last)));
  };
  const I at = cell(p.x, job.last[0]) + cell(p.y, job.last[1]) * job.row +
               cell(p.z, job.last[2]) * job.plane;
  return Simd::but_not(Simd::all(), Simd::equal(Simd::gather_bytes<1>(job.cells, at) & mark, I{}));
}

/// The distance of `p` from the grid on each axis; 0 inside.
inline Vec3 outside_by(const RedrawJob& job, Vec3 p) {
  const auto beside = [](F at, float size) {
    return positive(Simd::max(-at, at - Simd::set(size)));
  };
  return {beside(p.x, job.size[0]), beside(p.y, job.size[1]), beside(p.z, job.size[2])};
}

/// Whether one of the lanes `points` lies in a cell with `mark`.
inline bool any_marked(const RedrawJob& job, Vec3 p, M points, std::uint8_t mark) {
  const Vec3 off = outside_by(job, p);
  const M within = Simd::but_not(points, Simd::less(Simd::set(0.0F), dot(off, off)));
  return Simd::any(within) && Simd::any(Simd::both(within, marked(job, p, mark)));
}

inline F longest_part(Vec3 a) {
  return Simd::max(Simd::max(absolute(a.x), absolute(a.y)), absolute(a.z));
}

/// Whether a ray of the lanes `alive` crosses a cell marked `kChangedAlong`.
inline bool crosses_changed_cell(const RedrawJob& job, const VolumeRays& rays, M alive) {
  const F step_mm = Simd::set(job.step_vox) / longest_part(rays.direction);
  // Half a step more: no point on a ray is farther than that from a test.
  const F end_mm = rays.end_mm + Simd::set(0.5F) * step_mm;
  alive = Simd::both(alive, Simd::less(rays.begin_mm, rays.end_mm));
  for (std::int32_t test = 0; test < job.most_tests && Simd::any(alive); ++test) {
    const F t = rays.begin_mm + Simd::set(static_cast<float>(test)) * step_mm;
    const Vec3 p = rays.origin + t * rays.direction;
    if (Simd::any(Simd::both(alive, marked(job, p, kChangedAlong)))) return true;
    alive = Simd::both(alive, Simd::less(t + step_mm, end_mm));
  }
  return Simd::any(alive);  // so far away that its steps are lost in rounding
}

/// Where the rays of a packet end, by the depth of the last picture.
struct Ends {
  M there;  ///< the rays that hit something
  F t;      ///< mm along the view axis; far away for the others
};

inline Ends ends_of(const RedrawJob& job, const Packet& packet) {
  const std::int32_t row = job.window.x1 - job.window.x0;
  const std::int64_t first =
      std::int64_t{packet.y - job.window.y0} * row + packet.x - job.window.x0;
  const F depth = taken(packet, job.depth + first, row);
  return {Simd::both(drawn_lanes(packet), Simd::less(depth, Simd::set(1.0F))),
          Simd::set(job.eye.depth_slope) / (Simd::set(job.eye.depth_far) - depth)};
}

/// Whether a ray of the packet crosses a changed cell or ends in one.
inline bool packet_rays_touch(const RedrawJob& job, const Packet& packet) {
  const Vec3 eye = eye_directions(job.eye, packet);
  const Shown shown = shown_of(job.eye, eye);
  VolumeRays rays;
  rays.origin = vec3(job.origin);
  rays.direction = transformed(job.from_eye, eye);
  rays.begin_mm = shown.begin_mm;
  rays.end_mm = shown.end_mm;
  Ends ends{Simd::none(), shown.end_mm};
  if (job.depth != nullptr) {
    ends = ends_of(job, packet);
    // A hit lies before the sample that found it: the ray took samples up to a step behind.
    rays.end_mm = Simd::min(shown.end_mm, ends.t + Simd::set(1.0F) / longest_part(rays.direction));
  }
  clip_to(job.size, rays);
  if (crosses_changed_cell(job, rays, drawn_lanes(packet))) return true;
  return any_marked(job, rays.origin + ends.t * rays.direction, ends.there, kChangedAtEnd);
}

/// Whether the shading of a point at which a ray ends samples a changed cell.
inline bool packet_shading_touches(const RedrawJob& job, const Packet& packet) {
  const Vec3 eye = eye_directions(job.eye, packet);
  const Ends ends = ends_of(job, packet);
  const Vec3 p = vec3(job.origin) + ends.t * transformed(job.from_eye, eye);
  const Vec3 off = outside_by(job, p);
  const Vec3 part{off.x * Simd::set(1.0F / job.tap_reach[0]),
                  off.y * Simd::set(1.0F / job.tap_reach[1]),
                  off.z * Simd::set(1.0F / job.tap_reach[2])};
  M near = Simd::both(ends.there, Simd::less(dot(part, part), Simd::set(1.0F)));
  near = Simd::both(near, Simd::less(dot(off, off), Simd::set(kMostTapVox * kMostTapVox)));
  if (!Simd::any(near)) return false;
  // Normals are turned towards the eye, so samples lie before the point, or a little behind it.
  // Both sides of the comparison have one factor, that of the ray.
  const F length_2 = dot(eye, eye);
  F nearest = dot(vec3(job.centre_mm), eye);
  for (const auto& half : job.half_mm) nearest = nearest - absolute(dot(vec3(half), eye));
  const F behind = Simd::set(-kMaterialTapsVox[0] * job.edge_mm) * Simd::sqrt(length_2);
  near = Simd::but_not(near, Simd::less(ends.t * length_2 + behind, nearest));
  if (!Simd::any(near)) return false;

  // A face in the clip plane has the plane's normal.
  const F shown_from_mm = shown_of(job.eye, eye).begin_mm;
  const M on_face = Simd::both(Simd::less(Simd::set(job.eye.near_mm), shown_from_mm),
                               Simd::less(ends.t, Simd::set(1.0001F) * shown_from_mm));
  const Vec3 gradient = gradient_at(job.gradient, p - vec3(job.border));
  const F least_slope = Simd::set(job.least_slope);
  M known = Simd::but_not(near, on_face);
  known = Simd::but_not(known, Simd::less(dot(gradient, gradient), least_slope * least_slope));
  if (Simd::any(Simd::but_not(near, known))) return true;
  const Facing facing =
      facing_of(job.from_eye, job.square_edges, per_edge(job.gradient, gradient), -normalized(eye));
  const auto changed_at = [&](F vox) {
    return any_marked(job, p - vox * facing.inward, known, kChangedAlong);
  };
  for (const float vox : kMaterialTapsVox) {
    if (changed_at(Simd::set(vox))) return true;
  }
  for (int i = 0; i < kOcclusionTaps; ++i) {
    if (changed_at(occlusion_tap(facing, i).vox)) return true;
  }
  return false;
}

bool cast_rays_touch(const RedrawJob& job, const PixelRect& rect) {
  bool touch = false;
  for_packets(job.eye, rect,
              [&](const Packet& packet) { touch = touch || packet_rays_touch(job, packet); });
  return touch;
}

bool cast_shading_touches(const RedrawJob& job, const PixelRect& rect) {
  bool touch = false;
  for_packets(job.eye, rect,
              [&](const Packet& packet) { touch = touch || packet_shading_touches(job, packet); });
  return touch;
}

}  // namespace
}  // namespace kerf
