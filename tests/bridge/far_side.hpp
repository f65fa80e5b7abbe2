// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "bridge/wire/messages.hpp"
#include "bridge/wire/parse.hpp"
#include "shared/volume/brick_grid.hpp"

namespace kerf::test {

/// A viewer without a network: what it was told, and what it would say. The obvious reference of
/// every other viewer: it keeps each block as it came.
struct FarSide {
  std::optional<bridge::ParsedHello> hello;
  std::unique_ptr<bridge::FrameParser> parser;
  std::vector<std::uint64_t> versions;
  std::vector<std::vector<std::byte>> blocks;
  std::uint64_t hash = 0, frames = 0, passes = 0;
  bridge::FrameHead last{};
  std::vector<TickRecord> ticks;
  std::vector<DirtyRecord> dirty;
  std::uint32_t widest_stride = 0;
  std::vector<bridge::ReplyMessage> replies;
  std::vector<bridge::ViewMessage> views;

  /// True where the message was a frame, which is to be acknowledged.
  bool take(std::span<const std::byte> message) {
    switch (bridge::magic_of(message)) {
      case bridge::kHelloMagic:
        hello = bridge::parse_hello(message);
        parser = std::make_unique<bridge::FrameParser>(*hello);
        versions.assign(parser->plan().count(), 0);
        blocks.assign(parser->plan().count(), {});
        hash = frames = passes = 0;
        return false;
      case bridge::kFrameMagic:
        take_frame(message);
        return true;
      case bridge::kRecordsMagic:
        take_records(message);
        return false;
      case bridge::kViewMagic:
        views.push_back(bridge::parse_view(message));
        return false;
      default:
        replies.push_back(bridge::parse_reply(message));
        return false;
    }
  }

  /// At the last frame of a pass: it holds exactly the volumes of `last.tick`.
  [[nodiscard]] bool is_whole() const {
    return (last.flags & bridge::kLastOfPass) != 0 && last.set_hash == hash;
  }

  [[nodiscard]] bridge::AckMessage ack() const {
    return {bridge::kAckMagic, 0, last.session, last.frame};
  }

  /// A volume, x fastest, as the held bricks make it.
  [[nodiscard]] std::vector<Density> volume(std::uint32_t index) const {
    return linear<Density>(bridge::BlockKind::density, index);
  }
  [[nodiscard]] std::vector<Label> labels(std::uint32_t index) const {
    return linear<Label>(bridge::BlockKind::labels, index);
  }

 private:
  template <class Voxel>
  [[nodiscard]] std::vector<Voxel> linear(bridge::BlockKind kind, std::uint32_t index) const {
    const VolumeDescriptor& volume = hello->volumes[index];
    const VoxelGrid grid{volume.nx, volume.ny, volume.nz};
    const BrickGrid bricks = BrickGrid::of(grid);
    std::vector<Voxel> out(grid.voxel_count());
    for (const bridge::BlockPlane& plane : parser->plan().planes()) {
      if (plane.kind != kind || plane.volume != index) continue;
      for (std::uint32_t id = 0; id < plane.count; ++id) {
        const std::vector<std::byte>& block = blocks[plane.first + id];
        if (block.empty()) continue;
        const VoxelBox box = bricks.voxels(id);
        for (std::int32_t z = box.lo.z; z < box.hi.z; ++z) {
          for (std::int32_t y = box.lo.y; y < box.hi.y; ++y) {
            const std::size_t row = brick_row(y - box.lo.y, z - box.lo.z) * kBrickEdge;
            std::memcpy(&out[grid.index(box.lo.x, y, z)], block.data() + row * sizeof(Voxel),
                        static_cast<std::size_t>(box.hi.x - box.lo.x) * sizeof(Voxel));
          }
        }
      }
    }
    return out;
  }

  void take_frame(std::span<const std::byte> message) {
    last = parser->parse(message);
    ++frames;
    for (const auto& block : parser->blocks()) {
      hash = bridge::with_block(hash, block.id, versions[block.id], block.version, last.session);
      versions[block.id] = block.version;
      blocks[block.id].assign(block.bytes.begin(), block.bytes.end());
    }
    if ((last.flags & bridge::kLastOfPass) != 0) ++passes;
  }

  void take_records(std::span<const std::byte> message) {
    std::array<std::byte, bridge::kMaxRawBytes> scratch;
    const auto records = bridge::parse_records(message, hello->head.session, scratch);
    widest_stride = std::max(widest_stride, records.head.stride);
    const auto append = [&records](auto& to) {
      const std::size_t before = to.size();
      to.resize(before + records.head.count);
      std::memcpy(to.data() + before, records.bytes.data(), records.bytes.size());
    };
    if (records.head.ring == static_cast<std::uint32_t>(bridge::Ring::ticks)) {
      append(ticks);
    } else {
      append(dirty);
    }
  }
};

}  // namespace kerf::test
