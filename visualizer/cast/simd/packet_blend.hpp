// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "visualizer/cast/simd/packet_rays.hpp"
#include "visualizer/cast/simd/packet_volume.hpp"

// For the files that define `Simd` only: translucent volumes, front to back, as in
// shaders/blend.frag.
//
// One ray goes through all volumes together, so they mix where they intersect. It is cut into
// pieces at whole multiples of the step along the view axis, whatever was skipped: skipping changes
// the time, never the picture. Over a length s a sample of opacity a has 1 - (1 - a)^(p s / s0): p
// says how much of the material is there, s0 is `kOpacityMm`.

namespace kerf {
namespace {

constexpr float kInside = 0.62F;               // inside, light comes from everywhere
constexpr float kOpaque = 0.98F;               // what lies behind adds two hundredths at most
constexpr float kNoticeable = 1.0F / 32;       // pieces below have no light of their own
constexpr float kLeastExtinction = 0.045347F;  // per mm, of `kLeastOpacity`: less is not seen
constexpr float kLit = 0.2692F;                // mm: `kLitMm`
constexpr float kLeastFacing = 0.2F;  // a ray that grazes leaves the border before it is in deeper
constexpr float kNever = 1e9F;        // steps

/// p on the mean over a piece; 0 in lanes that are not on. The density runs straight between its
/// ends, so the ramp is integrated exactly: sampled, a border thinner than the step would leave
/// rings (pre-integration: Engel, Kraus and Ertl 2001).
inline F presence_between(const CastVolumeJob& volume, F front, F back, M on) {
  const F one = Simd::set(1.0F);
  const F empty = Simd::set(volume.empty);
  const F full = Simd::set(volume.full);
  const M whole = Simd::but_not(on, Simd::less(Simd::min(front, back), full));
  const F plain = Simd::select(whole, one, Simd::set(0.0F));
  const M on_ramp = Simd::both(Simd::but_not(on, whole), Simd::less(empty, Simd::max(front, back)));
  if (!Simd::any(on_ramp)) return plain;
  const F per_ramp = Simd::set(1.0F / (volume.full - volume.empty));
  const F half = Simd::set(0.5F);
  const F x = (front - empty) * per_ramp;
  const F y = (back - empty) * per_ramp;
  const F ramp_x = clamped(x);
  const F ramp_y = clamped(y);
  const F integral =
      half * (ramp_y * ramp_y - ramp_x * ramp_x) + (positive(y - one) - positive(x - one));
  const F change = y - x;
  const M steep = Simd::less(Simd::set(1e-4F), change * change);
  return Simd::select(on_ramp, Simd::select(steep, integral / change, half * (ramp_x + ramp_y)),
                      plain);
}

/// The weight of the light on a surface; `appearance.hpp` has the reason (`kLitMm`).
inline F lit_part(const CastVolumeJob& volume, F extinction, F facing) {
  const F one = Simd::set(1.0F);
  const F per_mm = Simd::max(extinction, Simd::set(kLeastExtinction)) /
                   Simd::max(facing, Simd::set(kLeastFacing));
  const auto seen_of = [&](float mm) {
    return one - exp2_of(-Simd::min(per_mm * Simd::set(mm), Simd::set(100.0F)));
  };
  return seen_of(kLit) / seen_of(volume.surface_mm);
}

/// The material in the middle of a piece, lit.
inline Material lit_material(const CastJob& job, const CastVolumeJob& volume, Vec3 p, F density,
                             const ViewVectors& vectors, M there, M noticeable) {
  const F zero = Simd::set(0.0F);
  const F full = Simd::set(volume.full);
  M plain = there;
  Material material{};
  if (volume.labels != nullptr) {
    const Labelled labelled = by_labels(volume, p, there);
    material = labelled.mean;
    plain = Simd::but_not(there, Simd::less(zero, labelled.fraction));
  }
  const M fading = Simd::both(plain, Simd::less(density, full));
  Vec3 gradient{};
  if (Simd::any(Simd::either(noticeable, fading))) gradient = gradient_at(volume.gradient, p);
  const F size_2 = dot(gradient, gradient);
  const M sloped = Simd::less(zero, size_2);
  const F size = Simd::sqrt(size_2);
  const F flat = Simd::set(0.02F);
  if (Simd::any(plain)) {
    const M steep = Simd::both(noticeable, Simd::less(flat, size));
    // What is settled has the material of whatever is denser.
    const M open = Simd::both(plain, Simd::less(density, Simd::set(volume.settled)));
    const M at_border = Simd::both(open, Simd::either(fading, steep));
    F deep = density;
    if (Simd::any(at_border)) {
      // A border has the material of what it belongs to, a voxel and a half up the gradient.
      const F reach = Simd::select(sloped, Simd::set(1.5F) / size, zero);
      const F inside = Simd::max(density, density_at(volume, p + reach * gradient));
      deep = Simd::select(at_border, inside, density);
    }
    material = select(plain, nearest_by_density(volume, deep), material);
  }
  const Vec3 dim = Simd::set(kInside) * material.rgb;
  // Where the density hardly changes there is no surface to be lit.
  const F x = clamped((size - flat) * Simd::set(1.0F / 0.08F));
  const M lights = Simd::both(noticeable, Simd::less(zero, x));
  if (!Simd::any(lights)) return {dim, material.extinction};
  const Vec3 unit =
      -normalized(transformed_back(volume.from_eye, per_edge(volume.gradient, gradient)));
  const Vec3 normal = select(Simd::less(dot(unit, vectors.to_eye), zero), -unit, unit);
  const F surface = x * x * (Simd::set(3.0F) - Simd::set(2.0F) * x) *
                    lit_part(volume, material.extinction, dot(normal, vectors.to_eye));
  const Vec3 bright = mix(dim, lit(job, material.rgb, normal, vectors, Simd::set(1.0F)), surface);
  return {select(lights, bright, dim), material.extinction};
}

/// The rays' way through one volume.
struct Walk {
  VolumeRays rays;
  F exit_k;   ///< from this piece on the surroundings are not known
  M visible;  ///< until then
  F front;    ///< density where piece `front_k` begins
  F front_k;
};

/// Looks around where a lane of `alive` leaves what it knows, and knows nothing else: a piece that
/// begins inside a volume shows it. Returns the lanes that see something, or may.
inline M check_cells(const CastVolumeJob& volume, Walk& walk, M alive, F k, const CastJob& job) {
  const M leaving = Simd::but_not(alive, Simd::less(k, walk.exit_k));
  if (!Simd::any(leaving)) return walk.visible;
  const F one = Simd::set(1.0F);
  const F t = k * Simd::set(job.step_mm);
  const M inside = Simd::both(leaving, Simd::less(t, walk.rays.end_mm));
  walk.exit_k = Simd::select(Simd::but_not(leaving, inside), Simd::set(kNever), walk.exit_k);
  walk.visible = Simd::either(Simd::but_not(walk.visible, leaving), inside);
  const M in_volume =
      Simd::both(Simd::equal(k, walk.front_k), Simd::less(Simd::set(volume.empty), walk.front));
  if (!cells_are_worth_reading(Simd::but_not(inside, in_volume), alive)) return walk.visible;
  const Surroundings around = surroundings_at(volume, walk.rays, t);
  const F exit_k =
      whole(Simd::min(around.exit_mm, walk.rays.end_mm) * Simd::set(1.0F / job.step_mm));
  // A piece that begins in an empty cell and ends in the next one must be looked at.
  const M blind = Simd::but_not(Simd::but_not(inside, around.visible), Simd::less(exit_k, k + one));
  const F known_k = Simd::max(k, Simd::select(around.visible, exit_k, exit_k - one)) + one;
  walk.exit_k = Simd::select(inside, known_k, walk.exit_k);
  walk.visible = Simd::but_not(walk.visible, blind);
  return walk.visible;
}

/// What is gathered along the rays.
struct Gathered {
  Vec3 rgb{};  ///< linear, times opacity
  F clear;
  F depth_mm;
  M has_depth;
};

/// Colour times extinction per mm, and that extinction.
struct Glow {
  Vec3 rgb{};
  F per_mm{};
};

/// Piece k of the rays.
struct Piece {
  F k, from_mm, to_mm;
};

inline void add_piece(const CastJob& job, const CastVolumeJob& volume, Walk& walk, M alive,
                      const Piece& piece, const ViewVectors& vectors, Gathered& sum, Glow& glow) {
  const F zero = Simd::set(0.0F);
  const M on = Simd::both(alive, walk.visible);
  if (!Simd::any(on)) return;
  const auto [k, from_mm, to_mm] = piece;
  const M unknown = Simd::but_not(on, Simd::equal(k, walk.front_k));
  if (Simd::any(unknown)) {
    const F density = density_at(volume, walk.rays.origin + from_mm * walk.rays.direction);
    walk.front = Simd::select(unknown, density, walk.front);
  }
  const Vec3 p = walk.rays.origin + to_mm * walk.rays.direction;
  const F back = density_at(volume, p);
  const F front = walk.front;
  walk.front = Simd::select(on, back, walk.front);
  walk.front_k = Simd::select(on, k + Simd::set(1.0F), walk.front_k);
  const F presence = presence_between(volume, front, back, on);
  const M there = Simd::less(zero, presence);
  if (!Simd::any(there)) return;
  const M noticeable = Simd::both(there, Simd::less(Simd::set(kNoticeable), presence * sum.clear));
  const F half = Simd::set(0.5F);
  const Vec3 middle = walk.rays.origin + (half * (from_mm + to_mm)) * walk.rays.direction;
  const Material material =
      lit_material(job, volume, middle, half * (front + back), vectors, there, noticeable);
  const F per_mm = Simd::select(there, material.extinction * presence, zero);
  glow = {glow.rgb + per_mm * material.rgb, glow.per_mm + per_mm};
  // Two volumes may begin in one piece; later pieces are farther away.
  const M seen = Simd::but_not(there, Simd::less(per_mm, Simd::set(kLeastExtinction)));
  const M first = Simd::both(seen, Simd::less(from_mm, sum.depth_mm));
  if (!Simd::any(first)) return;
  const F empty = Simd::set(volume.empty);
  const F before =
      Simd::select(Simd::less(front, empty), clamped((empty - front) / (back - front)), zero);
  sum.depth_mm =
      Simd::select(first, Simd::min(sum.depth_mm, mix(from_mm, to_mm, before)), sum.depth_mm);
  sum.has_depth = Simd::either(sum.has_depth, first);
}

inline void put(const CastJob& job, const Packet& packet, const Gathered& sum) {
  const F one = Simd::set(1.0F);
  const F gathered = one - sum.clear;
  const Vec3 rgb = (one / Simd::max(gathered, Simd::set(kSmall))) * sum.rgb;
  const F opacity = Simd::min(gathered * Simd::set(1.0F / kOpaque), one);
  const F depth = Simd::set(job.eye.depth_far) - Simd::set(job.eye.depth_slope) / sum.depth_mm;
  put(packet, Simd::select(sum.has_depth, srgb_bytes(rgb, opacity), I{}), job.pixels.rgba);
  put(packet, Simd::select(sum.has_depth, depth, one), job.pixels.depth);
}

/// Steps of the rays: where the first volume begins, and where the last one ends.
struct WalkedPart {
  F first_k, end_mm;
};

/// The walk through each volume that the packet meets.
inline WalkedPart begin_walks(const CastJob& job, const Packet& packet, const Shown& part,
                              const Vec3& eye, Walk (&walks)[kMaxCastVolumes]) {
  const F never = Simd::set(kNever);
  WalkedPart walked{never, Simd::set(0.0F)};
  for (int v = 0; v < job.volume_count; ++v) {
    const CastVolumeJob& volume = job.volumes[v];
    Walk& walk = walks[v];
    walk.exit_k = never;
    walk.visible = Simd::none();
    walk.front_k = never;
    walk.front = never;
    if (!is_met(volume.blocks[packet.block])) continue;
    walk.rays = rays_through(volume, volume.blocks[packet.block], part, eye);
    const M meets = Simd::less(walk.rays.begin_mm, walk.rays.end_mm);
    walk.exit_k = Simd::select(meets, whole(walk.rays.begin_mm / Simd::set(job.step_mm)), never);
    walked.first_k = Simd::min(walked.first_k, walk.exit_k);
    walked.end_mm = Simd::select(meets, Simd::max(walked.end_mm, walk.rays.end_mm), walked.end_mm);
  }
  return walked;
}

/// Adds the light of a piece of the rays, `length_mm` long.
inline void gather(const Glow& glow, F length_mm, Gathered& sum) {
  const F one = Simd::set(1.0F);
  if (!Simd::any(Simd::less(Simd::set(0.0F), glow.per_mm))) return;
  const F kept = exp2_of(-Simd::min(glow.per_mm * length_mm, Simd::set(100.0F)));
  const F colour = sum.clear * (one - kept) / Simd::max(glow.per_mm, Simd::set(1e-9F));
  sum.rgb = sum.rgb + colour * glow.rgb;
  sum.clear = sum.clear * kept;
}

inline void blend_packet(const CastJob& job, const Packet& packet) {
  const F one = Simd::set(1.0F);
  const F never = Simd::set(kNever);
  const F step_mm = Simd::set(job.step_mm);
  const Vec3 eye = eye_directions(job.eye, packet);
  const F length_per_mm = Simd::sqrt(dot(eye, eye));
  Shown part = shown_of(job.eye, eye);
  if (job.pixels.end_depth != nullptr) {
    const std::int64_t first = std::int64_t{packet.y} * packet.row + packet.x;
    const F end_depth = taken(packet, job.pixels.end_depth + first, packet.row);
    const F end_mm = Simd::set(job.eye.depth_slope) / (Simd::set(job.eye.depth_far) - end_depth);
    part.end_mm = Simd::min(end_mm, part.end_mm);
  }
  Walk walks[kMaxCastVolumes];
  auto [k, end_mm] = begin_walks(job, packet, part, eye, walks);
  Gathered sum;
  sum.clear = one;
  sum.depth_mm = never;
  sum.has_depth = Simd::none();
  M alive = Simd::both(drawn_lanes(packet), Simd::less(k * step_mm, end_mm));
  const ViewVectors vectors = Simd::any(alive) ? view_vectors_along(job, eye) : ViewVectors{};
  while (Simd::any(alive)) {
    M seeing = Simd::none();
    F soonest = never;
    for (int v = 0; v < job.volume_count; ++v) {
      seeing = Simd::either(seeing, check_cells(job.volumes[v], walks[v], alive, k, job));
      soonest = Simd::min(soonest, walks[v].exit_k);
    }
    const M skipping = Simd::but_not(alive, seeing);
    if (Simd::any(skipping)) {
      k = Simd::select(skipping, soonest, k);
    } else {
      const F from_mm = Simd::max(k * step_mm, part.begin_mm);
      const F to_mm = Simd::min((k + one) * step_mm, part.end_mm);
      Glow glow;
      for (int v = 0; v < job.volume_count; ++v) {
        add_piece(job, job.volumes[v], walks[v], alive, {k, from_mm, to_mm}, vectors, sum, glow);
      }
      gather(glow, positive(to_mm - from_mm) * length_per_mm, sum);
      k = k + one;
      alive = Simd::both(alive, Simd::less(Simd::set(1.0F - kOpaque), sum.clear));
    }
    alive = Simd::both(alive, Simd::less(k * step_mm, end_mm));
  }
  put(job, packet, sum);
}

void cast_blend(const CastJob& job, const PixelRect& rect) {
  for_packets(job.eye, rect, [&](const Packet& packet) { blend_packet(job, packet); });
}

}  // namespace
}  // namespace kerf
