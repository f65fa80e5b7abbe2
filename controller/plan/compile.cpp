// SPDX-License-Identifier: Apache-2.0
#include "controller/plan/compile.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <span>
#include <string_view>
#include <variant>
#include <vector>

#include "controller/input/load_error.hpp"
#include "controller/kernel/proxy/contact_query.hpp"
#include "controller/plan/air_speed.hpp"
#include "controller/plan/method/tool_method.hpp"
#include "controller/plan/plan_contact.hpp"
#include "controller/plan/plan_device.hpp"
#include "controller/plan/plan_tools.hpp"
#include "controller/plan/servo_memory.hpp"
#include "controller/plan/tables/sample_tables.hpp"
#include "controller/plan/worst_tick.hpp"
#include "controller/servo/servo_step.hpp"

namespace kerf {
namespace {

/// Ticks of the pause that ends a stroke. A quarter of a second without contact: a bur that the
/// hand's tremor lifts is back within a period of it, an eighth of a second at 8 Hz; to lift it on
/// purpose and set it down elsewhere takes longer. With a pedal, 1/32 s: contacts of a switch
/// bounce for at most 20 ms, and no finger presses again so soon.
std::uint32_t stroke_pause_ticks(std::int32_t rate_hz, bool pedalled) {
  const int per_s = pedalled ? 32 : 4;
  return static_cast<std::uint32_t>(std::max(1, rate_hz / per_s));
}

template <class N>
class CompiledSceneOf final : public CompiledScene {
 public:
  CompiledSceneOf(const LoadedScene& scene, const KernelSet& kernels) : memory_(scene) {
    plan_device(scene.device, plan_);
    plan_limits(scene, plan_);
    plan_laws(scene, plan_);
    plan_.gradient_kernel = scene.servo.kernel;
    plan_.taps = &exact_taps(scene.servo.kernel);
    plan_.kernels = &kernels;
    plan_.overlap_cuts =
        scene.cut.model == CutModel::overlap || scene.cut.model == CutModel::overlap_exact;
    plan_.removal_rate = removal_rate<N>(scene.cut.rate_per_s / scene.servo.rate_hz,
                                         scene.cut.model == CutModel::overlap_exact);
    plan_.pedalled = scene.cut.pedal == CutPedal::button;
    plan_.stroke_pause_ticks = stroke_pause_ticks(scene.servo.rate_hz, plan_.pedalled);
    plan_volumes(scene, plan_);
    plan_contact(scene, plan_);
    plan_.external = plan_external<N>(scene);
    plan_.force_cut = plan_force_cut(scene, plan_);
    if (plan_.contact.swept) {
      for (std::size_t v = 0; v < plan_.volume_count; ++v) {
        memory_.contact().hold_volume(scene.volumes[plan_.volumes[v].scene_index]);
      }
    }
    for (const SceneTool& tool : scene.tools) plan_tool_everywhere(scene, tool);
    state_.active_tool = static_cast<std::uint32_t>(scene.active_tool);
    arms_.push_back({&plan_, &state_});
    if (scene.second) plan_second(scene);
    for (const SceneVolume& volume : scene.volumes) grids_.push_back(volume.image.grid);
    costs_.arrays = memory_.arrays();
  }

  void take(LoadedScene& scene) override {
    memory_.take(scene, plan_, state_);
    if (!second_) return;
    second_->plan.force_cut = plan_.force_cut;  // its labels lie in the memory
    memory_.share(state_, second_->state);
  }
  [[nodiscard]] const SceneCosts& costs() const noexcept override { return costs_; }
  [[nodiscard]] std::variant<Arms<FixedNumbers>, Arms<DoubleNumbers>> parts()
      const noexcept override {
    return Arms<N>(arms_);
  }
  [[nodiscard]] TickTime time_tick(std::size_t tick) override {
    const TickCost& cost = costs_.ticks[tick];
    const WorstTick worst =
        WorstCaseDriver<N>(plan_, state_, tick / plan_.volume_count, tick % plan_.volume_count)
            .time();
    return {worst.median_us, worst.p99_us,
            tick_stages(*cost.choice.method, cost.shape, worst.box, worst.queried, worst.covered)};
  }

  [[nodiscard]] std::unique_ptr<ServoSnapshot> keep() const override {
    return std::make_unique<SnapshotOf<N>>(memory_.keep(arms_));
  }
  void restore(const ServoSnapshot& kept) override {
    const auto* same = dynamic_cast<const SnapshotOf<N>*>(&kept);
    if (same == nullptr) refuse_snapshot();
    memory_.restore(*same, arms_);
  }

