// SPDX-License-Identifier: Apache-2.0

#include "shared/segment/segment.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "shared/segment/layout_table.hpp"
#include "shared/volume/voxel_grid.hpp"

namespace kerf {
namespace {

constexpr std::uint64_t kPartAlignment = 4096;  // no two parts share a page or a cache line

void check_source(const SegmentVolumeSpec& volume, std::size_t index) {
  const std::string location = "segment: volume " + std::to_string(index) + ": ";
  const auto fits = [](std::int32_t n) {
    return n >= 1 && n <= std::numeric_limits<std::uint16_t>::max();
  };
  const VoxelGrid& grid = volume.grid;
  const std::string size = std::to_string(grid.nx) + " x " + std::to_string(grid.ny) + " x " +
                           std::to_string(grid.nz) + " voxels";
  if (!fits(grid.nx) || !fits(grid.ny) || !fits(grid.nz)) {
    throw SegmentError(location + size + "; each edge is 1 to 65535");
  }
  const BrickGrid bricks = BrickGrid::of(grid);
  const std::uint64_t count = std::uint64_t{static_cast<std::uint32_t>(bricks.bx)} *
                              static_cast<std::uint32_t>(bricks.by) *
                              static_cast<std::uint32_t>(bricks.bz);
  if (count > kMaxBricks) {
    throw SegmentError(location + size + " is above 1024^3; crop or resample it");
  }
  if (volume.density.size() != grid.voxel_count()) {
    throw SegmentError(location + std::to_string(volume.density.size()) + " densities for " + size +
                       "; give one per voxel");
  }
  if (!volume.labels.empty() && volume.labels.size() != grid.voxel_count()) {
    throw SegmentError(location + std::to_string(volume.labels.size()) + " labels for " + size +
                       "; give none or one per voxel");
  }
  if (!std::all_of(volume.spacing_mm.begin(), volume.spacing_mm.end(),
                   [](double mm) { return std::isfinite(mm) && mm > 0; })) {
    throw SegmentError(location + "spacing is not positive; give mm per voxel");
  }
}

VolumeDescriptor describe(const SegmentVolumeSpec& volume) {
  const BrickGrid bricks = BrickGrid::of(volume.grid);
  VolumeDescriptor out{};
  out.nx = static_cast<std::uint16_t>(volume.grid.nx);
  out.ny = static_cast<std::uint16_t>(volume.grid.ny);
  out.nz = static_cast<std::uint16_t>(volume.grid.nz);
  out.log2_brick = kBrickLog2;
  out.bits_per_voxel = 8 * sizeof(Density);
  out.bricks_x = static_cast<std::uint32_t>(bricks.bx);
  out.bricks_y = static_cast<std::uint32_t>(bricks.by);
  out.bricks_z = static_cast<std::uint32_t>(bricks.bz);
  out.brick_count = bricks.count();
  std::copy(volume.spacing_mm.begin(), volume.spacing_mm.end(), out.spacing_mm);
  std::copy(volume.origin_mm.begin(), volume.origin_mm.end(), out.origin_mm);
  std::copy(volume.orientation.begin(), volume.orientation.end(), out.orientation);
  out.material = volume.material;
  out.iso = volume.iso;
  out.off_labels = volume.labels.empty() ? 0 : 1;  // until `lay_out` places them
  return out;
}

}  // namespace

SegmentPlan plan_segment(const SegmentSpec& spec) {
  if (spec.volumes.empty() || spec.volumes.size() > kMaxVolumes) {
    throw SegmentError("segment: " + std::to_string(spec.volumes.size()) +
                       " volumes; a scene has 1 to " + std::to_string(kMaxVolumes));
  }
  if (spec.scene_json.size() > kMaxSceneBytes) {
    throw SegmentError("segment: scene of " + std::to_string(spec.scene_json.size()) +
                       " bytes; use smaller tools");
  }
  if (spec.tick_ns == 0) throw SegmentError("segment: tick of 0 ns; give the servo's period");

  if (spec.arms == 0 || spec.arms > kMaxArms) {
    throw SegmentError("segment: " + std::to_string(spec.arms) + " arms; a scene has 1 to " +
                       std::to_string(kMaxArms));
  }

  SegmentPlan plan;
  plan.header.config_hash = spec.config_hash;
  plan.header.tick_ns = spec.tick_ns;
  plan.header.off_state_2 = spec.arms == 2 ? 1 : 0;  // until `lay_out` places it
  plan.header.dirty_slots = spec.mirror_updates ? kDirtySlots : 1;
  plan.header.scene_bytes = spec.scene_json.size();
  set_build_id(plan.header, spec.build_id);
  for (std::size_t i = 0; i < spec.volumes.size(); ++i) {
    check_source(spec.volumes[i], i);
    plan.volumes.push_back(describe(spec.volumes[i]));
  }
  lay_out(plan);
  return plan;
}

void set_build_id(SegmentHeader& header, std::string_view build_id) {
  std::copy_n(build_id.begin(), std::min(build_id.size(), sizeof header.build_id - 1),
              header.build_id);
}

void lay_out(SegmentPlan& plan) {
  SegmentHeader& header = plan.header;
  std::uint64_t end = sizeof(SegmentHeader);
  const auto place = [&end](std::uint64_t bytes) {
    const std::uint64_t at = end;
    end = (end + bytes + kPartAlignment - 1) / kPartAlignment * kPartAlignment;
    return at;
  };
  header.layout_major = kLayoutMajor;
  header.layout_minor = kLayoutMinor;
  header.abi_hash = kAbiHash;
  header.volume_count = static_cast<std::uint32_t>(plan.volumes.size());
  header.state_slots = kStateSlots;
  header.state_record_bytes = sizeof(TickRecord);
  header.dirty_record_bytes = sizeof(DirtyRecord);
  header.off_volume_table = place(plan.volumes.size() * sizeof(VolumeDescriptor));
  header.off_scene = place(header.scene_bytes);
  header.off_state = place(std::uint64_t{header.state_slots} * sizeof(TickRecord));
  if (header.off_state_2 != 0) {
    header.off_state_2 = place(std::uint64_t{header.state_slots} * sizeof(TickRecord));
  }
  header.off_dirty = place(std::uint64_t{header.dirty_slots} * sizeof(DirtyRecord));
  for (VolumeDescriptor& out : plan.volumes) {
    out.off_versions = place(std::uint64_t{out.brick_count} * sizeof(std::uint64_t));
    out.off_bricks = place(std::uint64_t{out.brick_count} * kBrickVoxels * sizeof(Density));
    if (out.off_labels != 0) out.off_labels = place(std::uint64_t{out.nx} * out.ny * out.nz);
  }
  header.total_bytes = end;
}

SegmentMemory::SegmentMemory(SegmentMemory&& other) noexcept
    : fd_(std::exchange(other.fd_, -1)),
      locked_(other.locked_),
      bytes_(std::exchange(other.bytes_, {})) {}

SegmentMemory& SegmentMemory::operator=(SegmentMemory&& other) noexcept {
  std::swap(fd_, other.fd_);
  std::swap(locked_, other.locked_);
  std::swap(bytes_, other.bytes_);
  return *this;
}

}  // namespace kerf
