// SPDX-License-Identifier: Apache-2.0
#include "controller/plan/tables/sample_tables.hpp"

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <map>
#include <numeric>
#include <set>

#include "controller/kernel/gradient.hpp"

namespace kerf {
namespace {

void grow(auto& memory, std::size_t entries) {
  if (memory.size() < entries) memory.resize(entries);
}

}  // namespace

std::uint64_t total_bytes(const std::vector<ArrayBytes>& arrays) {
  std::uint64_t sum = 0;
  for (const ArrayBytes& array : arrays) sum += array.bytes;
  return sum;
}

void BoxMemory::hold(VoxelIndex tool_size, bool mills) {
  const BoxScratchSize need = box_scratch_size(tool_size);
  grow(box_, need.box);
  grow(inside_, need.inside);
  if (!mills) return;
  grow(ratio_, need.ratio);
  grow(filter_, need.filter);
  grow(live_, need.live);
}

BoxScratch BoxMemory::view() noexcept {
  return {box_.data(), ratio_.data(), filter_.data(), inside_.data(), live_.data()};
}

std::vector<ArrayBytes> BoxMemory::arrays() const {
  const auto named = [](const char* name, const auto& memory) {
    return ArrayBytes{name, memory.size() * sizeof(memory[0]), true};
  };
  return {named("box", box_), named("columns inside", inside_), named("overlap ratios", ratio_),
          named("filtered rows", filter_), named("live rows", live_)};
}

void SplatMemory::hold(const std::array<std::size_t, 3>& width_vox, std::size_t samples) {
  const auto cells = [&](std::size_t axis) {
    return static_cast<std::int32_t>(width_vox[axis]) - 1;
  };
  const VoxelIndex size{cells(0), cells(1), cells(2)};
  const SplatScratchSize need = splat_scratch_size(size, samples);
  tick_.hold(size, true);
  for (auto& along : place_) grow(along, need.place);
  grow(sums_, need.sums);
  for (auto& part : rest_) grow(part, need.rest);
  grow(rest_live_, need.rest_live);
}

SplatScratch SplatMemory::view() noexcept {
  return {.tick = tick_.view(),
          .place = {place_[0].data(), place_[1].data(), place_[2].data()},
          .sums = sums_.data(),
          .rest = {rest_[0].data(), rest_[1].data()},
          .rest_live = rest_live_.data()};
}

std::vector<ArrayBytes> SplatMemory::arrays() const {
  std::vector<ArrayBytes> list = tick_.arrays();
  const auto add = [&](const char* name, const auto& memory, std::size_t times) {
    list.push_back({name, times * memory.size() * sizeof(memory[0]), true});
  };
  add("sample places", place_[0], 3);
  add("overlap sums", sums_, 1);
  add("rest rows", rest_[0], 2);
  add("live rest rows", rest_live_, 1);
  return list;
}

namespace {

/// The golden section of `count`, or the next number without a common divisor: steps of it visit
/// every index once, and consecutive ones lie far apart.
std::size_t scattering_step(std::size_t count) {
  auto step = static_cast<std::size_t>(0.618 * static_cast<double>(count)) + 1;
  while (std::gcd(step, count) != 1) ++step;
  return step;
}

}  // namespace

SampleTool::SampleTool(std::span<const ToolOffset> offsets, SampleOrder order)
    : count_(static_cast<std::int32_t>(offsets.size())) {
  const std::size_t step =
      order == SampleOrder::scattered && !offsets.empty() ? scattering_step(offsets.size()) : 1;
  const auto group = static_cast<std::size_t>(kSampleGroup);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::vector<std::int32_t>& along = offset_[axis];
    along.reserve((offsets.size() + group - 1) / group * group);
    for (std::size_t i = 0; i < offsets.size(); ++i) {
      along.push_back(offsets[i * step % offsets.size()][axis]);
    }
    while (along.size() % group != 0) along.push_back(along.back());
  }
}

SampleTable SampleTool::table() const noexcept {
  return {{offset_[0].data(), offset_[1].data(), offset_[2].data()}, count_};
}

std::size_t SampleTool::bytes() const noexcept {
  return 3 * offset_[0].size() * sizeof(std::int32_t);
}

