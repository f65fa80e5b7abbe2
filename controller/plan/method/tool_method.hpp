// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "controller/kernel/gradient.hpp"
#include "controller/kernel/kernel_set.hpp"
#include "controller/load/loaded_scene.hpp"
#include "controller/plan/method/lattice.hpp"
#include "controller/plan/tables/sample_tables.hpp"
#include "controller/servo/servo_plan.hpp"
#include "shared/volume/voxel_grid.hpp"

// The load-time half of an overlap method: interface and choice, its memory, and the cost of its
// operations. Each method has a file of its own, but `surface`, which does nothing.

namespace kerf {

/// A part of a tick: the number of its innermost operations, and the price of one on the reference
/// machine. The file of the method defines an operation.
struct StageCost {
  const char* stage;
  std::uint64_t operations;
  double price_ns;
};

/// Work in us on the reference machine.
[[nodiscard]] double work_us(const StageCost& stage) noexcept;
[[nodiscard]] double work_us(const std::vector<StageCost>& stages) noexcept;

/// ns of one operation on the reference machine, a core of 2024 at 4.4 GHz, by kernel set or
/// number type; rounded up from the costliest of many tools. 0 if a stage does not exist. NEON was
/// never measured on hardware: guesses, for slower cores.
struct UnitCosts {
  double avx512, avx2, neon, scalar;
  double float64 = 0;
};

/// A stage with the price of `runs_it`, the name of a kernel set or a word of NumericKind. Throws
/// std::logic_error if it has no price.
[[nodiscard]] StageCost priced(const char* stage, std::uint64_t operations, const UnitCosts& prices,
                               std::string_view runs_it);

/// The queries of the swept proxy: samples that are read, and work that counts like them. Their
/// cost does not depend on the method. The price is that of the costliest ticks that `kerf studies
/// extremes` finds, of tools of 500 to 1100 samples, and of queries inside of the solid.
[[nodiscard]] StageCost query_stage(std::uint64_t samples, std::string_view runs_it);

/// The stages of cutting by force, `list` and `spend`, the same beside every method: groups of
/// voxels (in double: voxels) that the tool covers (tool_bounds.hpp), read with their
/// weights; and the same, from which the budget is taken, twice if the fullest have not enough.
void add_force_stages(std::uint64_t covered, std::string_view runs_it,
                      std::vector<StageCost>& stages);

/// Memory of the methods of a scene's tools, which request it one after the other: tables and
/// scratch are made at once, arrays in the number type of the loop are counted by length. The
/// largest request counts. Load time.
class MethodMemory {
 public:
  /// Entries, 0 if no method needs the array.
  struct Lengths {
    std::array<std::size_t, kMaxVolumes> gradients{}, carry{};  ///< by volume of the plan
    std::size_t overlap = 0, refresh = 0;
  };
  Lengths lengths;
  SplatMemory scratch;  ///< of the tick, for all tools

  explicit MethodMemory(GradientKernel kernel) : kernel_(kernel) {}

  /// The tool's table for this permutation, at a fixed address; a tool with the same permutation in
  /// its next volume gets the same.
  const AlignedTable& hold_table(const SceneTool& tool, const AxisPermutation& turn,
                                 const KernelSet& kernels);
  /// The tool's samples for fixed point in any pose, the same for all its volumes.
  void hold_samples(const SceneTool& tool, SampleOrder order);
  /// The samples of the last tool of `hold_samples`, if it is `tool`; at a fixed address.
  [[nodiscard]] SampleTable samples_of(const SceneTool& tool) const noexcept;
  /// The allocated arrays, by name.
  [[nodiscard]] std::vector<ArrayBytes> arrays() const;

  static void need(std::size_t& length, std::size_t wish) { length = std::max(length, wish); }

 private:
  template <class Table>
  struct OfTool {
    const SceneTool* tool;
    std::string name;
    Table table;
  };

  GradientKernel kernel_;
  AxisPermutation turn_{};  ///< of the last table
  std::vector<OfTool<std::unique_ptr<AlignedTool>>> tables_;
  std::vector<OfTool<SampleTool>> samples_;
};

/// Unit and range of an exact integer sum.
struct SumUnit {
  double steps;    ///< density steps per voxel edge in one unit
  double largest;  ///< bound of the sum, in units
};

/// The two sums of a method.
struct SumUnits {
  SumUnit contact, modification;
};

/// Sums of stored gradients times weights of 2^15; `terms` bounds the number of full weights.
[[nodiscard]] inline SumUnit gathered_sum(double terms) {
  return {std::ldexp(1.0, -15), std::ldexp(std::max(terms, 1.0), 30)};
}

/// Sums of exact gradients times weights of 2^15, with the bits that `sum_shift` keeps.
[[nodiscard]] inline SumUnit exact_sum(const ExactTaps& taps, std::size_t samples) {
  const int bits = 15 - sum_shift(samples);
  return {std::ldexp(taps.factor, -taps.shift - bits),
          std::ldexp(static_cast<double>(samples) * static_cast<double>(kMaxExactGradient), bits)};
}

/// A tool in a solid volume of a scene, and the kernels that run the loop.
struct ToolCase {
  const LoadedScene& scene;
  const SceneTool& tool;
  const SceneVolume& volume;
  const KernelSet& kernels;
};

/// Inputs of the operations of a tick, besides the box of the tool.
struct TickShape {
  std::size_t samples = 0;
  VoxelGrid grid{};
  CutModel cut = CutModel::none;
  bool swept = false;        ///< the contact is that of the proxy, so a method has no `contact`
  std::string_view runs_it;  ///< name of the kernels, or "double"
  const AlignedTable* table = nullptr;  ///< of the method `aligned`
};

/// One way to compute contact and cut of a tool in a volume, at load time: when it serves, its
/// memory and its cost.
///
/// A new method needs its line in controller/servo/servo_plan.hpp, a step like
/// controller/servo/method_step.cpp, and a file like method_splat.cpp: a class derived from this
/// one and the function that returns it. The defaults are those of a method that does nothing in a
/// tick. Every stage has a price for each kernel set that runs it. MethodMemory holds a table or
/// scratch of its own, and `plan_tool` (plan_tools.hpp) passes it to its ToolInVolume.
class ToolMethod {
 public:
  Method step;
  const char* name;
  /// How to make a cheaper method serve, for a person; empty if there is none.
  const char* advice;

