// SPDX-License-Identifier: Apache-2.0
#include "hil/lab/kernel_bench.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <span>

#include "controller/kernel/aligned.hpp"
#include "controller/kernel/contact.hpp"
#include "controller/kernel/milling.hpp"
#include "controller/scene/aligned_tool.hpp"
#include "hil/lab/paper_baseline.hpp"
#include "hil/lab/tick_timer.hpp"

namespace kerf {
namespace {

constexpr VoxelGrid kGrid{256, 256, 161};
using Numbers = FixedNumbers;
using Place = std::array<double, 3>;

/// What the compiler may not leave out.
volatile std::int64_t g_sink = 0;
void use(std::int64_t value) {
  g_sink = value;
}

std::vector<Density> densities(const std::function<double(double, double, double)>& inside_vox) {
  std::vector<Density> density;
  density.reserve(kGrid.voxel_count());
  for (std::int32_t z = 0; z < kGrid.nz; ++z) {
    for (std::int32_t y = 0; y < kGrid.ny; ++y) {
      for (std::int32_t x = 0; x < kGrid.nx; ++x) {
        const double share = 0.5 + inside_vox(x, y, z) / 2;  // antialiased over two voxels
        density.push_back(
            static_cast<Density>(std::lround(kDensityMax * std::clamp(share, 0.0, 1.0))));
      }
    }
  }
  return density;
}

std::vector<ToolOffset> tool_of(int size, bool ball) {
  std::vector<ToolOffset> offsets;
  for (int z = 1 - size; z < size; z += 2) {
    for (int y = 1 - size; y < size; y += 2) {
      for (int x = 1 - size; x < size; x += 2) {
        if (ball && x * x + y * y + z * z > size * size) continue;
        offsets.push_back({static_cast<std::int16_t>(x), static_cast<std::int16_t>(y),
                           static_cast<std::int16_t>(z)});
      }
    }
  }
  return offsets;
}

std::array<std::array<double, 3>, 3> rotation_of(double yaw, double pitch) {
  const double a = std::cos(yaw), b = std::sin(yaw), c = std::cos(pitch), d = std::sin(pitch);
  return {{{a * c, -b, a * d}, {b * c, a, b * d}, {-d, 0, c}}};
}

ToolPose<Numbers> pose_of(const Place& p, const std::array<std::array<double, 3>, 3>& rotation) {
  ToolPose<Numbers> pose;
  pose.centre_vox = {Q16(p[0]), Q16(p[1]), Q16(p[2])};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      pose.step[i][j] = static_cast<std::int32_t>(std::lround(rotation[i][j] * Numbers::kStepOne));
    }
  }
  return pose;
}

PaperPose paper_pose(const Place& p, const std::array<std::array<double, 3>, 3>& rotation) {
  PaperPose pose{};
  for (std::size_t i = 0; i < 3; ++i) {
    pose.centre_vox[i] = static_cast<float>(p[i]);
    for (std::size_t j = 0; j < 3; ++j) pose.rotation[i][j] = static_cast<float>(rotation[i][j]);
  }
  return pose;
}

/// More than any last-level cache in question.
void sweep_cache() {
  static std::vector<std::uint64_t> memory((96U << 20) / sizeof(std::uint64_t), 1);
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < memory.size(); i += 8) sum += memory[i]++;
  use(static_cast<std::int64_t>(sum));
}

/// The tool of a row and where it is at each of its ticks.
struct Ticks {
  std::string name;
  std::vector<ToolOffset> tool;
  int count;
  std::function<Place(int)> place;
  bool turned = true;  ///< for the plans that can turn it
  bool can_align = true;
  bool cold = false;
};

constexpr std::size_t kPaperBytes = 14;  // of 16 a voxel
constexpr std::size_t kGatherBytes = sizeof(Gradient<Numbers>);

class Bench {
 public:
  explicit Bench(const std::function<void(const KernelRow&)>& told) : told_(told) {}

