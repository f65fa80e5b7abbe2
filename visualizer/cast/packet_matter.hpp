// SPDX-License-Identifier: Apache-2.0
// For the files that define `Simd` only: the translucent matter of one piece of a packet's rays,
// how much of it there is and which colour it has, as in shaders/matter.frag.
#pragma once

#include "visualizer/cast/packet_shading.hpp"

namespace kerf {
namespace {

constexpr float kInside = 0.62F;  // inside, light comes from everywhere

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

/// The matter in the middle of a piece, and its light.
inline Matter matter_at(const CastJob& job, const CastVolumeJob& volume, Vec3 p, F density,
                        const Gaze& gaze, M there, M noticeable) {
  const F zero = Simd::set(0.0F);
  const F full = Simd::set(volume.full);
  M plain = there;
  Matter matter{};
  if (volume.labels != nullptr) {
    const Labelled labelled = by_labels(volume, p, there);
    matter = labelled.mean;
    plain = Simd::but_not(there, Simd::less(zero, labelled.share));
  }
  const M fading = Simd::both(plain, Simd::less(density, full));
  Vec3 gradient{};
  if (Simd::any(Simd::either(noticeable, fading))) gradient = stored_gradient_at(volume, p);
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
    matter = select(plain, nearest_by_density(volume, deep), matter);
  }
  const Vec3 dim = Simd::set(kInside) * matter.rgb;
  // Where the density hardly changes there is no surface to be lit.
  const F x = clamped((size - flat) * Simd::set(1.0F / 0.08F));
  const M lights = Simd::both(noticeable, Simd::less(zero, x));
  if (!Simd::any(lights)) return {dim, matter.extinction};
  const Vec3 unit = -normalized(transformed_back(volume.from_eye, gradient));
  const Vec3 normal = select(Simd::less(dot(unit, gaze.to_eye), zero), -unit, unit);
  const F surface = x * x * (Simd::set(3.0F) - Simd::set(2.0F) * x);
  const Vec3 bright = mix(dim, lit(job, matter.rgb, normal, gaze, Simd::set(1.0F)), surface);
  return {select(lights, bright, dim), matter.extinction};
}

}  // namespace
}  // namespace kerf
