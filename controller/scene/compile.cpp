// SPDX-License-Identifier: Apache-2.0
#include "controller/scene/compile.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "controller/scene/aligned_tool.hpp"
#include "controller/scene/scene_error.hpp"
#include "controller/scene/scene_place.hpp"
#include "controller/servo/servo_step.hpp"

namespace kerf {
namespace {

using Matrix = std::array<std::array<double, 3>, 3>;

Matrix matrix_of(const std::array<double, 4>& quaternion) {
  const Matrix3 m = rotation_of(quaternion);
  return {{{m[0], m[1], m[2]}, {m[3], m[4], m[5]}, {m[6], m[7], m[8]}}};
}

/// row_scale * transpose(rotation): world to the volume's axes.
Matrix into_volume(const Matrix& rotation, const std::array<double, 3>& row_scale) {
  Matrix m{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) m[i][j] = row_scale[i] * rotation[j][i];
  }
  return m;
}

template <class S, class To, class From>
Transform<S, To, From> rounded(const Matrix& m) {
  Transform<S, To, From> t;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) t.row[i][j] = S(m[i][j]);
  }
  return t;
}

template <class V, class S>
V rounded(const std::array<double, 3>& v) {
  return {S(v[0]), S(v[1]), S(v[2])};
}

template <class N>
typename N::Step step_of(double voxels) {
  if constexpr (N::kIsFixed) {
    return static_cast<std::int32_t>(std::lround(voxels * N::kStepOne));
  } else {
    return static_cast<typename N::Step>(voxels);
  }
}

/// What an exact integer sum holds.
struct SumUnit {
  double steps;    ///< density steps per voxel edge in one unit
  double largest;  ///< bound of the sum, in units
};

/// Sums of stored gradients times weights of 2^15; `terms` bounds the number of full weights.
SumUnit gathered_sum(double terms) {
  return {std::ldexp(1.0, -15), std::ldexp(std::max(terms, 1.0), 30)};
}

/// Contact sums of the plan `aligned` have 8 kept bits, its modification sums exact gradients.
SumUnit aligned_contact_unit(double samples) {
  return {std::ldexp(1.0, -kAlignedKeptBits),
          std::ldexp(std::max(samples, 1.0), 15 + kAlignedKeptBits)};
}
SumUnit aligned_modification_unit(const AlignedTaps& taps, double samples) {
  return {std::ldexp(taps.factor, -taps.shift - 15),
          std::ldexp(samples * static_cast<double>(kMaxExactGradient), 15)};
}

/// Smallest n with 2^n >= x; exact, unlike a logarithm, whose last bit differs between machines.
int bits_of(double x) {
  const int floor = std::ilogb(x);
  return std::ldexp(1.0, floor) < x ? floor + 1 : floor;
}

/// Newtons per unit of an exact sum, as the loop's numbers hold it.
template <class N>
SumToForce<N> sum_to_force(const Matrix& newtons_per_step, const SumUnit& sum) {
  SumToForce<N> map;
  if constexpr (N::kIsFixed) {
    // 38 bits of the largest sum are kept.
    map.pre_shift = std::max(0, bits_of(sum.largest) - 38);
    double largest = 0;
    for (const auto& row : newtons_per_step) {
      for (const double value : row) largest = std::max(largest, std::abs(value));
    }
    // The kept sum times `scaled` is the force in steps of 2^-16 N.
    const double unit = std::ldexp(sum.steps, map.pre_shift + 16);
    constexpr double kMantissaMax = 4194303;  // 22 bits
    constexpr int kMaxShift = 61;
    map.post_shift =
        largest == 0 ? 0 : std::clamp(std::ilogb(kMantissaMax / (largest * unit)), 0, kMaxShift);
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) {
        map.mantissa[i][j] = static_cast<std::int32_t>(
            std::clamp(std::round(std::ldexp(newtons_per_step[i][j] * unit, map.post_shift)),
                       -kMantissaMax, kMantissaMax));
      }
    }
  } else {
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) {
        map.row[i][j] = static_cast<typename N::Real>(newtons_per_step[i][j]);
      }
    }
  }
  return map;
}

