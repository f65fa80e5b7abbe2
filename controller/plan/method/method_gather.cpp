// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "controller/kernel/kernel_set.hpp"
#include "controller/kernel/overlap.hpp"
#include "controller/plan/method/tool_method.hpp"

namespace kerf {
namespace {

//                        avx512 avx2 neon scalar double
constexpr UnitCosts kContact{0.2, 0.3, 1, 3, 2};
constexpr UnitCosts kOverlap{0, 0, 0, 0, 1.1};
constexpr UnitCosts kModification{0, 0, 0, 0, 0.5};
constexpr UnitCosts kRemoval{0, 0, 0, 0, 3};
constexpr UnitCosts kBentRemoval{0, 0, 0, 0, 4.3};
constexpr UnitCosts kRefresh{0, 0, 0, 0, 9};

/// Any tool: stored gradients, interpolated at every sample. Fixed point gathers only if the scene
/// does not cut; double always.
class GatherMethod final : public ToolMethod {
 public:
  constexpr GatherMethod() noexcept : ToolMethod(Method::gather, "gather", kAdviceToAlign) {}

  [[nodiscard]] std::optional<std::string> serves(const ToolCase& in) const override {
    if (in.scene.servo.numeric == NumericKind::fixed) check_reach(in);
    return why_not_aligned(in);
  }

  const AlignedTable* hold(const ToolCase& in, std::size_t v, MethodMemory& memory) const override {
    const auto& h = in.volume.image.spacing_mm;
    const SceneTool& tool = in.tool;
    const CutModel cut = in.scene.cut.model;
    if (in.scene.servo.numeric == NumericKind::fixed) {
      memory.hold_samples(tool, SampleOrder::as_given);
    }
    if (cut != CutModel::none) {
      memory.need(memory.lengths.overlap,
                  overlap_capacity(in.volume.image.grid, tool.size_vox, tool.pitch_mm, h));
    }
    if (cut == CutModel::preston) return nullptr;
    memory.need(memory.lengths.gradients[v], in.volume.image.grid.voxel_count() + kFieldPad);
    if (cut == CutModel::none) return nullptr;
    memory.need(memory.lengths.refresh, 1);
    memory.need(memory.lengths.carry[v],
                removal_lanes(overlap_width(tool.size_vox, tool.pitch_mm, h[0])));
    return nullptr;
  }

  /// Each voxel counts at most once, and the tool touches at most eight voxels per sample.
  [[nodiscard]] SumUnits sums(const LoadedScene&, std::size_t samples) const override {
    const auto terms = static_cast<double>(samples);
    return {gathered_sum(terms), gathered_sum(8 * terms)};
  }

  /// contact       corners of the samples' cells: 8 a sample
  /// overlap       multiply-adds of a sample's place (twice), its weights and its sums, 34 a
  ///               sample; and voxels of the box that the tool covers
  /// modification  voxels of that box
  /// removal       voxels of that box; `bent removal` with the look-ups of `overlap_exact`
  /// refresh       voxels of the box grown by the gradient's reach
  /// Outside of the volume only `overlap` reads one voxel at each end. If force cuts, `overlap` is
  /// the last stage.
  [[nodiscard]] std::vector<StageCost> stages(const TickShape& shape,
                                              VoxelIndex size) const override {
    constexpr std::uint64_t kSpread = 2 * kPlaceOperations + 2 * kCellCorners;
    const auto clipped = [&](std::int32_t more, std::int32_t beyond) {
      const VoxelGrid& grid = shape.grid;
      return voxels_of({std::min(size.x + more, grid.nx + beyond),
                        std::min(size.y + more, grid.ny + beyond),
                        std::min(size.z + more, grid.nz + beyond)});
    };
    std::vector<StageCost> stages;
    const auto add = [&](const char* stage, std::uint64_t operations, const UnitCosts& prices) {
      stages.push_back(priced(stage, operations, prices, shape.runs_it));
    };
    if (!shape.swept) add("contact", kCellCorners * shape.samples, kContact);
    if (shape.cut == CutModel::none) return stages;
    add("overlap", kSpread * shape.samples + clipped(1, 2), kOverlap);
    if (shape.cut == CutModel::preston) return stages;
    const std::uint64_t inside = clipped(1, 0);
    add("modification", inside, kModification);
    if (shape.cut == CutModel::overlap_exact) {
      add("bent removal", inside, kBentRemoval);
    } else {
      add("removal", inside, kRemoval);
    }
    add("refresh", clipped(kBoxMargin, 0), kRefresh);
    return stages;
  }
};

}  // namespace

const ToolMethod& gather_method() noexcept {
  static constexpr GatherMethod kMethod;
  return kMethod;
}

}  // namespace kerf
