// SPDX-License-Identifier: Apache-2.0
// The kernels for any machine: the same tables, plain loops.
#include <cstddef>
#include <cstdint>

#include "controller/kernel/kernel_set.hpp"

namespace kerf {
namespace {

constexpr std::int32_t kLanes = 16;
constexpr std::int16_t kAir = -32768;  ///< density 0 after re-centring

void copy_box(const TickBox& tool, const VoxelGrid& grid, const Density* density, VoxelIndex origin,
              const BoxScratch& scratch) noexcept {
  std::int16_t* out = scratch.box;
  for (std::int32_t z = origin.z; z < origin.z + tool.box.z; ++z) {
    for (std::int32_t y = origin.y; y < origin.y + tool.box.y; ++y, out += tool.box.x) {
      for (std::int32_t i = 0; i < tool.box.x; ++i) {
        const VoxelIndex v{origin.x + i, y, z};
        out[i] = grid.contains(v)
                     ? static_cast<std::int16_t>(density[grid.index(v.x, v.y, v.z)] ^ 0x8000)
                     : kAir;
      }
    }
  }
}

void correlate(const AlignedTable& tool, const std::int16_t* box,
               std::int64_t (&sum)[3][8]) noexcept {
  const std::ptrdiff_t pitch = tool.box.x, plane = pitch * tool.box.y;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::ptrdiff_t c = 0; c < 8; ++c) {
      const std::int16_t* corner = box + (c & 1) + (c >> 1 & 1) * pitch + (c >> 2) * plane;
      std::int64_t total = 0;
      const AlignedChunk* const chunks = tool.chunks[axis];
      for (std::int32_t i = 0; i < tool.chunk_count[axis]; ++i) {
        const std::int16_t* low = tool.vectors + chunks[i].vector;
        const std::int16_t* high = low + kLanes;
        const std::int16_t* density = corner + chunks[i].box_at;
        std::int32_t low_sum = 0, high_sum = 0;  // 16 products below 2^24
        for (std::int32_t lane = 0; lane < kLanes; ++lane) {
          low_sum += low[lane] * density[lane];
          high_sum += high[lane] * density[lane];
        }
        total += low_sum + std::int64_t{512} * high_sum;
      }
      sum[axis][c] = total;
    }
  }
}

/// Minus the overlap ratios of one row, 0 where the density is 0.
bool overlap_row(const AlignedTable& tool, const std::int32_t (&weight)[8], std::int32_t y,
                 std::int32_t z, const std::int16_t* density, std::int16_t* ratio) noexcept {
  const std::int32_t words = tool.row_lanes / 32;
  std::int32_t any = 0;
  for (std::int32_t x = 0; x < tool.row_lanes; ++x) ratio[x] = 0;
  for (std::int32_t c = 0; c < 8; ++c) {
    const std::int32_t row = (z + 1 - (c >> 2)) * (tool.size.y + 2) + y + 1 - (c >> 1 & 1);
    const std::uint32_t* bits = tool.mask + static_cast<std::ptrdiff_t>(2 * row + (c & 1)) * words;
    for (std::int32_t x = 2; x < tool.size.x + 3; ++x) {
      if ((bits[x / 32] >> (x % 32) & 1) == 0 || density[x] == kAir) continue;
      ratio[x] = static_cast<std::int16_t>(ratio[x] - weight[c]);
      any |= weight[c];
    }
  }
  return any != 0;
}

/// Rows of the five planes from z on, filtered along z: smooth, then slope.
void filter_z(const TickBox& tool, std::int32_t row_lanes, const BoxScratch& scratch,
              std::int32_t z, std::int32_t first, std::int32_t last) noexcept {
  const std::ptrdiff_t pitch = tool.box.x, plane = pitch * tool.box.y;
  for (std::int32_t y = first; y <= last + 4; ++y) {
    std::int32_t* smooth = scratch.filter + std::ptrdiff_t{y} * row_lanes;
    std::int32_t* slope = smooth + std::ptrdiff_t{tool.box.y} * row_lanes;
    const std::int16_t* d = scratch.box + z * plane + y * pitch;
    for (std::int32_t x = 0; x < tool.box.x; ++x) {
      std::int32_t s = 0, t = 0;
      for (std::size_t k = 0; k < 5; ++k) {
        const std::int32_t value = d[static_cast<std::ptrdiff_t>(k) * plane + x];
        s += tool.taps.smooth[k] * value;
        t += tool.taps.slope[k] * value;
      }
      smooth[x] = s;
      slope[x] = t;
    }
  }
}

/// Sums of the rows of a plane by axis, minus sign pending: the stored ratios are negative.
struct RowSums {
  std::int64_t x = 0, y = 0, z = 0;

  void settle(WideSum (&sum)[3], int shift) noexcept {
    sum[0].add(-x, shift);
    sum[1].add(-y, shift);
    sum[2].add(-z, shift);
    x = y = z = 0;
  }
};