template <class N>
class CompiledScene final : public Servo {
 public:
  CompiledScene(Scene& scene, const AlignedKernels& kernels) {
    plan_device(scene);
    plan_limits(scene);
    plan_.kernel = scene.servo.kernel;
    plan_.aligned_kernels = &kernels;
    plan_.cutting = scene.cut.model != CutModel::none;
    plan_.removal_rate = removal_rate<N>(scene.cut.rate_per_s / scene.servo.rate_hz,
                                         scene.cut.model == CutModel::overlap_exact);
    plan_volumes(scene);
    plan_tools(scene);
    reserve_memory(scene);
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
    return densities_[scene_index];
  }

 private:
  using Real = typename N::Real;

  void plan_device(const Scene& scene) {
    using Angle = typename N::Angle;
    const auto& device = scene.device;
    plan_.dock = {Angle(device.dock_rad[0]), Angle(device.dock_rad[1]), Angle(device.dock_rad[2])};
    plan_.workspace_scale = Real(device.workspace_scale);
    plan_.offset_mm = rounded<WorldVec<Real>, Real>(device.offset_mm);
    plan_.motors_configured = device.torque_scale.has_value();
    if (device.torque_scale) {
      for (std::size_t i = 0; i < 3; ++i) {
        plan_.counts_per_n_mm[i] = Real(1.0 / (*device.torque_scale)[i]);
      }
    }
  }

  void plan_limits(const Scene& scene) {
    // Of a small motor's winding: order of ten seconds (Maxon RE25: 12 s).
    constexpr double kThermalTimeS = 10.0;
    const double rate_hz = scene.servo.rate_hz;
    const auto ticks = [&](double ms) {
      return std::max(1U, static_cast<std::uint32_t>(ms * rate_hz / 1000.0));
    };
    plan_.rate_hz = scene.servo.rate_hz;
    constexpr double kStep = 1.0 / 65536;  // the limit is rounded down, not to nearest
    plan_.limits.peak_n = Real(scene.limits.force_n - kStep);
    plan_.limits.continuous_n =
        Real(std::min(scene.limits.continuous_force_n, scene.limits.force_n));
    plan_.limits.slew_n_per_tick = Real(scene.limits.slew_n_per_ms * 1000.0 / rate_hz);
    plan_.limits.thermal_per_tick = typename N::Ratio(1.0 / (rate_hz * kThermalTimeS));
    plan_.speed_limit_mm_per_tick = Real(scene.limits.speed_mm_per_s / rate_hz);
    plan_.timing = {.hold_ticks = ticks(5),
                    .zero_ticks = ticks(20),
                    // Below 500 Hz a tick is longer than the 2 ms: the first bad one trips.
                    .not_finite_ticks = static_cast<std::uint32_t>(2 * rate_hz / 1000),
                    .fade_in_ticks = ticks(100),
                    .dock_ticks = ticks(50)};
  }

  void plan_volumes(const Scene& scene) {
    for (std::size_t i = 0; i < scene.volumes.size(); ++i) {
      const SceneVolume& volume = scene.volumes[i];
      if (!volume.solid) continue;
      const Matrix rotation = matrix_of(volume.pose.orientation);
      const auto& h = volume.image.spacing_mm;
      const double largest = std::max({h[0], h[1], h[2]});
      check_spacing(scene, volume);
      VolumePlan<N>& plan = plan_.volumes[plan_.volume_count++];
      plan.scene_index = i;
      plan.grid = volume.image.grid;
      plan.iso = volume.iso;
      plan.position_mm = rounded<WorldVec<Real>, Real>(volume.pose.position_mm);
      plan.voxel_from_world = rounded<typename N::Ratio, VoxelSpace, WorldSpace>(
          into_volume(rotation, {1 / h[0], 1 / h[1], 1 / h[2]}));
      plan.normal_from_world = rounded<typename N::Unit, VoxelSpace, WorldSpace>(
          into_volume(rotation, {h[0] / largest, h[1] / largest, h[2] / largest}));
      plan.largest_spacing_mm = Real(largest);
    }
    if (plan_.volume_count == 0) {
      throw SceneError(scene.path +
                       ": no [[volume]] is solid; set solid = true for the one to touch");
    }
  }

