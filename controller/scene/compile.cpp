// SPDX-License-Identifier: Apache-2.0
#include "controller/scene/compile.hpp"

#include <cstddef>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "controller/kernel/aligned_kernels.hpp"
#include "controller/scene/aligned_tool.hpp"
#include "controller/scene/plan_choice.hpp"
#include "controller/scene/plan_device.hpp"
#include "controller/scene/plan_tools.hpp"
#include "controller/scene/plan_volumes.hpp"
#include "controller/scene/servo_memory.hpp"
#include "controller/servo/servo_step.hpp"

namespace kerf {
namespace {

template <class N>
class CompiledScene final : public Servo {
 public:
  explicit CompiledScene(Scene& scene) : memory_(scene.cut.model != CutModel::none) {
    plan_device(scene.device, plan_);
    plan_limits(scene, plan_);
    plan_.kernel = scene.servo.kernel;
    plan_.aligned_kernels = *aligned_kernels();
    plan_.cutting = scene.cut.model != CutModel::none;
    plan_.removal_rate = removal_rate<N>(scene.cut.rate_per_s / scene.servo.rate_hz,
                                         scene.cut.model == CutModel::overlap_exact);
    plan_volumes(scene, plan_);
    plan_tools(scene);
    for (const SceneVolume& volume : scene.volumes) grids_.push_back(volume.image.grid);
    memory_.take(scene, plan_, state_);
  }

  ServoOutput step(const DeviceReport& report) noexcept override {
    return servo_step(plan_, state_, report);
  }
  void apply(const ServoCommand& command) noexcept override {
    apply_command(plan_, state_, command);
  }
  [[nodiscard]] double penetration_mm() const noexcept override {
    return kerf::penetration_mm(plan_, state_);
  }
  [[nodiscard]] VoxelGrid grid(std::size_t scene_index) const noexcept override {
    return grids_[scene_index];
  }
  [[nodiscard]] std::span<const Density> density(std::size_t scene_index) const noexcept override {
    return memory_.density(scene_index);
  }

 private:
  void plan_tools(Scene& scene) {
    plan_.tool_count = scene.tools.size();
    for (std::size_t t = 0; t < scene.tools.size(); ++t) {
      SceneTool& tool = scene.tools[t];
      plan_.tools[t].round = tool.round;
      const AlignedTable* table = nullptr;  // made once, where some volume can use it
      for (std::size_t v = 0; v < plan_.volume_count; ++v) {
        const SceneVolume& volume = scene.volumes[plan_.volumes[v].scene_index];
        const PlanChoice choice = choose_plan(scene, tool, volume);
        const bool aligned = choice.plan == Plan::aligned;
        if (aligned && table == nullptr) table = &add_table(scene, tool);
        plan_.tools[t].in_volume[v] = plan_tool<N>(scene, tool, volume, aligned ? table : nullptr);
        memory_.hold(tool, volume, v, choice.plan, table);
      }
      offsets_.push_back(std::move(tool.offsets));
      plan_.tools[t].offsets = offsets_.back();
    }
    state_.active_tool = static_cast<std::uint32_t>(scene.active_tool);
  }

  const AlignedTable& add_table(const Scene& scene, const SceneTool& tool) {
    tables_.push_back(std::make_unique<AlignedTool>(tool.offsets, *aligned_taps(scene.servo.kernel),
                                                    *plan_.aligned_kernels));
    return tables_.back()->table();
  }

  ServoPlan<N> plan_;
  ServoState<N> state_;
  std::vector<VoxelGrid> grids_;  ///< by volume of the scene
  std::vector<std::vector<ToolOffset>> offsets_;
  std::vector<std::unique_ptr<AlignedTool>> tables_;
  ServoMemory<N> memory_;
};

}  // namespace

std::unique_ptr<Servo> compile(Scene& scene) {
  switch (scene.servo.numeric) {
    case NumericKind::fixed:
      return std::make_unique<CompiledScene<FixedNumbers>>(scene);
    case NumericKind::float32:
      return std::make_unique<CompiledScene<FloatNumbers>>(scene);
    case NumericKind::float64:
      break;
  }
  return std::make_unique<CompiledScene<DoubleNumbers>>(scene);
}

}  // namespace kerf