  [[nodiscard]] std::size_t arms() const noexcept override { return arms_.size(); }
  [[nodiscard]] DeviceReport::Kind report_kind(std::size_t arm) const noexcept override {
    return arms_[arm].plan->device.kinematics == Kinematics::axes ? DeviceReport::Kind::pose
                                                                  : DeviceReport::Kind::joints;
  }
  using AnyServo::step;
  void step(std::span<const DeviceReport> reports,
            std::span<ServoOutput> outputs) noexcept override {
    servo_step<N>(arms_, reports, outputs);
  }
  bool apply(const ServoCommand& command) noexcept override {
    return apply_command<N>(arms_, command);
  }
  [[nodiscard]] bool give_force(std::size_t arm, const ProgramForce& force) noexcept override {
    return kerf::give_force(*arms_[arm].plan, force, arms_[arm].state->external);
  }
  void repeat_force(std::size_t arm, const std::array<float, 3>& contact_n) noexcept override {
    if (plan_.external.on) kerf::repeat_force(contact_n, arms_[arm].state->external);
  }
  [[nodiscard]] double penetration_mm(std::size_t arm) const noexcept override {
    return kerf::penetration_mm(*arms_[arm].plan, *arms_[arm].state);
  }
  [[nodiscard]] VoxelGrid grid(std::size_t scene_index) const noexcept override {
    return grids_[scene_index];
  }
  [[nodiscard]] std::span<const Density> first_density(
      std::size_t scene_index) const noexcept override {
    for (std::size_t v = 0; v < plan_.volume_count; ++v) {
      if (plan_.volumes[v].scene_index == scene_index) return state_.volumes[v].first;
    }
    return {};
  }
  [[nodiscard]] std::span<const Density> density(std::size_t scene_index) const noexcept override {
    return memory_.density(scene_index);
  }

 private:
  void plan_tool_everywhere(const LoadedScene& scene, const SceneTool& tool) {
    ToolPlan<N>& plan = plan_.tools[plan_.tool_count++];
    plan.round = tool.round;
    plan.turns = tool.turns;
    plan.rim_mm = typename N::Real(tool.radius_mm);
    if (plan_.force_cut.on) plan.law = plan_law<N>(scene, tool);
    plan.steepness = bearing_steepness<N>(tool, plan_.contact);
    plan.offsets = memory_.hold_samples(tool);
    if (plan_.contact.swept) {
      plan.swept.point_shell = memory_.contact().hold_point_shell(scene, tool);
      plan.swept.shaft = memory_.contact().hold_shaft(scene, tool);
      plan_proxy(scene, tool, plan.swept);
      costs_.air_speeds_mm_per_s.push_back(
          air_speed_mm_per_s(scene, plan.swept, plan_.volume_count));
    }
    for (std::size_t v = 0; v < plan_.volume_count; ++v) {
      const std::size_t scene_index = plan_.volumes[v].scene_index;
      const ToolCase in{scene, tool, scene.volumes[scene_index], *plan_.kernels};
      if (plan_.force_cut.on) memory_.force_cut().hold(in, v);
      const MethodChoice choice = choose_method(in);
      const AlignedTable* table = choice.method->hold(in, v, memory_.methods());
      plan.in_volume[v] = plan_tool<N>(in, *choice.method, table);
      const TickShape shape = tick_shape(in, table);
      costs_.ticks.push_back({plan_.tool_count - 1, scene_index, choice, shape,
                              most_stages(*choice.method, shape, in, most_samples(plan.swept))});
    }
    plan.samples = memory_.methods().samples_of(tool);
  }

  /// The second arm has the plan of the first with a device of its own. Both hands have one scale,
  /// so that all tools and volumes are the same for both.
  void plan_second(const LoadedScene& scene) {
    const LoadedScene of_arm = second_arm_of(scene);
    second_ = std::make_unique<Second>();
    ServoPlan<N>& plan = second_->plan;
    plan = plan_;
    plan.device = {};
    plan_device(of_arm.device, plan);
    plan_limits(of_arm, plan);
    plan_laws(of_arm, plan);
    second_->state.active_tool = static_cast<std::uint32_t>(of_arm.active_tool);
    arms_.push_back({&plan, &second_->state});
    costs_.arms = 2;
  }

  /// Of one volume, rounded up.
  [[nodiscard]] std::uint64_t most_samples(const SweptTool<N>& tool) const {
    if (!plan_.contact.swept) return 0;
    const std::int64_t all = query_work(tool.point_shell, tool.shaft, plan_.volume_count).most();
    return (static_cast<std::uint64_t>(all) + plan_.volume_count - 1) / plan_.volume_count;
  }