namespace {

/// Whether each product of three taps over 2^shift is that of the stored gradients.
constexpr bool are_taps_of(const ExactTaps& aligned, GradientKernel kernel) {
  const GradientTaps stored = taps(kernel);
  for (std::size_t i = 0; i < 125; ++i) {
    const std::size_t a = i % 5, b = i / 5 % 5, c = i / 25;
    const std::int64_t here =
        std::int64_t{aligned.factor} * aligned.slope[a] * aligned.smooth[b] * aligned.smooth[c]
        << (32 - aligned.shift);
    const std::int64_t there = std::int64_t{stored.slope[a]} * stored.smooth[b] * stored.smooth[c]
                               << (32 - stored.shift);
    if (here != there) return false;
  }
  return true;
}
static_assert(are_taps_of(kExactFarid, GradientKernel::farid));
static_assert(are_taps_of(kExactSobel5, GradientKernel::sobel5));
static_assert(are_taps_of(kExactCentral, GradientKernel::central));

struct Extent {
  ToolOffset low{}, high{};
};

Extent extent_of(std::span<const ToolOffset> offsets) {
  Extent extent{offsets.front(), offsets.front()};
  for (const ToolOffset& offset : offsets) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      extent.low[axis] = std::min(extent.low[axis], offset[axis]);
      extent.high[axis] = std::max(extent.high[axis], offset[axis]);
    }
  }
  return extent;
}

using Table = std::vector<std::int32_t>;

/// out[i + k stride] += taps[k] in[i]: the convolution along one axis.
Table convolved(const Table& in, std::size_t stride, const std::int32_t (&taps)[5]) {
  Table out(in.size());
  for (std::size_t i = 0; i + 4 * stride < in.size(); ++i) {
    if (in[i] == 0) continue;
    for (std::size_t k = 0; k < 5; ++k) out[i + k * stride] += taps[k] * in[i];
  }
  return out;
}

/// Runs of `lanes` entries that cover all nonzero entries of the tables.
std::vector<AlignedChunk> cover(std::span<const Table> tables, std::size_t lanes) {
  std::vector<AlignedChunk> chunks;
  const std::size_t size = tables.front().size();
  for (std::size_t at = 0; at < size;) {
    const bool empty =
        std::all_of(tables.begin(), tables.end(), [&](const Table& t) { return t[at] == 0; });
    if (!empty) chunks.push_back({static_cast<std::int32_t>(at), 0});
    at += empty ? 1 : lanes;
  }
  return chunks;
}

/// Largest table that fuses the axes, bytes: it must leave the second-level cache to the box.
constexpr std::size_t kMaxFusedBytes = std::size_t{512} * 1024;

}  // namespace

bool can_align(std::span<const ToolOffset> offsets) {
  if (offsets.empty()) return false;
  const Extent extent = extent_of(offsets);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (extent.high[axis] - extent.low[axis] > 2 * (kMaxAlignedEdge - 1)) return false;
  }
  for (const ToolOffset& offset : offsets) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if ((offset[axis] - extent.low[axis]) % 2 != 0) return false;
    }
  }
  return std::set<ToolOffset>(offsets.begin(), offsets.end()).size() == offsets.size();
}

const ExactTaps& exact_taps(GradientKernel kernel) {
  switch (kernel) {
    case GradientKernel::sobel5:
      return kExactSobel5;
    case GradientKernel::central:
      return kExactCentral;
    case GradientKernel::farid:
      break;
  }
  return kExactFarid;
}

AlignedTool::AlignedTool(std::span<const ToolOffset> offsets, const ExactTaps& taps,
                         const KernelSet& kernels) {
  const Extent extent = extent_of(offsets);
  const auto length = [&](std::size_t axis) {
    return (extent.high[axis] - extent.low[axis]) / 2 + 1;
  };
  static_cast<TickBox&>(table_) = tick_box({length(0), length(1), length(2)}, taps, offsets.size());
  table_.low = extent.low;
  table_.lanes = kernels.lanes;

  const VoxelGrid box{table_.box.x, table_.box.y, table_.box.z};
  std::vector<VoxelIndex> voxels;
  Table mask(box.voxel_count() + static_cast<std::size_t>(kernels.lanes));
  for (const ToolOffset& offset : offsets) {
    voxels.push_back({(offset[0] - extent.low[0]) / 2, (offset[1] - extent.low[1]) / 2,
                      (offset[2] - extent.low[2]) / 2});
    mask[box.index(voxels.back().x, voxels.back().y, voxels.back().z)] = 1;
  }
  keep_mask(voxels);

  const auto pitch = static_cast<std::size_t>(table_.box.x);
  const std::size_t plane = pitch * static_cast<std::size_t>(table_.box.y);
  std::array<Table, 3> tables;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto along = [&](std::size_t a) -> const auto& {
      return a == axis ? taps.slope : taps.smooth;
    };
    tables[axis] =
        convolved(convolved(convolved(mask, 1, along(0)), pitch, along(1)), plane, along(2));
  }
  choose_chunks(tables, kernels);
  keep_runs(tables);
}

