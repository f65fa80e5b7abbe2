// SPDX-License-Identifier: Apache-2.0

#include "tests/studies/monkey/test_controller.hpp"

#include <algorithm>
#include <cmath>

#include "shared/volume/voxel_grid.hpp"

namespace kerf {

namespace {

constexpr const char* kMaterials = R"(
  "materials": [{"name": "none", "iso": 0, "colour": [0, 0, 0]},
                {"name": "dentin", "iso": 0.3, "colour": [0.8, 0.7, 0.5]},
                {"name": "enamel", "iso": 0.7, "colour": [0.9, 0.9, 0.85]}])";
constexpr std::uint32_t kIsoDensity = 25'000;
constexpr double kVoxelMm = 0.5;
constexpr std::uint64_t kMonkeyTickNs = 1'000'000;

std::string decimal(double value) {
  return std::to_string(value);
}

/// Balls and pins; one is long, as a handpiece is.
std::string monkey_tool(std::uint32_t tool) {
  const double r = 0.4 + 0.3 * tool;
  const std::string name = R"({"name": "tool )" + std::to_string(tool + 1) + R"(", "profile": [)";
  if (tool % 2 == 0) {
    return name + "[" + decimal(-r) + ", 0], [0, " + decimal(r) + "], [" + decimal(r) + ", 0]]}";
  }
  return name + "[0, 0], [0.5, " + decimal(r) + "], [" + decimal(5.0 * (tool + 1)) + ", " +
         decimal(r) + "]]}";
}

std::string monkey_scene(std::size_t volumes) {
  std::string text = R"({"volumes": [)";
  for (std::size_t v = 0; v < volumes; ++v) {
    text += (v > 0 ? ", " : "") + std::string(R"({"name": "volume )") + std::to_string(v) +
            R"(", "solid": )" + (v == 1 ? "false" : "true") + "}";
  }
  text += R"(], "tools": [)";
  for (std::uint32_t tool = 0; tool < MonkeyController::kTools; ++tool) {
    text += (tool > 0 ? ", " : "") + monkey_tool(tool);
  }
  return text + "]," + kMaterials + "}";
}

}  // namespace

MonkeyController::MonkeyController(const std::string& name, RandomNumbers& random)
    : volumes_(static_cast<std::size_t>(1 + random.below(3))) {
  SegmentSpec spec;
  for (Volume& volume : volumes_) {
    volume.grid = {1 + random.below(40), 1 + random.below(40), 1 + random.below(40)};
    fill(volume, random);
    SegmentVolumeSpec& shown = spec.volumes.emplace_back();
    shown.grid = volume.grid;
    shown.spacing_mm = {kVoxelMm, kVoxelMm, random.once_in(3) ? 2.0 * kVoxelMm : kVoxelMm};
    for (double& at : shown.origin_mm) at = random.between(-12.0, -4.0);
    if (random.once_in(2)) shown.orientation = {0.0F, 0.0F, 0.3826834F, 0.9238795F};
    shown.iso = kIsoDensity;
    shown.density = volume.density;
    if (random.once_in(3)) {
      volume.labels.resize(volume.density.size());
      for (std::size_t i = 0; i < volume.labels.size(); ++i) {
        volume.labels[i] = static_cast<Label>(i / 97 % 3);
      }
      shown.labels = volume.labels;
    }
  }
  spec.scene_json = monkey_scene(volumes_.size());
  writer_.emplace(SegmentWriter::create(spec));
  server_ = std::make_unique<SegmentServer>(name, *writer_, CommandLimits{.tools = kTools});
  writer_->set_lifecycle(Lifecycle::run);
  hand_.orientation[3] = 1.0F;
  if (!random.once_in(4)) move(random);  // else: no tick yet
}