  struct Second {
    ServoPlan<N> plan;
    ServoState<N> state;
  };

  ServoPlan<N> plan_;
  ServoState<N> state_;
  std::unique_ptr<Second> second_;  ///< of the second arm, if there is one
  std::vector<Arm<N>> arms_;        ///< their addresses
  std::vector<VoxelGrid> grids_;    ///< by volume of the scene
  ServoMemory<N> memory_;
  SceneCosts costs_;
};

}  // namespace

std::unique_ptr<CompiledScene> plan_scene(const LoadedScene& scene, const KernelSet& kernels) {
  if (scene.cut.model == CutModel::preston && scene.force.model != ForceModel::proxy) {
    throw LoadError(scene.path +
                    ": cut.model = \"preston\" needs the normal force of a proxy; set force.model "
                    "= \"proxy\", or cut.model = \"overlap\"");
  }
  if (scene.servo.numeric == NumericKind::fixed) {
    return std::make_unique<CompiledSceneOf<FixedNumbers>>(scene, kernels);
  }
  return std::make_unique<CompiledSceneOf<DoubleNumbers>>(scene, kernels);
}

std::unique_ptr<CompiledScene> compile(LoadedScene& scene, const KernelSet& kernels) {
  auto compiled = plan_scene(scene, kernels);
  compiled->take(scene);
  return compiled;
}

namespace {

std::string us_text(double us) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f", us);
  return text;
}

}  // namespace

double work_us(const SceneCosts& costs, std::size_t tool) {
  double us = 0;
  for (const TickCost& tick : costs.ticks) us += tick.tool == tool ? work_us(tick.stages) : 0;
  return static_cast<double>(costs.arms) * us;
}

double work_budget_us(const LoadedScene& scene) {
  return kBudgetRatio * 1e6 / scene.servo.rate_hz;
}

int highest_rate_hz(double work_us) {
  const double rate_hz = std::min(kBudgetRatio * 1e6 / work_us, double{kMaxRateHz});
  return rate_hz < kMinRateHz ? 0 : static_cast<int>(rate_hz);
}

std::size_t costliest_tool(const SceneCosts& costs) {
  const auto cheaper = [&](const TickCost& a, const TickCost& b) {
    return work_us(costs, a.tool) < work_us(costs, b.tool);
  };
  return std::max_element(costs.ticks.begin(), costs.ticks.end(), cheaper)->tool;
}

std::string budget_error(const LoadedScene& scene, const SceneCosts& costs) {
  const double budget_us = work_budget_us(scene);
  const std::size_t tool = costliest_tool(costs);
  const double sum_us = work_us(costs, tool);
  if (sum_us <= budget_us) return {};
  std::string parts, others, advice;
  const StageCost* most = nullptr;
  for (const TickCost& tick : costs.ticks) {
    if (tick.tool != tool) continue;
    parts += ", in " + scene.volumes[tick.volume].name + " " +
             us_text(static_cast<double>(costs.arms) * work_us(tick.stages)) + " by the method " +
             tick.variant() + " (" + tick.choice.why + ")";
    if (advice.empty()) advice = tick.choice.method->advice;
    for (const StageCost& stage : tick.stages) {
      if (most == nullptr || work_us(stage) > work_us(*most)) most = &stage;
    }
  }
  for (std::size_t t = 0; t < scene.tools.size(); ++t) {
    if (t == tool || work_us(costs, t) <= budget_us) continue;
    others += (others.empty() ? " (too dear as well: " : ", ") + scene.tools[t].name;
  }
  const int rate_hz = highest_rate_hz(sum_us);
  const bool fixed = scene.servo.numeric == NumericKind::fixed;
  if (!fixed) advice = "fixed numbers";
  if (fixed && std::string_view(most->stage) == "queries") advice.clear();
  const std::string third = advice.empty() ? "" : ", or " + advice;
  return scene.path + ": tool " + scene.tools[tool].name +
         (costs.arms > 1 ? " in both hands" : "") + ": up to " + us_text(sum_us) +
         " us of work a tick, most of it " + most->stage + " (" +
         us_text(static_cast<double>(costs.arms) * work_us(*most)) + ")" + parts + ", above the " +
         us_text(budget_us) + " us that are half a tick at " + std::to_string(scene.servo.rate_hz) +
         " Hz; use " + (rate_hz == 0 ? "" : "--rate " + std::to_string(rate_hz) + " or lower, ") +
         (rate_hz != 0 && third.empty() ? "or " : "") + "a smaller tool" + others +
         (others.empty() ? "" : ")") + third;
}

}  // namespace kerf
