// SPDX-License-Identifier: Apache-2.0
// For the files that define `Simd` only: the pixels of a packet of rays.
#pragma once

#include "visualizer/cast/packet_math.hpp"

namespace kerf {
namespace {

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
  const auto place = [](F lane, std::int32_t first, std::int32_t size) {
    const F centre = lane + Simd::set(static_cast<float>(first) + 0.5F);
    return centre * Simd::set(2.0F / static_cast<float>(size)) - Simd::set(1.0F);
  };
  return {place(Simd::lane_x(), packet.x, eye.width) * Simd::set(eye.half_width_at_1mm) +
              Simd::set(eye.middle_right_at_1mm),
          place(Simd::lane_y(), packet.y, eye.height) * Simd::set(eye.half_height_at_1mm),
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