/// Bars with a slope, and gaps that are the greater half.
void MonkeyController::fill(Volume& volume, RandomNumbers& random) {
  const int period = 4 + random.below(14);
  const int axis = random.below(3);
  const int full = 30'000 + 5'000 * random.below(8);
  volume.density.assign(volume.grid.voxel_count(), 0);
  for_each_voxel(volume.grid.box(), [&](int x, int y, int z) {
    const int along = axis == 0 ? x : axis == 1 ? y : z;
    const int step = std::clamp(2 * (along % period) - period, 0, 4);
    volume.density[volume.grid.index(x, y, z)] = static_cast<Density>(step * full / 4);
  });
}

VoxelBox MonkeyController::any_box(const VoxelGrid& grid, RandomNumbers& random) const {
  const VoxelIndex at{random.below(grid.nx), random.below(grid.ny), random.below(grid.nz)};
  const int edge = 1 + random.below(10);
  return VoxelBox{at, {at.x + edge, at.y + edge, at.z + edge}}.clipped(grid.box());
}

/// Air stays the greater part of what is below any iso in a volume without labels: translucent
/// renderers take the median of that for air when they are made, and draw no less a picture than
/// others made later.
void MonkeyController::cut(RandomNumbers& random) {
  writer_->begin_tick(++now_);
  for (int boxes = 1 + random.below(4); boxes > 0; --boxes) {
    const auto v = static_cast<std::size_t>(random.below(static_cast<int>(volumes_.size())));
    Volume& volume = volumes_[v];
    const VoxelBox box = any_box(volume.grid, random);
    const bool adds = random.once_in(4), in_part = !volume.labels.empty();
    const int left = in_part ? random.below(3) : 0;
    std::uint32_t removed = 0;
    for_each_voxel(box, [&](int x, int y, int z) {
      Density& at = volume.density[volume.grid.index(x, y, z)];
      const bool solid = adds && (at > 0 || in_part);
      const auto next = static_cast<Density>(solid ? 65'535 : at * left / 4);
      removed += next < at ? static_cast<std::uint32_t>(at - next) : 0U;
      at = next;
    });
    writer_->publish_box(v, volume.density, box, removed);
  }
  finish_tick();
}

void MonkeyController::refill(RandomNumbers& random) {
  const auto v = static_cast<std::size_t>(random.below(static_cast<int>(volumes_.size())));
  writer_->begin_tick(++now_);
  fill(volumes_[v], random);
  writer_->publish_box(v, volumes_[v].density, volumes_[v].grid.box(), 0);
  finish_tick();
}

void MonkeyController::move(RandomNumbers& random) {
  while (const auto command = server_->take_command()) {
    if (command->kind == CommandKind::select_tool) hand_.active_tool = command->argument;
  }
  if (random.once_in(8)) {
    hand_.active_tool = static_cast<std::uint32_t>(random.below(kTools + 1));  // one is not there
  }
  for (double& at : hand_.position_mm) at = random.between(-12.0, 12.0);
  const double half_rad = random.between(-1.5, 1.5);
  hand_.orientation[0] = static_cast<float>(std::sin(half_rad));
  hand_.orientation[3] = static_cast<float>(std::cos(half_rad));
  for (float& force : hand_.commanded_force_n) {
    force = random.once_in(3) ? 0.0F : static_cast<float>(random.between(-2.0, 2.0));
  }
  hand_.penetration_mm = static_cast<float>(random.between(0.0, 0.5));
  hand_.flags =
      kFlagStarted | (random.once_in(6) ? kFlagRefused : 0) | (random.once_in(6) ? kFlagShaft : 0);
  tick();
}

void MonkeyController::tick() {
  writer_->begin_tick(++now_);
  finish_tick();
}

/// Without a heartbeat the data has no age, which would differ from run to run.
void MonkeyController::finish_tick() {
  hand_.tick = now_;
  hand_.start_ns = now_ * kMonkeyTickNs;
  writer_->publish_state(hand_);
  writer_->end_tick(0);
}

}  // namespace kerf