  /// Voxels per mm must fit the loop's number for it.
  static void check_spacing(const Scene& scene, const SceneVolume& volume) {
    constexpr double kSmallestMm = 0.008;  // Ratio ends at 128
    const auto& h = volume.image.spacing_mm;
    const double smallest = std::min({h[0], h[1], h[2]});
    if (!N::kIsFixed || smallest >= kSmallestMm) return;
    throw SceneError(scene.path + ": volume " + volume.name + ": spacing_mm " +
                     std::to_string(smallest) +
                     " is below the 0.008 of fixed-point numbers; resample it, or set "
                     "servo.numeric = \"double\"");
  }

  void plan_tools(Scene& scene) {
    plan_.tool_count = scene.tools.size();
    for (std::size_t t = 0; t < scene.tools.size(); ++t) {
      SceneTool& tool = scene.tools[t];
      offsets_.push_back(std::move(tool.offsets));
      plan_.tools[t].offsets = offsets_.back();
      plan_.tools[t].round = tool.round;
      const AlignedTable* const table = aligned_table(scene, tool, offsets_.back());
      for (std::size_t v = 0; v < plan_.volume_count; ++v) {
        plan_.tools[t].in_volume[v] =
            tool_in_volume(scene, tool, scene.volumes[plan_.volumes[v].scene_index],
                           static_cast<double>(offsets_.back().size()), table);
      }
    }
    state_.active_tool = static_cast<std::uint32_t>(scene.active_tool);
  }

  /// The tool's table for the plan `aligned`, made once where some volume can use it; else nullptr.
  const AlignedTable* aligned_table(const Scene& scene, const SceneTool& tool,
                                    std::span<const ToolOffset> offsets) {
    const AlignedTaps* const taps = aligned_taps(scene.servo.kernel);
    const bool possible = N::kIsFixed && tool.round && taps != nullptr &&
                          (!plan_.cutting || offsets.size() <= kMaxAlignedCutSamples) &&
                          std::any_of(scene.volumes.begin(), scene.volumes.end(),
                                      [&](const SceneVolume& volume) {
                                        return volume.solid && same_lattice(tool, volume);
                                      }) &&
                          can_align(offsets);
    if (!possible) return nullptr;
    aligned_.push_back(std::make_unique<AlignedTool>(offsets, *taps, *plan_.aligned_kernels));
    aligned_memory_.hold(aligned_.back()->table().size, plan_.cutting);
    return &aligned_.back()->table();
  }

  /// Tool pitch and voxel are the same to the loop's last bit.
  static bool same_lattice(const SceneTool& tool, const SceneVolume& volume) {
    const auto& h = volume.image.spacing_mm;
    return std::all_of(h.begin(), h.end(),
                       [&](double mm) { return step_of<N>(tool.pitch_mm / mm) == N::kStepOne; });
  }

