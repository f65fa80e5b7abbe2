// SPDX-License-Identifier: Apache-2.0
// For the files that define `Simd` only: vectors, powers and colours of a packet of rays.
//
// The text of `lit` and `srgb` follows shaders/lighting.frag, so that all renderers look alike. No
// library function and no fused multiply-add: each operation rounds as IEEE 754 says, in every set.
#pragma once

#include "visualizer/cast/cast_job.hpp"

namespace kerf {
namespace {

using F = Simd::F;
using I = Simd::I;
using M = Simd::M;

struct Vec3 {
  F x, y, z;
};

inline Vec3 vec3(const float (&v)[3]) {
  return {Simd::set(v[0]), Simd::set(v[1]), Simd::set(v[2])};
}
inline Vec3 operator+(Vec3 a, Vec3 b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline Vec3 operator-(Vec3 a, Vec3 b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline Vec3 operator*(F s, Vec3 a) {
  return {s * a.x, s * a.y, s * a.z};
}
inline Vec3 operator-(Vec3 a) {
  return {-a.x, -a.y, -a.z};
}
inline F dot(Vec3 a, Vec3 b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline Vec3 select(M m, Vec3 yes, Vec3 no) {
  return {Simd::select(m, yes.x, no.x), Simd::select(m, yes.y, no.y), Simd::select(m, yes.z, no.z)};
}
inline F whole(F a) {
  return Simd::to_float(Simd::to_int(a));
}
inline F positive(F a) {
  return Simd::max(a, Simd::set(0.0F));
}
inline F clamped(F a) {
  return Simd::min(positive(a), Simd::set(1.0F));
}
inline Vec3 normalized(Vec3 a) {
  return (Simd::set(1.0F) / Simd::sqrt(dot(a, a))) * a;
}

inline Vec3 transformed(const float (&m)[3][3], Vec3 a) {
  return {dot(vec3(m[0]), a), dot(vec3(m[1]), a), dot(vec3(m[2]), a)};
}
inline Vec3 transformed_back(const float (&m)[3][3], Vec3 a) {
  return a.x * vec3(m[0]) + a.y * vec3(m[1]) + a.z * vec3(m[2]);
}

/// x > 0 and normal. 2/ln 2 * atanh of (m - 1)/(m + 1), its series up to the 7th power: 2e-5.
inline F log2_of(F x) {
  const I bits = Simd::bits(x);
  const F exponent = Simd::to_float((bits >> 23) - 127);
  const F m = Simd::from_bits((bits & 0x7fffff) | 0x3f800000);
  const F s = (m - Simd::set(1.0F)) / (m + Simd::set(1.0F));
  const F q = s * s;
  const F series =
      Simd::set(2.8853901F) +
      q * (Simd::set(0.96179669F) + q * (Simd::set(0.57707802F) + q * Simd::set(0.41219858F)));
  return exponent + s * series;
}

/// x in -126..0. Series of 2^f for |f| <= 1/2 up to the 5th power: 2.4e-6 of the result.
inline F exp2_of(F x) {
  const I power = Simd::to_int(x - Simd::set(0.5F));
  const F f = x - Simd::to_float(power);
  const F series = Simd::set(1.0F) +
                   f * (Simd::set(0.69314718F) +
                        f * (Simd::set(0.24022651F) +
                             f * (Simd::set(0.055504109F) +
                                  f * (Simd::set(0.0096181291F) + f * Simd::set(0.0013333558F)))));
  return Simd::from_bits(Simd::bits(series) + (power << 23));
}

inline F srgb_of(F linear) {
  const F c = clamped(linear);
  const F linear_end = Simd::set(0.0031308F);
  const F power = exp2_of(log2_of(Simd::max(c, linear_end)) * Simd::set(1.0F / 2.4F));
  return Simd::select(Simd::less(c, linear_end), Simd::set(12.92F) * c,
                      Simd::set(1.055F) * power - Simd::set(0.055F));
}
inline I byte_of(F share) {
  return Simd::to_int(share * Simd::set(255.0F) + Simd::set(0.5F));
}
/// As `CastPixels::rgba`.
inline I srgb_bytes(Vec3 linear, F opacity) {
  return byte_of(srgb_of(linear.x)) | byte_of(srgb_of(linear.y)) << 8 |
         byte_of(srgb_of(linear.z)) << 16 | byte_of(clamped(opacity)) << 24;
}

/// a^24.
inline F to_the_24th(F a) {
  F b = a * a * a;
  for (int i = 0; i < 3; ++i) b = b * b;
  return b;
}

/// Unit vectors of a ray, the same for all that it meets.
struct Gaze {
  Vec3 to_eye;
  Vec3 key_half, fill_half;  ///< half-way to a light: normals that mirror it into the eye
};

inline Gaze gaze_along(const CastJob& job, Vec3 eye) {
  const Vec3 to_eye = -normalized(eye);
  return {to_eye, normalized(vec3(job.key_light) + to_eye),
          normalized(vec3(job.fill_light) + to_eye)};
}

/// lighting.frag: two lights of a photographer that go with the eye, and a sky that stays.
inline Vec3 lit(const CastJob& job, Vec3 albedo, Vec3 normal, const Gaze& gaze, F openness) {
  const F one = Simd::set(1.0F);
  const F half = Simd::set(0.5F);
  const F skyward = half + half * dot(normal, vec3(job.up));
  const Vec3 ground{Simd::set(0.16F), Simd::set(0.145F), Simd::set(0.13F)};
  const Vec3 sky{Simd::set(0.32F), Simd::set(0.34F), Simd::set(0.37F)};
  const Vec3 ambient = ground + skyward * (sky - ground);
  const F key = Simd::set(0.72F) * positive((dot(normal, vec3(job.key_light)) + Simd::set(0.15F)) *
                                            Simd::set(1.0F / 1.15F));
  const F fill = Simd::set(0.16F) * positive(dot(normal, vec3(job.fill_light)));
  const Vec3 diffuse = key * Vec3{one, Simd::set(0.97F), Simd::set(0.92F)} +
                       fill * Vec3{Simd::set(0.75F), Simd::set(0.85F), one};
  const F key_shine = to_the_24th(positive(dot(normal, gaze.key_half)));
  const F fill_shine = to_the_24th(positive(dot(normal, gaze.fill_half)));
  const F shine =
      openness * (Simd::set(0.22F) * key_shine * key_shine + Simd::set(0.04F) * fill_shine);
  const F share = Simd::set(0.35F) + openness * Simd::set(0.65F);
  const Vec3 light = openness * ambient + share * diffuse;
  return {albedo.x * light.x + shine, albedo.y * light.y + shine, albedo.z * light.z + shine};
}

}  // namespace
}  // namespace kerf
