// SPDX-License-Identifier: Apache-2.0
#include "controller/loop/publisher.hpp"

#include <cstddef>
#include <utility>

#include "shared/segment/layout.hpp"

namespace kerf {
namespace {

DirtyCause cause_of(const ServoOutput& output) noexcept {
  if (output.resetting) return DirtyCause::reset;
  if (output.redoing) return DirtyCause::redo;
  return output.undoing ? DirtyCause::undo : DirtyCause::milling;
}

}  // namespace

SegmentSpec segment_spec(const LoadedScene& scene, const std::string& json, std::uint64_t hash) {
  SegmentSpec spec;
  spec.scene_json = json;
  spec.config_hash = hash;
  spec.tick_ns = static_cast<std::uint32_t>(1'000'000'000 / scene.servo.rate_hz);
  spec.build_id = std::string("kerf-controller ") + KERF_VERSION;
  spec.mirror_updates = scene.cut.model != CutModel::none;
  spec.arms = arms_of(scene);
  for (const SceneVolume& volume : scene.volumes) {
    SegmentVolumeSpec& v = spec.volumes.emplace_back();
    v.grid = volume.image.grid;
    v.spacing_mm = volume.image.spacing_mm;
    v.origin_mm = volume.pose.position_mm;
    for (std::size_t i = 0; i < 4; ++i) {
      v.orientation[i] = static_cast<float>(volume.pose.orientation[i]);
    }
    v.iso = volume.iso;
    v.density = volume.image.density;
    v.labels = volume.image.labels;
  }
  return spec;
}

void Publisher::publish(Tick tick, std::span<const DeviceReport> reports,
                        const TickCommands& commands, std::span<const ServoOutput> outputs,
                        const TickTiming& timing) noexcept {
  const bool held = outputs.front().held;
  if (std::exchange(held_, held) != held) {
    segment_.set_lifecycle(held ? Lifecycle::hold : Lifecycle::run);
  }
  segment_.begin_tick(tick);
  const auto publish_box = [&](const ServoOutput& output, std::size_t v, const VoxelBox& box) {
    const std::uint64_t steps = output.removed_by_volume[v] + output.returned_by_volume[v];
    return segment_.publish_box(v, servo_.density(v), box, static_cast<std::uint32_t>(steps),
                                cause_of(output));
  };
  make_records(servo_, reports, commands, outputs, removal_hash_, records_, publish_box);
  for (std::size_t a = 0; a < outputs.size(); ++a) {
    TickRecord& record = records_[a];
    record.tick = tick;
    record.start_ns = static_cast<std::uint64_t>(timing.start_ns);
    record.period_error_ns = saturate_i32(timing.late_ns);
    record.execution_ns = static_cast<std::uint32_t>(timing.compute_ns);
    record.missed_deadlines = static_cast<std::uint32_t>(timing.missed_deadlines);
    record.lost_packets = static_cast<std::uint32_t>(timing.lost_packets[a]);
    record.refused_packets = static_cast<std::uint32_t>(timing.refused_packets[a]);
  }
  // The first arm last: a reader that sees its record finds those of the others.
  for (std::size_t a = outputs.size(); a-- > 0;) segment_.publish_state(records_[a], a);
  segment_.end_tick(static_cast<std::uint64_t>(timing.heartbeat_ns));
}

}  // namespace kerf