/// Tool voxels as bits, each row at both positions of the cell's corners.
void AlignedTool::keep_mask(std::span<const VoxelIndex> voxels) {
  const auto words = static_cast<std::size_t>(table_.row_lanes) / 32;
  const auto rows = static_cast<std::size_t>(table_.size.y) + 2;
  mask_.resize(rows * (static_cast<std::size_t>(table_.size.z) + 2) * 2 * words);
  for (const VoxelIndex& v : voxels) {
    const std::size_t row =
        (static_cast<std::size_t>(v.z) + 1) * rows + static_cast<std::size_t>(v.y) + 1;
    for (std::size_t moved = 0; moved < 2; ++moved) {
      const std::size_t lane = static_cast<std::size_t>(v.x) + 2 + moved;
      mask_[(2 * row + moved) * words + lane / 32] |= std::uint32_t{1} << (lane % 32);
    }
  }
  table_.mask = mask_.data();
}

/// One list for each axis, or one for all three.
///
/// Fused, a density is loaded once for three axes; that is faster while the joined list is little
/// longer than the three (a cube's slopes lie on different faces).
void AlignedTool::choose_chunks(std::span<const Table> tables, const KernelSet& kernels) {
  const auto lanes = static_cast<std::size_t>(kernels.lanes);
  std::size_t apart = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    chunks_[axis] = cover(tables.subspan(axis, 1), lanes);
    apart += chunks_[axis].size();
  }
  std::vector<AlignedChunk> joined = cover(tables, lanes);
  table_.fused = kernels.can_fuse && 30 * joined.size() <= 11 * apart &&
                 joined.size() * 6 * lanes * sizeof(std::int16_t) <= kMaxFusedBytes;
  if (table_.fused) chunks_ = {std::move(joined), {}, {}};
}

/// Each chunk's run of table entries as low and high halves; equal runs are kept once.
void AlignedTool::keep_runs(std::span<const Table> tables) {
  std::int32_t largest = 1;  // of all halves
  std::vector<std::int16_t> stored;
  std::map<std::vector<std::int16_t>, std::int32_t> known;
  const std::size_t axes = table_.fused ? 3 : 1;
  for (std::size_t list = 0; list < 3; ++list) {
    for (AlignedChunk& chunk : chunks_[list]) {
      std::vector<std::int16_t> run;
      const auto from = static_cast<std::size_t>(chunk.box_at);
      for (std::size_t axis = list; axis < list + axes; ++axis) {
        std::vector<std::int16_t> high;
        for (std::size_t at = from; at < from + static_cast<std::size_t>(table_.lanes); ++at) {
          const std::int32_t entry = at < tables[axis].size() ? tables[axis][at] : 0;
          const std::int32_t up = (entry + 256) >> 9;
          const std::int32_t rest = entry - 512 * up;
          largest = std::max({largest, std::abs(up), std::abs(rest)});
          run.push_back(static_cast<std::int16_t>(rest));
          high.push_back(static_cast<std::int16_t>(up));
        }
        run.insert(run.end(), high.begin(), high.end());
      }
      const auto [place, is_new] = known.try_emplace(run, static_cast<std::int32_t>(stored.size()));
      chunk.vector = place->second;
      if (is_new) stored.insert(stored.end(), run.begin(), run.end());
    }
    table_.chunks[list] = chunks_[list].data();
    table_.chunk_count[list] = static_cast<std::int32_t>(chunks_[list].size());
  }
  vectors_.resize((stored.size() + 31) / 32);
  for (std::size_t i = 0; i < stored.size(); ++i) vectors_[i / 32].entry[i % 32] = stored[i];
  table_.vectors = vectors_.front().entry.data();
  // Each chunk adds two products of a half and a density of at most 2^15 to a 32-bit sum.
  table_.flush = std::numeric_limits<std::int32_t>::max() / (2 * largest * 32768);
}

std::size_t AlignedTool::bytes() const noexcept {
  std::size_t chunks = 0;
  for (const auto& list : chunks_) chunks += list.size();
  return chunks * sizeof(AlignedChunk) + vectors_.size() * sizeof(CacheLine) +
         mask_.size() * sizeof(mask_[0]);
}

}  // namespace kerf
