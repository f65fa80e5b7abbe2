// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "visualizer/cast/cast_kernels.hpp"

// For the files that define `Simd` only: vectors, powers, colours and pixels of a packet of rays.
//
// The text of `lit` and `srgb` follows shaders/lighting.frag, so that all renderers look alike. No
// library function and no fused multiply-add: each operation rounds as IEEE 754 says, in every set.

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
inline I byte_of(F fraction) {
  return Simd::to_int(fraction * Simd::set(255.0F) + Simd::set(0.5F));
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
struct ViewVectors {
  Vec3 to_eye;
  Vec3 key_half, fill_half;  ///< half-way to a light: normals that mirror it into the eye
};

inline ViewVectors view_vectors_along(const CastJob& job, Vec3 eye) {
  const Vec3 to_eye = -normalized(eye);
  return {to_eye, normalized(vec3(job.key_light) + to_eye),
          normalized(vec3(job.fill_light) + to_eye)};
}

/// lighting.frag: two lights of a photographer that go with the eye, and a sky that stays.
inline Vec3 lit(const CastJob& job, Vec3 albedo, Vec3 normal, const ViewVectors& vectors,
                F ao_factor) {
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
  const F key_shine = to_the_24th(positive(dot(normal, vectors.key_half)));
  const F fill_shine = to_the_24th(positive(dot(normal, vectors.fill_half)));
  const F shine =
      ao_factor * (Simd::set(0.22F) * key_shine * key_shine + Simd::set(0.04F) * fill_shine);
  const F fraction = Simd::set(0.35F) + ao_factor * Simd::set(0.65F);
  const Vec3 light = ao_factor * ambient + fraction * diffuse;
  return {albedo.x * light.x + shine, albedo.y * light.y + shine, albedo.z * light.z + shine};
}

/// A packet's lowest left pixel; lanes beyond the rectangle or the block are not drawn.
struct Packet {
  std::int32_t x, y;
  std::int32_t wide, high;
  std::int32_t row;    ///< of the picture
  std::int32_t block;  ///< index of the block that it lies in
};

/// Calls `cast` for each packet of `rect`.
template <class Cast>
void for_packets(const CastEye& eye, const PixelRect& rect, const Cast& cast) {
  const auto up_to = [](std::int32_t from, std::int32_t step, std::int32_t end) {
    const std::int32_t next = from / step * step + step;
    return next < end ? next : end;
  };
  const std::int32_t blocks_across = (eye.width + kCastBlock - 1) / kCastBlock;
  for (std::int32_t y = rect.y0, y1 = 0; y < rect.y1; y = y1) {
    y1 = up_to(y, Simd::kHigh, rect.y1);
    for (std::int32_t x = rect.x0, x1 = 0; x < rect.x1; x = x1) {
      x1 = up_to(x, Simd::kWide, rect.x1);
      cast(
          Packet{x, y, x1 - x, y1 - y, eye.width, y / kCastBlock * blocks_across + x / kCastBlock});
    }
  }
}

inline M drawn_lanes(const Packet& packet) {
  return Simd::both(Simd::less(Simd::lane_x(), Simd::set(static_cast<float>(packet.wide))),
                    Simd::less(Simd::lane_y(), Simd::set(static_cast<float>(packet.high))));
}

/// From the eye to the pixels' centres, 1 mm along the view axis.
inline Vec3 eye_directions(const CastEye& eye, const Packet& packet) {
  const auto position = [](F lane, std::int32_t first, std::int32_t size) {
    const F centre = lane + Simd::set(static_cast<float>(first) + 0.5F);
    return centre * Simd::set(2.0F / static_cast<float>(size)) - Simd::set(1.0F);
  };
  return {position(Simd::lane_x(), packet.x, eye.width) * Simd::set(eye.half_width_at_1mm) +
              Simd::set(eye.middle_right_at_1mm),
          position(Simd::lane_y(), packet.y, eye.height) * Simd::set(eye.half_height_at_1mm),
          Simd::set(-1.0F)};
}

/// Writes `lanes`, of 4 bytes each, to entry (x + lane_x, y + lane_y) * stride + offset.
template <class Value, class Lanes>
void put(const Packet& packet, Lanes lanes, Value* out, std::int32_t stride = 1,
         std::int32_t offset = 0) {
  Value values[Simd::kWide * Simd::kHigh];
  Simd::store(values, lanes);
  for (std::int32_t y = 0; y < packet.high; ++y) {
    const std::int64_t row = std::int64_t{packet.y + y} * packet.row + packet.x;
    for (std::int32_t x = 0; x < packet.wide; ++x) {
      out[(row + x) * stride + offset] = values[y * Simd::kWide + x];
    }
  }
}

/// Reads what lies at the packet's pixels; 0 in lanes that are not drawn. `in` is the value of its
/// lowest left pixel, in rows of `row`.
inline F taken(const Packet& packet, const float* in, std::int32_t row) {
  F lanes{};
  float values[Simd::kWide * Simd::kHigh] = {};
  const std::int32_t high = packet.high < Simd::kHigh ? packet.high : Simd::kHigh;
  const std::int32_t wide = packet.wide < Simd::kWide ? packet.wide : Simd::kWide;
  for (std::int32_t y = 0; y < high; ++y) {
    const float* const from = in + std::int64_t{y} * row;
    if (wide == Simd::kWide) {
      __builtin_memcpy(&values[y * Simd::kWide], from, Simd::kWide * sizeof(float));
      continue;
    }
    for (std::int32_t x = 0; x < wide; ++x) values[y * Simd::kWide + x] = from[x];
  }
  __builtin_memcpy(&lanes, values, sizeof(lanes));
  return lanes;
}

}  // namespace
}  // namespace kerf