  void contact(const std::vector<Density>& density, const PaperVolume& paper,
               std::span<const Gradient<Numbers>> field, const Ticks& ticks) {
    std::vector<Density> volume = density;
    begin(ticks);
    row("float", "paper", kPaperBytes * kGrid.voxel_count(), [&](int i) {
      use(std::lround(paper.feel(ticks.tool, paper_pose(ticks.place(i), turn(i))).contact[0]));
    });
    row("fixed", "reference", kGatherBytes * kGrid.voxel_count(), [&](int i) {
      use(contact_sum<Numbers>(kGrid, field, ticks.tool, pose_of(ticks.place(i), turn(i))).x);
    });
    each_set(false, [&](const AlignedKernels& set, const AlignedTable& table,
                        const AlignedScratch& scratch, std::size_t bytes) {
      row("fixed", set.name, bytes, [&](int i) {
        const auto pose = pose_of(ticks.place(i), rotation_of(0, 0));
        use(AlignedTick(set, table, scratch, kGrid, volume, pose).contact().x);
      });
    });
  }

  /// A slow cut, so that the tool stays surrounded by material: the dearest tick.
  void mill(const std::vector<Density>& density, const Ticks& ticks) {
    constexpr double kFraction = 1.0 / 4096;
    begin(ticks);
    {
      PaperVolume paper(kGrid, density);
      row("float", "paper", kPaperBytes * kGrid.voxel_count(), [&](int i) {
        use(std::lround(paper
                            .mill(ticks.tool, paper_pose(ticks.place(i), turn(i)),
                                  static_cast<float>(kFraction))
                            .removed));
      });
    }
    const auto rate = removal_rate<Numbers>(kFraction, false);
    {
      std::vector<Density> volume = density;
      std::vector<Gradient<Numbers>> field(kGrid.voxel_count());
      GradientScratch gradient_scratch;
      refresh_gradients<Numbers>(GradientKernel::farid, kGrid, volume, kGrid.box(), field,
                                 gradient_scratch);
      std::vector<Numbers::Weight> memory(std::size_t{40} * 40 * 40);
      std::vector<RemovalCarry<Numbers>> carry(64);
      OverlapBox<Numbers> box{memory, {}, 0};
      row("fixed", "reference", kGatherBytes * kGrid.voxel_count(), [&](int i) {
        const auto pose = pose_of(ticks.place(i), turn(i));
        const std::span<const Gradient<Numbers>> gradients = field;
        use(contact_sum<Numbers>(kGrid, gradients, ticks.tool, pose).x);
        overlap<Numbers>(kGrid, ticks.tool, pose, Numbers::kStepOne, box);
        use(modification_sum<Numbers>(kGrid, gradients, volume, box).x);
        const Removed removed = remove<Numbers>(kGrid, volume, box, rate, carry);
        refresh_gradients<Numbers>(GradientKernel::farid, kGrid, volume, removed.changed, field,
                                   gradient_scratch);
      });
    }
    each_set(true, [&](const AlignedKernels& set, const AlignedTable& table,
                       const AlignedScratch& scratch, std::size_t bytes) {
      std::vector<Density> volume = density;
      std::vector<std::uint16_t> carry(static_cast<std::size_t>(table.row_lanes));
      row("fixed", set.name, bytes, [&](int i) {
        const auto pose = pose_of(ticks.place(i), rotation_of(0, 0));
        const AlignedTick tick(set, table, scratch, kGrid, volume, pose);
        use(tick.contact().x);
        use(tick.mill(rate, carry).modification.x);
      });
    });
  }

  [[nodiscard]] std::vector<KernelRow> rows() && { return std::move(rows_); }

 private:
  void begin(const Ticks& ticks) {
    ticks_ = &ticks;
    baseline_p50_ns_ = 0;
  }

