// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "controller/kernel/kernel_set.hpp"
#include "controller/kernel/overlap.hpp"
#include "controller/plan/method/tool_method.hpp"

namespace kerf {
namespace {

//                      avx512   avx2  neon  scalar
constexpr UnitCosts kPlace{0.06, 0.08, 0.5, 0.5};
constexpr UnitCosts kCopy{0.08, 0.08, 0.2, 1.1};
constexpr UnitCosts kSplat{0.3, 0.3, 0.6, 0.75};
constexpr UnitCosts kPress{0.16, 0.2, 0.6, 1.5};
constexpr UnitCosts kCover{0.11, 0.13, 0.3, 0.57};
constexpr UnitCosts kBend{1.1, 1.1, 2.2, 1.1};
constexpr UnitCosts kCut{0.11, 0.25, 0.4, 1.5};

/// Any tool in fixed point that cuts: every sample's weights are added up in the volume.
class SplatMethod final : public ToolMethod {
 public:
  constexpr SplatMethod() noexcept : ToolMethod(Method::splat, "splat", kAdviceToAlign) {}

  [[nodiscard]] std::optional<std::string> serves(const ToolCase& in) const override {
    if (in.scene.servo.numeric != NumericKind::fixed) return std::nullopt;
    if (in.scene.cut.model == CutModel::none) return std::nullopt;
    check_reach(in);
    check_splat(in);
    return why_not_aligned(in);
  }

  const AlignedTable* hold(const ToolCase& in, std::size_t v, MethodMemory& memory) const override {
    std::array<std::size_t, 3> width{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      width[axis] =
          overlap_width(in.tool.size_vox, in.tool.pitch_mm, in.volume.image.spacing_mm[axis]);
    }
    memory.scratch.hold(width, in.tool.offsets.size());
    if (in.scene.cut.model != CutModel::preston) {
      memory.need(memory.lengths.carry[v], splat_lanes(width[0]));
    }
    memory.hold_samples(in.tool, SampleOrder::scattered);
    return nullptr;
  }

  [[nodiscard]] SumUnits sums(const LoadedScene& scene, std::size_t samples) const override {
    const SumUnit exact = exact_sum(exact_taps(scene.servo.kernel), samples);
    return {exact, exact};
  }

  /// place  multiply-adds of the samples' places, 9 a sample
  /// copy   voxels of the box around the tool
  /// splat  corners of the samples' cells: 8 a sample
  /// press  of all rows: 3 an entry, which is split, and 5 more, filtered. Rows are whole vectors
  ///        of 32, and all count as touched by the tool
  /// bend   look-ups of `overlap_exact`: voxels of the rows
  /// cut    entries of the rows
  /// cover  instead of the last three if force cuts: entries, which are scaled
  /// Voxels outside of the volume count as air.
  [[nodiscard]] std::vector<StageCost> stages(const TickShape& shape,
                                              VoxelIndex size) const override {
    constexpr std::uint64_t kSplit = 3, kFilter = 5;
    const TickBox box = tick_box(size, kExactFarid, shape.samples);
    const std::uint64_t entries = count(box.row_lanes) * rows_of(size);
    std::vector<StageCost> stages;
    const auto add = [&](const char* stage, std::uint64_t operations, const UnitCosts& prices) {
      stages.push_back(priced(stage, operations, prices, shape.runs_it));
    };
    add("place", kPlaceOperations * shape.samples, kPlace);
    add("copy", voxels_of(box.box), kCopy);
    add("splat", kCellCorners * shape.samples, kSplat);
    if (shape.cut == CutModel::preston) {
      add("cover", entries, kCover);
      return stages;
    }
    add("press", (kSplit + kFilter) * entries, kPress);
    if (shape.cut == CutModel::overlap_exact) {
      add("bend", (count(size.x) + 1) * rows_of(size), kBend);
    }
    add("cut", entries, kCut);
    return stages;
  }
};

}  // namespace

const ToolMethod& splat_method() noexcept {
  static constexpr SplatMethod kMethod;
  return kMethod;
}

}  // namespace kerf