/// One row's part of a sum of gradients; the x filter works on the ratios, as in the vector form.
void press_row(const TickBox& box, std::int32_t row_lanes, const std::int16_t* ratio,
               const std::int32_t* smooth_z, const std::int32_t* slope_z, RowSums& sum) noexcept {
  const ExactTaps& taps = box.taps;
  for (std::int32_t x = 0; x < box.box.x; ++x) {
    std::int32_t along = 0, across = 0, smooth = 0, slope = 0, deep = 0;
    for (std::size_t k = 0; k < 5; ++k) {
      const auto step = static_cast<std::ptrdiff_t>(k);
      along += taps.smooth[k] * ratio[x + step - 2];
      across -= taps.slope[k] * ratio[x + step - 2];
      smooth += taps.smooth[k] * smooth_z[step * row_lanes + x];
      slope += taps.slope[k] * smooth_z[step * row_lanes + x];
      deep += taps.smooth[k] * slope_z[step * row_lanes + x];
    }
    sum.x += std::int64_t{smooth} * across;
    sum.y += std::int64_t{slope} * along;
    sum.z += std::int64_t{deep} * along;
  }
}

void press(const AlignedTable& tool, const std::int32_t (&weight)[8], const BoxScratch& scratch,
           std::int64_t (&sum)[3]) noexcept {
  const std::int32_t* const slopes =
      scratch.filter + static_cast<std::ptrdiff_t>(tool.box.y) * tool.row_lanes;
  RowSums plane;
  WideSum total[3];
  for (std::int32_t x = 0; x < kRatioRowPad; ++x) scratch.ratio[x] = 0;
  std::int16_t* ratio = scratch.ratio + kRatioRowPad;
  std::uint8_t* live = scratch.live;
  for (std::int32_t z = 0; z <= tool.size.z; ++z) {
    filter_z(tool, tool.row_lanes, scratch, z, 0, tool.size.y);
    for (std::int32_t y = 0; y <= tool.size.y; ++y) {
      const std::int16_t* density =
          scratch.box + (static_cast<std::ptrdiff_t>(z + 2) * tool.box.y + y + 2) * tool.box.x;
      *live = overlap_row(tool, weight, y, z, density, ratio) ? 1 : 0;
      for (std::int32_t x = 0; x < kRatioRowPad; ++x) ratio[tool.row_lanes + x] = 0;
      if (*live != 0) {
        const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(y) * tool.row_lanes;
        press_row(tool, tool.row_lanes, ratio, scratch.filter + at, slopes + at, plane);
      }
      ratio += tool.row_lanes + kRatioRowPad;
      ++live;
    }
    plane.settle(total, tool.sum_shift);
  }
  for (int axis = 0; axis < 3; ++axis) sum[axis] = total[axis].over(tool.sum_shift);
}

void cover(const AlignedTable& tool, const std::int32_t (&weight)[8],
           const BoxScratch& scratch) noexcept {
  std::int16_t* ratio = scratch.ratio + kRatioRowPad;
  std::uint8_t* live = scratch.live;
  for (std::int32_t z = 0; z <= tool.size.z; ++z) {
    for (std::int32_t y = 0; y <= tool.size.y; ++y, ratio += tool.row_lanes + kRatioRowPad) {
      const std::int16_t* density =
          scratch.box + (static_cast<std::ptrdiff_t>(z + 2) * tool.box.y + y + 2) * tool.box.x;
      *live++ = overlap_row(tool, weight, y, z, density, ratio) ? 1 : 0;
      for (std::int32_t x = 0; x < kRatioRowPad; ++x) ratio[tool.row_lanes + x] = 0;
    }
  }
}

BoxCut cut(const TickBox& tool, const CutRate& rate, const VoxelGrid& grid, Density* density,
           VoxelIndex origin, const BoxScratch& scratch, std::uint16_t* carry) noexcept {
  BoxCut cut{0, {tool.box.x, tool.box.y, tool.box.z}, {-1, -1, -1}};
  const auto include = [](std::int32_t at, std::int32_t& lo, std::int32_t& hi) {
    lo = at < lo ? at : lo;
    hi = at > hi ? at : hi;
  };
  const std::int16_t* ratio = scratch.ratio + kRatioRowPad;
  const std::uint8_t* live = scratch.live;
  for (std::int32_t z = 2; z <= tool.size.z + 2; ++z) {
    for (std::int32_t y = 2; y <= tool.size.y + 2; ++y) {
      for (std::int32_t x = 2; *live != 0 && x <= tool.size.x + 2; ++x) {
        const auto r = static_cast<std::uint16_t>(-ratio[x]);
        if (r == 0) continue;
        Density& rho = density[grid.index(origin.x + x, origin.y + y, origin.z + z)];
        const std::uint32_t product = rho * (std::uint32_t{r} * rate.mantissa >> 15);
        const std::uint32_t loss =
            rate.exponent == 0 ? product << 1 : product >> (rate.exponent - 1);
        const std::uint32_t total = loss + carry[x];
        carry[x] = static_cast<std::uint16_t>(total & 0xffff);
        if (total >> 16 == 0) continue;
        rho = static_cast<Density>(rho - (total >> 16));
        cut.density_steps += total >> 16;
        include(x, cut.lo.x, cut.hi.x);
        include(y, cut.lo.y, cut.hi.y);
        include(z, cut.lo.z, cut.hi.z);
      }
      ratio += tool.row_lanes + kRatioRowPad;
      ++live;
    }
  }
  return cut;
}

}  // namespace
}  // namespace kerf

#include "controller/kernel/sets/scalar_loops.hpp"
#include "controller/kernel/sets/scalar_points.hpp"
#include "controller/kernel/sets/set_table.hpp"

namespace kerf {

const KernelSet kScalarSet = the_set<kScalarShape>();

}  // namespace kerf
