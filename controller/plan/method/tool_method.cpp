// SPDX-License-Identifier: Apache-2.0
#include "controller/plan/method/tool_method.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "controller/input/load_error.hpp"
#include "controller/kernel/kernel_set.hpp"
#include "controller/kernel/overlap.hpp"
#include "controller/plan/method/lattice.hpp"
#include "controller/plan/method/tool_bounds.hpp"
#include "controller/plan/tables/sample_tables.hpp"
#include "controller/scene/scene.hpp"

namespace kerf {
namespace {

double price_ns(const UnitCosts& prices, std::string_view runs_it) noexcept {
  if (runs_it == "avx512") return prices.avx512;
  if (runs_it == "avx2") return prices.avx2;
  // As wide as NEON. A run in a browser is in lock-step, without a budget that a price could spend.
  if (runs_it == "neon" || runs_it == "simd128") return prices.neon;
  if (runs_it == "scalar") return prices.scalar;
  return runs_it == "double" ? prices.float64 : 0;
}

}  // namespace

double work_us(const StageCost& stage) noexcept {
  return static_cast<double>(stage.operations) * stage.price_ns / 1000;
}

double work_us(const std::vector<StageCost>& stages) noexcept {
  double us = 0;
  for (const StageCost& stage : stages) us += work_us(stage);
  return us;
}

StageCost priced(const char* stage, std::uint64_t operations, const UnitCosts& prices,
                 std::string_view runs_it) {
  const double ns = price_ns(prices, runs_it);
  if (!(ns > 0)) {
    throw std::logic_error("no price for " + std::string(stage) + " by " + std::string(runs_it));
  }
  return {stage, operations, ns};
}

StageCost query_stage(std::uint64_t samples, std::string_view runs_it) {
  return priced("queries", samples, {2.4, 2.6, 9, 18, 18}, runs_it);
}

void add_force_stages(std::uint64_t covered, std::string_view runs_it,
                      std::vector<StageCost>& stages) {
  stages.push_back(priced("list", covered, {32, 42, 130, 80, 8}, runs_it));
  stages.push_back(priced("spend", covered, {9, 12, 65, 36, 4}, runs_it));
}

const AlignedTable& MethodMemory::hold_table(const SceneTool& tool, const AxisPermutation& turn,
                                             const KernelSet& kernels) {
  if (tables_.empty() || tables_.back().tool != &tool || turn_ != turn) {
    turn_ = turn;
    tables_.push_back(
        {&tool, tool.name,
         std::make_unique<AlignedTool>(turned(tool.offsets, turn), exact_taps(kernel_), kernels)});
  }
  return tables_.back().table->table();
}

void MethodMemory::hold_samples(const SceneTool& tool, SampleOrder order) {
  if (!samples_.empty() && samples_.back().tool == &tool) return;
  samples_.push_back({&tool, tool.name, SampleTool(tool.offsets, order)});
}

SampleTable MethodMemory::samples_of(const SceneTool& tool) const noexcept {
  if (samples_.empty() || samples_.back().tool != &tool) return {};
  return samples_.back().table.table();
}

std::vector<ArrayBytes> MethodMemory::arrays() const {
  std::vector<ArrayBytes> list;
  for (const auto& of : tables_) list.push_back({"table of " + of.name, of.table->bytes(), true});
  for (const auto& of : samples_) {
    list.push_back({"ordered samples of " + of.name, of.table.bytes(), true});
  }
  for (const ArrayBytes& array : scratch.arrays()) list.push_back(array);
  return list;
}

namespace {

void check(const ToolCase& in, double is, double most, const char* what, const char* way_out) {
  if (is <= most) return;
  throw LoadError(in.scene.path + ": tool " + in.tool.name + " in volume " + in.volume.name +
                  ": up to " + number_text(std::floor(is)) + what + ", and " + number_text(most) +
                  " are the end; " + way_out + ", or set servo.numeric = \"double\"");
}

}  // namespace

std::string why_not_aligned(const ToolCase& in) {
  if (in.scene.servo.numeric != NumericKind::fixed) {
    return std::string(word_of(in.scene.servo.numeric)) + " numbers";
  }
  if (!in.tool.round && in.tool.turns) return "it turns and is not round";
  if (!axis_permutation(in.tool, in.volume))
    return "its samples do not lie on the volume's lattice";
  if (!can_align(in.tool.offsets)) return "its samples are no lattice of at most 64 a side";
  return {};
}

void check_reach(const ToolCase& in) {
  double farthest_pitches = 0;
  for (const ToolOffset& offset : in.tool.offsets) {  // half pitches
    const double x = offset[0], y = offset[1], z = offset[2];
    farthest_pitches = std::max(farthest_pitches, std::sqrt(x * x + y * y + z * z) / 2);
  }
  double reach = 0;
  for (const double mm : in.volume.image.spacing_mm) {
    reach = std::max(reach, farthest_pitches * in.tool.pitch_mm / mm);
  }
  check(in, reach, kSampleReachVox, " voxels from the tool's centre",
        "use a smaller tool or one whose centre lies in its middle");
}

void check_splat(const ToolCase& in) {
  const auto& h = in.volume.image.spacing_mm;
  double per_voxel = 1;
  std::array<double, 3> width{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    // The cubes around the samples that a voxel reads lie within its hat, widened by half their
    // diagonal to each side: in any pose its weights add up to no more than that hat's volume.
    per_voxel *= h[axis] / in.tool.pitch_mm + std::numbers::sqrt3;
    width[axis] = static_cast<double>(overlap_width(in.tool.size_vox, in.tool.pitch_mm, h[axis]));
  }
  const bool fine = in.tool.pitch_mm < 0.99 * std::min({h[0], h[1], h[2]});
  check(in, per_voxel, kMaxSplatDensity, " samples in one voxel",
        fine ? "give the tool a larger pitch_mm" : "resample the volume to finer voxels");
  check(in, width[0] * width[1], kMaxPlaneVoxels, " voxels of a plane under the tool",
        "use a smaller tool");
}

namespace {

/// For the swept proxy without cutting: a tick has only its queries. For a force of a program it
/// has none.
class SurfaceMethod final : public ToolMethod {
 public:
  constexpr SurfaceMethod() noexcept : ToolMethod(Method::surface, "surface", "") {}

