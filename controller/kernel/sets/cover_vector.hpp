// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "controller/kernel/kernel_set.hpp"
#include "controller/kernel/sets/box_vector.hpp"
#include "controller/kernel/sets/set_common.hpp"

// Weight and loss of a group of voxels under the tool, for AVX2 and AVX-512, bit-equal to
// scalar_loops.hpp. `Simd` as in box_vector.hpp.

namespace kerf {
namespace {

/// Distances along one axis beside the spindle, at most one rim radius: beyond it the speed is the
/// rim's.
class PlacesBeside {
 public:
  /// `lane`: of the first; steps are at most kSteepestStep.
  [[gnu::always_inline]] PlacesBeside(std::int64_t first, std::int64_t step,
                                      std::int32_t lane) noexcept {
    // If the first lane is this far away, all lanes are beyond the rim; 32 bits then hold them.
    const std::int64_t reach = kRim + kCoverGroup * (step < 0 ? -step : step);
    const std::int64_t at = first + lane * step;
    const std::int64_t above = at < -reach ? -reach : at;
    first_ = Simd::set32(static_cast<std::int32_t>(above > reach ? reach : above));
    step_ = Simd::set32(static_cast<std::int32_t>(step));
  }
  [[gnu::always_inline]] V distance(V number) const noexcept {
    const V at = Simd::add32(first_, Simd::multiply32(step_, number));
    const V away = Simd::max32(at, Simd::sub32(Simd::zero(), at));
    return Simd::min32(away, Simd::set32(kRim));
  }

