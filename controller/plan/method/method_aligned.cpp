// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "controller/kernel/kernel_set.hpp"
#include "controller/plan/method/lattice.hpp"
#include "controller/plan/method/tool_method.hpp"

namespace kerf {
namespace {

//                      avx512   avx2  neon  scalar
constexpr UnitCosts kCopy{0.08, 0.08, 0.2, 1.1};
constexpr UnitCosts kContact{0.005, 0.012, 0.03, 0.06};
constexpr UnitCosts kMill{0.011, 0.021, 0.06, 0.27};
constexpr UnitCosts kCover{0.011, 0.025, 0.06, 0.35};
constexpr UnitCosts kBend{0.8, 0.8, 1.6, 0.8};

constexpr std::uint64_t kMasks = kCellCorners;  ///< of an entry of ratios

std::uint64_t correlation_operations(const AlignedTable& table) {
  constexpr std::uint64_t kHalves = 2;
  const std::uint64_t axes = table.fused ? 3 : 1;
  std::uint64_t chunks = 0;
  for (const std::int32_t of_list : table.chunk_count) chunks += count(of_list);
  return chunks * count(table.lanes) * axes * kHalves * kCellCorners;
}

std::uint64_t ratios_of(const AlignedTable& table) {
  return rows_of(table.size) * count(table.row_lanes);
}

std::uint64_t press_operations(const AlignedTable& table) {
  constexpr std::uint64_t kTapsX = 2 * 5, kTapsY = 3 * 5, kTapsZ = 2 * 5;
  constexpr std::uint64_t kProducts = 3;
  const std::uint64_t planes = count(table.size.z) + 1;
  const std::uint64_t filtered = planes * count(table.box.y) * count(table.row_lanes);
  return ratios_of(table) * (kMasks + kTapsX + kTapsY + kProducts) + filtered * kTapsZ;
}

/// A tool that is round or does not turn, on the volume's lattice: a correlation of the density
/// with one table. Volumes in which the tool has the same orientation share a table.
class AlignedMethod final : public ToolMethod {
 public:
  constexpr AlignedMethod() noexcept : ToolMethod(Method::aligned, "aligned", "") {}

  [[nodiscard]] std::optional<std::string> serves(const ToolCase& in) const override {
    if (!why_not_aligned(in).empty()) return std::nullopt;
    return in.tool.round ? "round, on the volume's lattice" : "unturned, on the lattice";
  }

  const AlignedTable* hold(const ToolCase& in, std::size_t v, MethodMemory& memory) const override {
    const AlignedTable& table =
        memory.hold_table(in.tool, axis_permutation(in.tool, in.volume).value(), in.kernels);
    const CutModel cut = in.scene.cut.model;
    memory.scratch.tick().hold(table.size, cut != CutModel::none);
    if (cut != CutModel::none && cut != CutModel::preston) {
      memory.need(memory.lengths.carry[v], static_cast<std::size_t>(table.row_lanes));
    }
    return &table;
  }

  /// Contact sums have 8 kept bits.
  [[nodiscard]] SumUnits sums(const LoadedScene& scene, std::size_t samples) const override {
    const double terms = std::max(static_cast<double>(samples), 1.0);
    return {{std::ldexp(1.0, -kAlignedKeptBits), std::ldexp(terms, 15 + kAlignedKeptBits)},
            exact_sum(exact_taps(scene.servo.kernel), samples)};
  }

  /// copy     voxels of the box around the tool
  /// contact  multiply-adds of the correlation: table entries x 2 halves x 8 corners, by chunks
  /// mill     multiply-adds of masks, filters and products, and removals; rows as whole vectors
  ///          of 32
  /// cover    instead of `mill` if force cuts: ratios of all rows, as whole vectors of 32:
  ///          multiply-adds of masks, 8 an entry
  /// bend     look-ups of `overlap_exact`: voxels that the tool covers
  /// Reached in every tick in which the box meets the volume; `mill` and `bend` if no row of it is
  /// air. The tool does not turn: the box is always the table's.
  [[nodiscard]] std::vector<StageCost> stages(const TickShape& shape, VoxelIndex) const override {
    const AlignedTable& table = *shape.table;
    std::vector<StageCost> stages;
    const auto add = [&](const char* stage, std::uint64_t operations, const UnitCosts& prices) {
      stages.push_back(priced(stage, operations, prices, shape.runs_it));
    };
    add("copy", voxels_of(table.box), kCopy);
    if (!shape.swept) add("contact", correlation_operations(table), kContact);
    if (shape.cut == CutModel::preston) add("cover", kMasks * ratios_of(table), kCover);
    if (shape.cut == CutModel::none || shape.cut == CutModel::preston) return stages;
    add("mill", press_operations(table) + ratios_of(table), kMill);
    if (shape.cut == CutModel::overlap_exact) {
      add("bend", (count(table.size.x) + 1) * rows_of(table.size), kBend);
    }
    return stages;
  }
};

}  // namespace

const ToolMethod& aligned_method() noexcept {
  static constexpr AlignedMethod kMethod;
  return kMethod;
}

}  // namespace kerf