  [[nodiscard]] std::optional<std::string> serves(const ToolCase& in) const override {
    if (in.scene.force.model == ForceModel::paper) return std::nullopt;
    if (in.scene.cut.model != CutModel::none) return std::nullopt;
    if (in.scene.force.model == ForceModel::external) return "a program gives the force";
    return "only its surface has contact, and nothing is cut";
  }
};

#define KERF_METHOD(name, Step, serves) name##_method,
constexpr std::array kMethods{KERF_METHODS(KERF_METHOD)};
#undef KERF_METHOD

}  // namespace

const ToolMethod& surface_method() noexcept {
  static constexpr SurfaceMethod kMethod;
  return kMethod;
}

MethodChoice choose_method(const ToolCase& in) {
  for (const auto& method : kMethods) {
    if (std::optional<std::string> why = method().serves(in)) return {&method(), *std::move(why)};
  }
  throw std::logic_error("no method serves " + in.tool.name);
}

TickShape tick_shape(const ToolCase& in, const AlignedTable* table) {
  const NumericKind numeric = in.scene.servo.numeric;
  return {.samples = in.tool.offsets.size(),
          .grid = in.volume.image.grid,
          .cut = in.scene.cut.model,
          .swept = in.scene.force.model == ForceModel::proxy,
          .runs_it = numeric == NumericKind::fixed ? in.kernels.name : word_of(numeric),
          .table = table};
}

std::size_t max_cover_entries(const ToolCase& in, const AlignedTable* table) {
  if (in.scene.servo.numeric != NumericKind::fixed) return max_covered_voxels(in.tool, in.volume);
  const std::size_t groups = max_cover_groups(in.tool, in.volume);
  return table == nullptr ? groups : std::min(groups, max_cover_groups(*table));
}

std::vector<StageCost> tick_stages(const ToolMethod& method, const TickShape& shape, VoxelIndex box,
                                   std::uint64_t queried, std::uint64_t covered) {
  std::vector<StageCost> stages = method.stages(shape, box);
  if (shape.swept) stages.insert(stages.begin(), query_stage(queried, shape.runs_it));
  if (shape.cut == CutModel::preston) add_force_stages(covered, shape.runs_it, stages);
  return stages;
}

std::vector<StageCost> most_stages(const ToolMethod& method, const TickShape& shape,
                                   const ToolCase& in, std::uint64_t queried) {
  const std::size_t covered =
      shape.cut == CutModel::preston ? max_cover_entries(in, shape.table) : 0;
  std::vector<StageCost> most;
  for (const VoxelIndex& box : box_sizes(in.tool, in.volume)) {
    std::vector<StageCost> stages = tick_stages(method, shape, box, queried, covered);
    if (most.empty()) {
      most = std::move(stages);
      continue;
    }
    for (std::size_t s = 0; s < stages.size(); ++s) {
      most[s].operations = std::max(most[s].operations, stages[s].operations);
    }
  }
  return most;
}

}  // namespace kerf
