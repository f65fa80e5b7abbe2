// SPDX-License-Identifier: Apache-2.0
// Cutting by force from the ratios that the methods `aligned` and `splat` leave: the bits of the
// plain overlap, on every instruction set.
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <doctest/doctest.h>

#include "controller/kernel/covered_voxels.hpp"
#include "controller/kernel/overlap_methods.hpp"
#include "controller/plan/tables/sample_tables.hpp"
#include "tests/kernel/aligned_support.hpp"
#include "tests/kernel/preston_support.hpp"
#include "tests/support/sets_to_run.hpp"

namespace kerf::preston_methods_test {

using namespace kerf::test;

namespace {

using N = FixedNumbers;

struct Cut {
  std::vector<Density> density;
  ByMaterial<CutWeight<N>> weight;
  SurfaceDrag<N> drag;
  Removed removed;
  ByMaterial<CutBudget<N>> carry;
  CutBudget<N> lost = 0;

  /// The drag depends on where rows begin, by its roundings.
  [[nodiscard]] bool same_but_for_drag(const Cut& b) const {
    return density == b.density && weight == b.weight &&
           removed.density_steps == b.removed.density_steps &&
           removed.changed == b.removed.changed && carry == b.carry && lost == b.lost;
  }
  friend bool operator==(const Cut& a, const Cut& b) {
    return a.same_but_for_drag(b) && a.drag.x == b.drag.x && a.drag.z == b.drag.z &&
           a.drag.lever_ratio == b.drag.lever_ratio;
  }
};

/// One press upon a volume of up to three materials, one of them forbidden; at `force_n` the
/// fullest voxels may have too little.
class Press {
 public:
  Press(const TestVolume& volume, std::vector<Label> labels, const ToolPose<N>& pose,
        double force_n)
      : volume_(volume),
        labels_(std::move(labels)),
        drive_(cut_drive<N>({}, Q16(force_n), Q30(0.9))) {
    plan_.rate.fill(force_rate<N>(20000));
    plan_.rate[2] = force_rate<N>(0.7);
    plan_.rate[3] = {};
    plan_.labels = labels_;
    const auto& at = pose.centre_vox;
    // Across the rows, so that speeds change along them.
    frame_ = frame_at<N>({double(at.x), double(at.y), double(at.z)}, 4.0, Axis::z);
  }

