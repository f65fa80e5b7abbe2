// SPDX-License-Identifier: Apache-2.0
#include "controller/plan/method/methods.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <stdexcept>
#include <utility>

#include "controller/plan/method/covered_bound.hpp"
#include "controller/plan/method/turned_box.hpp"
#include "controller/scene/scene.hpp"

namespace kerf {
namespace {

#define KERF_METHOD(name, Step, serves) name##_method,
constexpr std::array kMethods{KERF_METHODS(KERF_METHOD)};
#undef KERF_METHOD

}  // namespace

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

std::size_t most_listed(const ToolCase& in, const AlignedTable* table) {
  if (table != nullptr) return most_groups(*table);
  const bool fixed = in.scene.servo.numeric == NumericKind::fixed;
  return fixed ? most_groups(in.tool, in.volume) : most_covered(in.tool, in.volume);
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
  const std::size_t covered = shape.cut == CutModel::preston ? most_listed(in, shape.table) : 0;
  std::vector<StageCost> most;
  for (const VoxelIndex& box : box_sizes(in.tool, in.volume)) {
    std::vector<StageCost> stages = tick_stages(method, shape, box, queried, covered);
    if (most.empty()) most = std::move(stages);
    for (std::size_t s = 0; s < stages.size(); ++s) {
      most[s].operations = std::max(most[s].operations, stages[s].operations);
    }
  }
  return most;
}

}  // namespace kerf