 private:
  static constexpr std::int32_t kRim = 1 << 20;
  V first_, step_;
};

/// Speeds of the tool's surface from distances along two axes: `SpindleFrame::speed`.
[[gnu::always_inline]] inline V speeds_at(V x, V z, const std::uint32_t* roots,
                                          V slowest) noexcept {
  // (x^2 + z^2) / 2^15 from halves of 10 bits: the squares have 40.
  const V low_bits = Simd::set32(1023);
  const V high = Simd::bit_or(Simd::srl32<10>(x), Simd::sll32<16>(Simd::srl32<10>(z)));
  const V low =
      Simd::bit_or(Simd::bit_and(x, low_bits), Simd::sll32<16>(Simd::bit_and(z, low_bits)));
  const V top = Simd::multiply_pairs(high, high), cross = Simd::multiply_pairs(high, low),
          rest = Simd::multiply_pairs(low, low);
  const V far =
      Simd::add32(Simd::sll32<5>(top), Simd::srl32<15>(Simd::add32(Simd::sll32<11>(cross), rest)));
  const V square = Simd::min32(far, Simd::set32(1 << 25));
  const V root = Simd::gather32(roots, Simd::srl32<15>(square));
  const V beyond = Simd::bit_and(square, Simd::set32(0x7fff));
  const V rise = Simd::srl32<15>(Simd::multiply_pairs(Simd::srl32<16>(root), beyond));
  return Simd::max32(Simd::add32(Simd::bit_and(root, Simd::set32(0xffff)), rise), slowest);
}

constexpr std::int32_t kWide = kLanes / 2, kParts = kCoverGroup / kWide;  ///< of 32 bits

/// `cover_lanes` of scalar_loops.hpp.
[[gnu::always_inline]] inline std::uint32_t cover_lanes(const CoverRow& row, std::int32_t lane,
                                                        V (&covered)[kParts]) noexcept {
  const V low_half = Simd::set32(0xffff), sign = Simd::set32(0x8000);
  std::uint32_t lanes = 0;
  KERF_UNROLL
  for (std::int32_t p = 0; p < kParts; ++p) {
    const V less = Simd::widen16(row.ratio + lane + p * kWide);
    const V ratio = Simd::bit_and(Simd::sub32(Simd::zero(), less), low_half);
    const V rho = Simd::bit_xor(Simd::widen16(row.density + lane + p * kWide), sign);
    covered[p] = Simd::multiply32(ratio, rho);
    lanes |= Simd::not_zero32(covered[p]) << (p * kWide);
  }
  return lanes;
}

/// `weigh_lanes` of scalar_loops.hpp.
[[gnu::always_inline]] inline bool weigh_lanes(const CoverRow& row, std::int32_t& lane,
                                               CoveredGroup& group, CoverSums& sums) noexcept {
  V covered[kParts];
  const std::uint32_t lanes = cover_lanes(row, lane, covered);
  if (lanes == 0) return false;
  const std::int32_t begin = group_begin(row, lane, lanes);
  if (begin != lane) cover_lanes(row, lane = begin, covered);
  const PlacesBeside across_x(row.place[0], row.step[0], lane);
  const PlacesBeside across_z(row.place[1], row.step[1], lane);
  const V slowest = Simd::set32(row.slowest), bits15 = Simd::set32(0x7fff);
  V whole = Simd::zero(), numbers = Simd::zero(), weights = Simd::zero(), speeds = Simd::zero();
  KERF_UNROLL
  for (std::int32_t p = 0; p < kParts; ++p) {
    const V number = Simd::add32(Simd::count32(), Simd::set32(p * kWide));
    const V speed =
        speeds_at(across_x.distance(number), across_z.distance(number), row.roots, slowest);
    // covered times speed / 2^15, in 32 bits.
    const V weight =
        Simd::add32(Simd::multiply32(Simd::srl32<15>(covered[p]), speed),
                    Simd::srl32<15>(Simd::multiply32(Simd::bit_and(covered[p], bits15), speed)));
    Simd::store(group.covered + p * kWide, covered[p]);
    Simd::store(group.weight + p * kWide, weight);
    Simd::narrow16(group.speed + p * kWide, speed);
    whole = Simd::add64(whole, Simd::add64(Simd::low32(covered[p]), Simd::odd32(covered[p])));
    weights = Simd::add64(weights, Simd::add64(Simd::low32(weight), Simd::odd32(weight)));
    numbers = add_products(numbers, covered[p], number);
    speeds = add_products(speeds, weight, speed);
  }
  sums = {static_cast<std::uint64_t>(Simd::sum64(whole)),
          static_cast<std::uint64_t>(Simd::sum64(numbers)),
          static_cast<std::uint64_t>(Simd::sum64(weights)),
          static_cast<std::uint64_t>(Simd::sum64(speeds))};
  return true;
}

/// min(weight price, 2 covered) of every other lane, the entries of 64 bits. `over` gets a sign
/// if the first is larger.
[[gnu::always_inline]] inline V part_of_even(V weight, V mantissa, V shift, V covered,
                                             V& over) noexcept {
  const V wanted = Simd::srl64(Simd::multiply_even_unsigned(weight, mantissa), shift);
  const V most = Simd::add64(covered, covered);
  over = Simd::bit_or(over, Simd::sub64(most, wanted));  // both are below 2^63
  return Simd::min64(wanted, most);
}

/// `take_lanes` of scalar_loops.hpp.
[[gnu::always_inline]] inline TakenLanes take_lanes(const CoverSpend& spend, CoveredGroup& group,
                                                    std::uint16_t (&rho)[kCoverGroup]) noexcept {
  TakenLanes taken;
  taken.lanes = 0;
  const auto phase = static_cast<std::uint32_t>(group.at) * spend.phase_by_voxel + spend.phase;
  const V first_phase = Simd::set32(static_cast<std::int32_t>(phase & 0xffff));
  const V by_voxel = Simd::set32(spend.phase_by_voxel), low_half = Simd::set32(0xffff);
  V mantissa = Simd::set32(static_cast<std::int32_t>(spend.mantissa[group.material[0]]));
  V shift = Simd::set32(static_cast<std::int32_t>(spend.shift[group.material[0]]));
  V over = Simd::zero(), sum = Simd::zero();
  KERF_UNROLL
  for (std::int32_t p = 0; p < kParts; ++p) {
    const std::int32_t from = p * kWide;
    if (group.mixed) {
      const V material = Simd::widen8(group.material + from);
      mantissa = Simd::gather32(spend.mantissa, material);
      shift = Simd::gather32(spend.shift, material);
    }
    const V weight = Simd::load(group.weight + from), covered = Simd::load(group.covered + from);
    const V even = part_of_even(weight, mantissa, Simd::low32(shift), Simd::low32(covered), over);
    const V odd = part_of_even(Simd::odd32(weight), Simd::odd32(mantissa), Simd::odd32(shift),
                               Simd::odd32(covered), over);
    const V part = Simd::bit_or(even, Simd::even32(odd));
    Simd::store(group.covered + from, Simd::sub32(covered, Simd::srl32<1>(part)));
    const V number = Simd::add32(Simd::count32(), Simd::set32(from));
    const V own_phase =
        Simd::bit_and(Simd::add32(first_phase, Simd::multiply32(by_voxel, number)), low_half);
    const V steps = Simd::srl32<16>(Simd::add32(part, own_phase));
    const V before = Simd::widen16(rho + from);
    const V lost = Simd::min32(steps, before);
    Simd::narrow16(rho + from, Simd::sub32(before, lost));
    Simd::store(taken.steps + from, lost);
    sum = Simd::add32(sum, lost);
    taken.lanes |= Simd::not_zero32(lost) << from;
  }
  taken.sum = static_cast<std::uint32_t>(Simd::sum64(Simd::widened(sum)));
  taken.full = Simd::negative64(over);
  return taken;
}

}  // namespace
}  // namespace kerf