  [[nodiscard]] std::array<std::array<double, 3>, 3> turn(int i) const {
    if (!ticks_->turned) return rotation_of(0, 0);
    return rotation_of(0.3 + 2 * std::numbers::pi * i / ticks_->count, 0.2);
  }

  template <class Run>
  void each_set(bool mills, Run&& run) {
    if (!ticks_->can_align) return;
    for (auto set = aligned_kernels(); *set != nullptr; ++set) {
      const AlignedTool tool(ticks_->tool, kAlignedFarid, **set);
      AlignedMemory memory;
      memory.hold(tool.table().size, mills);
      run(**set, tool.table(), memory.view(), tool.bytes() + memory.bytes());
    }
  }

  template <class Tick>
  void row(const char* numeric, const char* isa, std::size_t bytes, Tick&& tick) {
    const bool cold = ticks_->cold;
    const TickTimes times = time_ticks(
        ticks_->count,
        [&] {
          if (cold) sweep_cache();
        },
        tick);
    if (baseline_p50_ns_ == 0) baseline_p50_ns_ = times.p50_ns;  // the paper is the first row
    rows_.push_back(
        {ticks_->name, numeric, isa, times.p50_ns, times.p99_ns, baseline_p50_ns_, bytes});
    told_(rows_.back());
  }

  const std::function<void(const KernelRow&)>& told_;
  const Ticks* ticks_ = nullptr;
  double baseline_p50_ns_ = 0;
  std::vector<KernelRow> rows_;
};

/// Around a ball of 40 voxels, dipping 2 voxels into it.
std::function<Place(int)> around(int size, int count) {
  return [size, count](int i) -> Place {
    const double angle = 2 * std::numbers::pi * i / count, radius = 40 + size * 0.5 - 2;
    return {128 + radius * std::cos(angle), 128 + radius * std::sin(angle), 80.5};
  };
}

}  // namespace

std::vector<KernelRow> bench_kernels(const std::function<void(const KernelRow&)>& told) {
  Bench bench(told);
  {
    const auto density = densities(
        [](double x, double y, double z) { return 40 - std::hypot(x - 128, y - 128, z - 80.5); });
    const PaperVolume paper(kGrid, density);
    std::vector<Gradient<Numbers>> field(kGrid.voxel_count());
    GradientScratch scratch;
    refresh_gradients<Numbers>(GradientKernel::farid, kGrid, density, kGrid.box(), field, scratch);
    const auto contact = [&](const Ticks& ticks) { bench.contact(density, paper, field, ticks); };
    contact({"contact/ball16/any", tool_of(16, true), 2000, around(16, 2000)});
    contact({"contact/ball10/any", tool_of(10, true), 2000, around(10, 2000)});
    contact({.name = "contact/cube16/aligned",
             .tool = tool_of(16, false),
             .count = 2000,
             .place = around(16, 2000),
             .turned = false});
    contact({.name = "contact/cube16/any",
             .tool = tool_of(16, false),
             .count = 2000,
             .place = around(16, 2000),
             .can_align = false});
    contact({"contact/ball32/any", tool_of(32, true), 400, around(32, 400)});
    contact({"contact/ball64/any", tool_of(64, true), 100, around(64, 100)});
    contact({.name = "contact/ball16/cold",
             .tool = tool_of(16, true),
             .count = 150,
             .place = around(16, 150),
             .cold = true});
  }
  const auto density = densities([](double, double, double z) { return 161 * 0.6 - z; });
  for (const int size : {16, 10}) {
    const std::string ball = "mill/ball" + std::to_string(size);
    bench.mill(density, {ball, tool_of(size, true), 400, [size](int i) -> Place {
                           return {size + 4 + 0.1 * i, 128.3, 66.8};
                         }});
    // Half out of the volume at its first x.
    bench.mill(density, {ball + "/border", tool_of(size, true), 400, [](int i) -> Place {
                           return {3.3 + 0.001 * i, 128.3, 66.8};
                         }});
  }
  return std::move(bench).rows();
}

}  // namespace kerf