  /// Why it serves; empty if it does not. The scene alone decides, never the machine. Throws
  /// LoadError for a tool that its integers cannot hold.
  [[nodiscard]] virtual std::optional<std::string> serves(const ToolCase& in) const = 0;

  /// Reserves in `memory` what its step needs in volume `v` of the plan; returns the table of the
  /// method `aligned`, null for others.
  virtual const AlignedTable* hold(const ToolCase& /*in*/, std::size_t /*v*/,
                                   MethodMemory& /*memory*/) const {
    return nullptr;
  }

  /// Units of the sums of its step.
  [[nodiscard]] virtual SumUnits sums(const LoadedScene& /*scene*/, std::size_t /*samples*/) const {
    return {gathered_sum(1), gathered_sum(1)};
  }

  /// Its own stages in a tick in which the cells of all samples lie in a box of this size, in low
  /// corners as TickBox::size, at any speed and with any content. The box may be larger than the
  /// volume.
  [[nodiscard]] virtual std::vector<StageCost> stages(const TickShape& /*shape*/,
                                                      VoxelIndex /*box*/) const {
    return {};
  }

 protected:
  constexpr ToolMethod(Method step, const char* name, const char* advice) noexcept
      : step(step), name(name), advice(advice) {}
  ~ToolMethod() = default;
};

// The methods of the list (KERF_METHODS), one file each.
#define KERF_DECLARE(name, Step, serves) [[nodiscard]] const ToolMethod& name##_method() noexcept;
KERF_METHODS(KERF_DECLARE)
#undef KERF_DECLARE

struct MethodChoice {
  const ToolMethod* method;
  std::string why;  ///< one reason for a person
};

/// The first method of the list that serves. Throws LoadError for a tool that no method of
/// fixed-point numbers can hold. Load time.
[[nodiscard]] MethodChoice choose_method(const ToolCase& in);

/// Inputs of the operations of the method's tick.
[[nodiscard]] TickShape tick_shape(const ToolCase& in, const AlignedTable* table);

/// Entries of the list of a cut by force, at most: groups of voxels for kernels, else voxels.
/// Closer if the method `aligned` has its table.
[[nodiscard]] std::size_t max_cover_entries(const ToolCase& in, const AlignedTable* table);

/// All stages of a tick in the order in which they run: queries of the proxy, if there is one, the
/// stages of the method, and the cut by force, if there is one.
[[nodiscard]] std::vector<StageCost> tick_stages(const ToolMethod& method, const TickShape& shape,
                                                 VoxelIndex box, std::uint64_t queried,
                                                 std::uint64_t covered);

/// Most operations of every stage in any pose, at any speed, with any content.
[[nodiscard]] std::vector<StageCost> most_stages(const ToolMethod& method, const TickShape& shape,
                                                 const ToolCase& in, std::uint64_t queried);

// Shared by the methods: when a tool cannot be aligned, and the limits of those that take it in any
// pose.

/// Why the method `aligned` cannot serve; empty if it can.
[[nodiscard]] std::string why_not_aligned(const ToolCase& in);

/// For a person whose tool was not aligned.
inline constexpr const char* kAdviceToAlign = "a round or unturned tool on the volume's lattice";

/// The bounds that keep fixed-point sums within their integers: distance of samples from the tool's
/// centre, and how many are in a voxel or a plane. Throw LoadError.
void check_reach(const ToolCase& in);
void check_splat(const ToolCase& in);

// Operations that they count alike.
inline constexpr std::uint64_t kPlaceOperations = 9;  ///< multiply-adds: three a component
inline constexpr std::uint64_t kCellCorners = 8;

[[nodiscard]] constexpr std::uint64_t count(std::int32_t n) noexcept {
  return static_cast<std::uint64_t>(n);
}
[[nodiscard]] constexpr std::uint64_t voxels_of(VoxelIndex edges) noexcept {
  return count(edges.x) * count(edges.y) * count(edges.z);
}
/// Rows of a box's overlap.
[[nodiscard]] constexpr std::uint64_t rows_of(VoxelIndex size) noexcept {
  return (count(size.y) + 1) * (count(size.z) + 1);
}

}  // namespace kerf
