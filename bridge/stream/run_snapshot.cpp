// SPDX-License-Identifier: Apache-2.0
#include "bridge/stream/run_snapshot.hpp"

#include <algorithm>
#include <cstring>
#include <string>

#include "bridge/wire/messages.hpp"

namespace kerf::bridge {
namespace {

constexpr int kMaxPasses = 4;  // as SegmentReader::update; 2 is the most seen so far

}  // namespace

std::vector<VolumeDescriptor> describe_volumes(const SegmentInfo& info) {
  std::vector<VolumeDescriptor> out;
  for (const SegmentVolumeInfo& volume : info.volumes) {
    VolumeDescriptor& to = out.emplace_back();
    to.nx = static_cast<std::uint16_t>(volume.grid.nx);
    to.ny = static_cast<std::uint16_t>(volume.grid.ny);
    to.nz = static_cast<std::uint16_t>(volume.grid.nz);
    to.log2_brick = kBrickLog2;
    to.bits_per_voxel = 8 * sizeof(Density);
    to.bricks_x = static_cast<std::uint32_t>(volume.bricks.bx);
    to.bricks_y = static_cast<std::uint32_t>(volume.bricks.by);
    to.bricks_z = static_cast<std::uint32_t>(volume.bricks.bz);
    to.brick_count = volume.bricks.count();
    std::copy(volume.spacing_mm.begin(), volume.spacing_mm.end(), to.spacing_mm);
    std::copy(volume.origin_mm.begin(), volume.origin_mm.end(), to.origin_mm);
    std::copy(volume.orientation.begin(), volume.orientation.end(), to.orientation);
    to.initial_hash = volume.initial_hash;
    to.material = volume.material;
    to.iso = volume.iso;
    to.off_labels = volume.has_labels ? 1 : 0;
  }
  return out;
}

RunSnapshot::RunSnapshot(const SegmentReader& reader)
    : reader_(reader),
      plan_(static_cast<std::uint32_t>(reader.info().scene_json.size()),
            describe_volumes(reader.info())) {
  std::size_t bricks = 0;
  for (const BlockPlane& plane : plan_.planes()) {
    if (plane.kind == BlockKind::text) first_density_ = plane.count;
    if (plane.kind == BlockKind::density) bricks += plane.count;
  }
  bricks_.resize(bricks);
  versions_.resize(bricks);
  pins_.resize(bricks);
}

void RunSnapshot::update(std::int64_t now_ns, bool writer_gone) {
  changed_.clear();
  whole_ = false;
  for (int pass = 0; pass < kMaxPasses && !whole_; ++pass) {
    const std::uint64_t epoch = reader_.epoch();
    const bool all = read_changed();
    whole_ = (all && epoch % 2 == 0 && reader_.unchanged_since(epoch)) || writer_gone;
    if (!whole_) continue;
    // An odd epoch was not completed: the last complete tick is the one before.
    tick_ = tick_of_version(epoch - epoch % 2);
    if (taken_ns_ == 0) reader_.forget_pages();  // after the first complete copy
    taken_ns_ = now_ns;
  }
}

bool RunSnapshot::read_changed() {
  bool all = true;
  Brick brick;
  for (const BlockPlane& plane : plan_.planes()) {
    if (plane.kind != BlockKind::density) continue;
    scanned_.clear();
    const auto seen = std::span(versions_).subspan(plane.first - first_density_, plane.count);
    reader_.changed_bricks(plane.volume, seen, scanned_);
    for (const std::uint32_t id : scanned_) {
      const std::uint64_t version = reader_.read_brick(plane.volume, id, brick);
      all = all && version != 0;
      if (version != 0 && version != seen[id]) replace(plane.first + id, version, brick);
    }
  }
  return all;
}

void RunSnapshot::replace(std::uint32_t id, std::uint64_t version, const Brick& brick) {
  const std::size_t at = id - first_density_;
  if (pins_[at] != 0) {
    kept_.emplace(std::pair(id, versions_[at]), Kept{bricks_[at], pins_[at]});
    pins_[at] = 0;
  }
  bricks_[at] = brick;
  versions_[at] = version;
  changed_.push_back(id);
}

std::uint64_t RunSnapshot::version(std::uint32_t id) const noexcept {
  return is_density(id) ? versions_[id - first_density_] : kConstantVersion;
}

void RunSnapshot::pin(std::uint32_t id) noexcept {
  if (is_density(id)) ++pins_[id - first_density_];
}

void RunSnapshot::unpin(std::uint32_t id, std::uint64_t version) noexcept {
  if (!is_density(id)) return;
  const std::size_t at = id - first_density_;
  if (versions_[at] == version) {
    --pins_[at];
    return;
  }
  const auto kept = kept_.find({id, version});
  if (--kept->second.pins == 0) kept_.erase(kept);
}

void RunSnapshot::copy(std::uint32_t id, std::uint64_t version,
                       std::span<std::byte> out) const noexcept {
  if (is_density(id)) {
    const std::size_t at = id - first_density_;
    const Brick& brick =
        versions_[at] == version ? bricks_[at] : kept_.find({id, version})->second.brick;
    std::memcpy(out.data(), brick.data(), sizeof brick);
    return;
  }
  const BlockPlane& plane = plan_.plane_of(id);
  if (plane.kind == BlockKind::text) {
    copy_text(id, out);
  } else {
    copy_labels(plane, id - plane.first, out);
  }
}

void RunSnapshot::copy_text(std::uint32_t block, std::span<std::byte> out) const noexcept {
  const std::string& text = reader_.info().scene_json;
  const std::size_t begin = std::size_t{block} * kTextBlockBytes;
  const std::size_t bytes = std::min(kTextBlockBytes, text.size() - begin);
  std::fill(out.begin(), out.end(), std::byte{});
  std::memcpy(out.data(), text.data() + begin, bytes);
}

void RunSnapshot::copy_labels(const BlockPlane& plane, std::uint32_t brick,
                              std::span<std::byte> out) const noexcept {
  const SegmentVolumeInfo& volume = reader_.info().volumes[plane.volume];
  const std::span<const Label> labels = reader_.labels(plane.volume);
  const VoxelBox box = volume.bricks.voxels(brick);
  std::fill(out.begin(), out.end(), std::byte{});
  for (std::int32_t z = box.lo.z; z < box.hi.z; ++z) {
    for (std::int32_t y = box.lo.y; y < box.hi.y; ++y) {
      std::memcpy(out.data() + brick_row(y - box.lo.y, z - box.lo.z) * kBrickEdge,
                  labels.data() + volume.grid.index(box.lo.x, y, z),
                  static_cast<std::size_t>(box.hi.x - box.lo.x) * sizeof(Label));
    }
  }
}

}  // namespace kerf::bridge