  template <class Overlap>
  [[nodiscard]] Cut by_list(const Overlap& overlap) const {
    static std::vector<CoveredVoxel<N>> memory(60'000);
    return cut(covered_voxels<N>(volume_.grid, std::span<const Density>(volume_.density), labels_,
                                 overlap, frame_, std::span(memory)));
  }
  [[nodiscard]] Cut by_groups(const KernelSet& set, const BoxOverlap& overlap) const {
    static std::vector<CoveredGroup> memory(4000);
    return cut(covered_groups(set, volume_.grid, labels_, overlap, frame_, memory));
  }

 private:
  template <class Covered>
  [[nodiscard]] Cut cut(Covered covered) const {
    Cut cut{volume_.density, covered.weight, covered.drag, {}, {}};
    PrestonState<N> state;
    const auto out = cut_by_force(plan_, drive_, std::span<Density>(cut.density), state, covered);
    cut.removed = out.removed;
    cut.lost = out.lost;
    cut.carry = state.carry;
    return cut;
  }

  const TestVolume& volume_;
  std::vector<Label> labels_;
  N::Sum drive_;
  PrestonPlan<N> plan_;
  SpindleFrame<N> frame_;
};

/// Of every kind of group: one material, borders along and across rows, single voxels, labels
/// beyond the last material.
std::vector<Label> labels_of(const VoxelGrid& grid, int kind) {
  std::vector<Label> labels(kind == 0 ? 0 : grid.voxel_count());
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const auto x = i % static_cast<std::size_t>(grid.nx);
    const std::size_t label[] = {0, 1, x < 20 ? 1U : 2U, i * 2654435761U >> 7 & 3, 61 + i % 9};
    labels[i] = static_cast<Label>(label[kind]);
  }
  return labels;
}

}  // namespace

TEST_CASE("every method and instruction set cuts the same by force, inside and across borders") {
  const auto tool = ragged_tool(9, 7, 8, 4);
  const SampleTool samples(tool, SampleOrder::scattered);
  SplatMemory splat_memory;
  splat_memory.hold({14, 14, 14}, tool.size());
  BoxMemory memory;
  memory.hold({9, 7, 8}, true);
  std::vector<AlignedTool> tables;
  for (auto set = sets_to_run(); *set != nullptr; ++set)
    tables.emplace_back(tool, kExactFarid, **set);
  Cutter<N> cutter(20);
  std::mt19937 random(11);
  int cuts = 0, exhausted = 0, case_number = 0;
  for (int fill = 0; fill < kFills; ++fill) {
    const VoxelGrid grid = fill % 4 == 3 ? VoxelGrid{7, 9, 8} : VoxelGrid{44, 14, 12};
    const TestVolume volume = hard_volume(grid, fill, static_cast<std::uint32_t>(fill));
    for (int i = 0; i < 60; ++i, ++case_number) {
      const auto pose = random_pose(grid, {9, 7, 8}, random);
      const Press press(volume, labels_of(grid, case_number % 5), pose, i % 4 == 0 ? 60 : 1.5);
      overlap<N>(grid, tool, pose, N::kStepOne, cutter.overlap);
      const Cut truth = press.by_list(cutter.overlap);
      cuts += truth.removed.density_steps != 0 ? 1 : 0;
      exhausted += truth.lost > 0 ? 1 : 0;
      for (auto set = sets_to_run(); *set != nullptr; ++set) {
        INFO(std::string((*set)->name), ", fill ", fill, ", case ", i);
        std::vector<Density> density = volume.density;
        const AlignedTable& table = tables[static_cast<std::size_t>(set - kernel_sets())].table();
        const AlignedTick aligned(**set, table, memory.view(), grid, density, pose);
        static_cast<void>(aligned.press());
        const Cut listed = press.by_list(aligned.overlap());
        REQUIRE(listed.same_but_for_drag(truth));
        aligned.cover();
        const bool same = press.by_groups(**set, aligned.overlap()) == listed;
        REQUIRE(same);

        const SplatTick splat(**set, samples.table(), kExactFarid, splat_memory.view(), grid,
                              density, pose);
        splat.copy();
        splat.splat();
        static_cast<void>(splat.press(N::kStepOne));
        const Cut splat_listed = press.by_list(splat.overlap());
        REQUIRE(splat_listed.same_but_for_drag(truth));
        splat.cover(N::kStepOne);
        const bool splat_same = press.by_groups(**set, splat.overlap()) == splat_listed;
        REQUIRE(splat_same);
      }
    }
  }
  CHECK(cuts > 200);
  CHECK(exhausted > 20);
}

TEST_CASE("what materials bear of a press is the same in groups, on every instruction set") {
  const auto tool = ragged_tool(9, 7, 8, 4);
  BoxMemory memory;
  memory.hold({9, 7, 8}, true);
  Cutter<N> cutter(20);
  std::vector<CoveredVoxel<N>> list(60'000);
  std::vector<CoveredGroup> groups(4000);
  std::mt19937 random(12);
  std::uniform_real_distribution<double> part(-1, 1);
  int some = 0, case_number = 0;
  for (int fill = 0; fill < kFills; ++fill) {
    const VoxelGrid grid = fill % 4 == 3 ? VoxelGrid{7, 9, 8} : VoxelGrid{44, 14, 12};
    const TestVolume volume = hard_volume(grid, fill, static_cast<std::uint32_t>(fill));
    for (int i = 0; i < 200; ++i, ++case_number) {
      const std::vector<Label> labels = labels_of(grid, case_number % 5);
      const auto pose = random_pose(grid, {9, 7, 8}, random);
      const auto& at = pose.centre_vox;
      const auto frame = frame_at<N>({double(at.x), double(at.y), double(at.z)}, 4.0, Axis::z);
      Transform<N::Ratio, WorldSpace, VoxelSpace> rims;
      for (auto& row : rims.row) {
        for (auto& entry : row) entry = N::Ratio(i % 4 == 0 ? 60 * part(random) : 0.2);
      }
      const LoadPlane<N> plane{{N::Unit(part(random)), N::Unit(part(random)), N::Unit(0.1)},
                               N::Ratio(i % 2 == 0 ? -1 : 20 * part(random)),
                               N::Ratio(i % 3 == 0 ? 16 : 1)};
      const AheadForm<N::Sum> form = contact_form<N>(at, rims, plane);
      constexpr Density kIso = 30000;
      overlap<N>(grid, tool, pose, N::kStepOne, cutter.overlap);
      const auto covered = covered_voxels<N>(grid, std::span<const Density>(volume.density), labels,
                                             cutter.overlap, frame, std::span(list));
      const auto truth = loads(covered, form, volume.density, kIso);
      for (std::size_t m = 0; m < kMaxCutMaterials; ++m) {
        REQUIRE(truth.bearing[m] <= truth.ahead[m]);
        REQUIRE(truth.ahead[m] <= covered.weight[m]);
        some += truth.bearing[m] > 0 && truth.bearing[m] < truth.ahead[m] &&
                        truth.ahead[m] < covered.weight[m]
                    ? 1
                    : 0;
      }
      for (auto set = sets_to_run(); *set != nullptr; ++set) {
        INFO(std::string((*set)->name), ", fill ", fill, ", case ", i);
        const AlignedTool table(tool, kExactFarid, **set);
        std::vector<Density> density = volume.density;
        const AlignedTick tick(**set, table.table(), memory.view(), grid, density, pose);
        tick.cover();
        const bool same = loads(covered_groups(**set, grid, labels, tick.overlap(), frame, groups),
                                form, density, kIso) == truth;
        REQUIRE(same);
      }
    }
  }
  CHECK(some > 100);
}

TEST_CASE_TEMPLATE("a tool bears what lies at its contact", N, FixedNumbers, DoubleNumbers) {
  using Ratio = typename N::Ratio;
  using Unit = typename N::Unit;
  using Real = typename N::Real;
  Transform<Ratio, WorldSpace, VoxelSpace> rims;  // of 8 voxels
  for (std::size_t a = 0; a < 3; ++a) rims.row[a][a] = Ratio(0.125);
  const VoxelVec<Real> centre{Real(20), Real(30), Real(40)};
  const auto ahead = [&](const auto& form, double x, double y, double z) {
    const double one = N::kIsFixed ? 1 << 20 : 1;
    return (double(form.origin) + x * double(form.step[0]) + y * double(form.step[1]) +
            z * double(form.step[2])) /
           one;
  };
  const WorldVec<Unit> up{{}, Unit(1), {}}, left{Unit(-1), {}, {}};
  // A ball that presses towards +x is foremost there, at its rim.
  const auto ball = contact_form<N>(centre, rims, {left, Ratio(-1), Ratio(1)});
  CHECK(ahead(ball, 28, 30, 40) == doctest::Approx(1).epsilon(1e-5));
  CHECK(std::abs(ahead(ball, 20, 22, 48)) < 1e-5);
  CHECK(ahead(ball, 12, 30, 40) == doctest::Approx(-1).epsilon(1e-5));
  // One whose end is three rims below its centre bears within one voxel above that end.
  const auto end = contact_form<N>(centre, rims, {up, Ratio(-3), Ratio(8)});
  for (const double x : {12, 20, 28}) {
    CHECK(ahead(end, x, 6, 40) == doctest::Approx(1).epsilon(1e-4));
    CHECK(ahead(end, x, 6.5, 40) == doctest::Approx(0.5).epsilon(1e-4));
    CHECK(std::abs(ahead(end, x, 7, 40)) < 1e-4);
  }
  CHECK(ahead(everywhere<N>(), 3, 5, 60) == 1);
}

TEST_CASE("a long thin tool of any step along its rows weighs the same in groups") {
  // Rows of 50 voxels, of which the tool is wide enough to cover three groups and a half; rims of a
  // few voxels, of one, and of less than one, which all of a row is far beyond.
  const VoxelGrid grid{64, 9, 9};
  const TestVolume volume = hard_volume(grid, 3, 1);
  const auto tool = box_tool(50, 3, 3);
  BoxMemory memory;
  memory.hold({50, 3, 3}, true);
  const auto pose = pose_of({(31 << 16) + 7, (4 << 16) + 99, 4 << 16});
  std::vector<CoveredVoxel<N>> list(60'000);
  std::vector<CoveredGroup> groups(1000);
  for (auto set = sets_to_run(); *set != nullptr; ++set) {
    const AlignedTool table(tool, kExactFarid, **set);
    std::vector<Density> density = volume.density;
    const AlignedTick tick(**set, table.table(), memory.view(), grid, density, pose);
    tick.cover();
    for (const double rim_vox : {25.0, 4.0, 1.0, 0.3, 0.016}) {
      CAPTURE((*set)->name);
      CAPTURE(rim_vox);
      const auto frame = frame_at<N>({31.0, 4.0, 4.0}, rim_vox);
      const auto plain = covered_voxels<N>(grid, std::span<const Density>(density), {},
                                           tick.overlap(), frame, std::span(list));
      const auto grouped = covered_groups(**set, grid, {}, tick.overlap(), frame, groups);
      CHECK(grouped.weight == plain.weight);
      CHECK(grouped.drag.x == plain.drag.x);
      CHECK(grouped.drag.z == plain.drag.z);
      CHECK(grouped.drag.lever_ratio == plain.drag.lever_ratio);
      CHECK(plain.list.size() > 600);
    }
  }
}

}  // namespace kerf::preston_methods_test