  static ToolInVolume<N> tool_in_volume(const Scene& scene, const SceneTool& tool,
                                        const SceneVolume& volume, double samples,
                                        const AlignedTable* table) {
    const auto& h = volume.image.spacing_mm;
    const double a = tool.pitch_mm;
    const double voxel_mm3 = h[0] * h[1] * h[2];
    const Matrix rotation = matrix_of(volume.pose.orientation);
    ToolInVolume<N> in;
    in.voxel_from_pitch = rounded<typename N::Ratio, VoxelSpace, WorldSpace>(
        into_volume(rotation, {a / h[0], a / h[1], a / h[2]}));
    for (std::size_t i = 0; i < 3; ++i) in.unrotated_step[i][i] = step_of<N>(a / h[i]);
    in.overlap_ratio = step_of<N>(a * a * a / voxel_mm3);

    // World gradient per mm of density over its maximum: rotation * (1 / spacing) / 65535.
    const auto newtons = [&](double n_mm) {
      Matrix m{};
      for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) {
          m[i][j] = scene.device.workspace_scale * n_mm * rotation[i][j] / (h[j] * kDensityMax);
        }
      }
      return m;
    };
    if (table != nullptr && same_lattice(tool, volume)) in.aligned = table;
    in.contact = sum_to_force<N>(
        newtons(scene.force.p0_n_per_mm2 * a * a * a),
        in.aligned != nullptr ? aligned_contact_unit(samples) : gathered_sum(samples));
    // Each voxel counts at most once, and the tool touches at most eight voxels per sample.
    in.modification =
        sum_to_force<N>(newtons(scene.cut.p1_n_per_mm2 * voxel_mm3),
                        in.aligned != nullptr ? aligned_modification_unit(in.aligned->taps, samples)
                                              : gathered_sum(8 * samples));
    return in;
  }

  void reserve_memory(Scene& scene) {
    densities_.resize(scene.volumes.size());
    for (const SceneVolume& volume : scene.volumes) grids_.push_back(volume.image.grid);
    for (std::size_t i = 0; i < scene.volumes.size(); ++i) {
      densities_[i] = std::move(scene.volumes[i].image.density);
    }
    gradients_.resize(plan_.volume_count);
    carries_.resize(plan_.volume_count);
    std::size_t overlap_voxels = 0;
    for (std::size_t v = 0; v < plan_.volume_count; ++v) {
      const SceneVolume& volume = scene.volumes[plan_.volumes[v].scene_index];
      std::size_t lanes = 0;
      bool gathered = false;  // by any tool
      for (std::size_t t = 0; t < scene.tools.size(); ++t) {
        if (const AlignedTable* const table = plan_.tools[t].in_volume[v].aligned) {
          lanes = std::max(lanes, static_cast<std::size_t>(table->row_lanes));
          continue;
        }
        const SceneTool& tool = scene.tools[t];
        const auto& h = volume.image.spacing_mm;
        gathered = true;
        lanes = std::max(lanes, removal_lanes(overlap_width(tool.size_vox, tool.pitch_mm, h[0])));
        overlap_voxels =
            std::max(overlap_voxels, overlap_capacity(tool.size_vox, tool.pitch_mm, h));
      }
      auto& density = densities_[plan_.volumes[v].scene_index];
      if (plan_.cutting) carries_[v].resize(lanes);
      if (gathered) {
        gradients_[v].resize(volume.image.grid.voxel_count());
        refresh_gradients<N>(plan_.kernel, plan_.volumes[v].grid, density,
                             plan_.volumes[v].grid.box(), gradients_[v], gradient_scratch_);
      }
      state_.volumes[v] = {density, gradients_[v], carries_[v]};
    }
    if (plan_.cutting) overlap_.resize(overlap_voxels);
    state_.overlap.memory = overlap_;
    state_.gradient_scratch = &gradient_scratch_;
    state_.aligned_scratch = aligned_memory_.view();
  }

  ServoPlan<N> plan_;
  ServoState<N> state_;
  std::vector<std::vector<ToolOffset>> offsets_;
  std::vector<VoxelGrid> grids_;  ///< by volume of the scene, as the next
  std::vector<std::vector<Density>> densities_;
  std::vector<std::vector<Gradient<N>>> gradients_;
  std::vector<std::vector<RemovalCarry<N>>> carries_;
  std::vector<typename N::Weight> overlap_;
  GradientScratch gradient_scratch_;
  std::vector<std::unique_ptr<AlignedTool>> aligned_;
  AlignedMemory aligned_memory_;
};

}  // namespace

std::unique_ptr<Servo> compile(Scene& scene, const AlignedKernels& kernels) {
  switch (scene.servo.numeric) {
    case NumericKind::fixed:
      return std::make_unique<CompiledScene<FixedNumbers>>(scene, kernels);
    case NumericKind::float32:
      return std::make_unique<CompiledScene<FloatNumbers>>(scene, kernels);
    case NumericKind::float64:
      break;
  }
  return std::make_unique<CompiledScene<DoubleNumbers>>(scene, kernels);
}

}  // namespace kerf
