// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>
#include <vector>

#include "bridge/wire/compression.hpp"
#include "bridge/wire/messages.hpp"
#include "shared/segment/layout_table.hpp"
#include "shared/volume/brick_grid.hpp"

namespace kerf::bridge::test {

using Message = std::vector<std::byte>;

template <class T>
void append(Message& to, const T& value) {
  const auto* const bytes = reinterpret_cast<const std::byte*>(&value);
  to.insert(to.end(), bytes, bytes + sizeof value);
}

/// A server's messages by hand, of a run that a test invents: no segment, no snapshot, no credit.
struct Sender {
  HelloMessage hello{};
  std::vector<VolumeDescriptor> volumes;
  std::vector<std::uint64_t> sent;
  std::uint64_t set_hash = 0;
  std::uint64_t frame = 0;
  FrameHead next{};  ///< taken_ns, heartbeat_ns, lifecycle, sent_ns, as the next frame has them
  bool packed = false;

  /// One volume of `edge`^3 voxels and a scene of `scene_bytes`.
  explicit Sender(std::uint64_t session, std::uint16_t edge = 16, std::uint32_t scene_bytes = 1500,
                  bool labels = false) {
    hello = {.magic = kHelloMagic,
             .protocol = kProtocol,
             .session = session,
             .config_hash = 5,
             .abi_hash = kAbiHash,
             .layout_major = kLayoutMajor,
             .layout_minor = kLayoutMinor,
             .tick_ns = 1'000'000,
             .flags = 0,
             .server_ns = 0,
             .start_ns = 0,
             .volume_count = 1,
             .record_bytes = sizeof(TickRecord),
             .dirty_bytes = sizeof(DirtyRecord),
             .scene_bytes = scene_bytes,
             .build_id = "far"};
    VolumeDescriptor volume{};
    volume.nx = volume.ny = volume.nz = edge;
    volume.log2_brick = kBrickLog2;
    volume.bits_per_voxel = 16;
    const BrickGrid bricks = BrickGrid::of({edge, edge, edge});
    volume.bricks_x = volume.bricks_y = volume.bricks_z = static_cast<std::uint32_t>(bricks.bx);
    volume.brick_count = bricks.count();
    for (double& mm : volume.spacing_mm) mm = 0.1;
    volume.orientation[3] = 1;
    volume.off_labels = labels ? 1 : 0;
    volumes = {volume};
    sent.resize(text_blocks() + (labels ? 2 : 1) * std::size_t{volume.brick_count});
  }
  [[nodiscard]] std::uint32_t text_blocks() const { return (hello.scene_bytes + 1023) / 1024; }
  [[nodiscard]] std::uint32_t bricks() const { return volumes[0].brick_count; }

  /// The first message of a connection, which holds nothing.
  [[nodiscard]] Message greeting() {
    sent.assign(sent.size(), 0);
    set_hash = frame = 0;
    Message out;
    append(out, hello);
    for (const VolumeDescriptor& volume : volumes) append(out, volume);
    return out;
  }

  /// A frame of `blocks` (id, version), whose bytes all are the low byte of the version.
  [[nodiscard]] Message frame_of(const std::vector<std::pair<std::uint32_t, std::uint64_t>>& blocks,
                                 std::uint64_t tick, std::uint32_t flags) {
    Message payload, out;
    for (const auto& [id, version] : blocks) {
      const bool label = id >= text_blocks() + bricks();
      payload.insert(payload.end(), label ? 512 : 1024, static_cast<std::byte>(version));
      set_hash = with_block(set_hash, id, sent[id], version, hello.session);
      sent[id] = version;
    }
    FrameHead head = next;
    head.raw_bytes = static_cast<std::uint32_t>(payload.size());
    if (packed) {
      Message small(packed_bound(payload.size()));
      small.resize(pack(payload, small));
      payload = std::move(small);
      flags |= kPacked;
    }
    head.magic = kFrameMagic;
    head.flags = flags;
    head.session = hello.session;
    head.frame = ++frame;
    head.tick = tick;
    head.set_hash = set_hash;
    head.blocks = static_cast<std::uint32_t>(blocks.size());
    head.payload_bytes = static_cast<std::uint32_t>(payload.size());
    append(out, head);
    for (const auto& [id, version] : blocks) append(out, version);
    for (const auto& [id, version] : blocks) append(out, id);
    out.insert(out.end(), payload.begin(), payload.end());
    return out;
  }

  /// All blocks at the versions of `tick` (text and labels at theirs), as one pass of frames.
  [[nodiscard]] std::vector<Message> whole_pass(std::uint64_t tick, std::uint32_t last_flags = 0) {
    std::vector<Message> out;
    std::vector<std::pair<std::uint32_t, std::uint64_t>> blocks;
    for (std::uint32_t id = 0; id < sent.size(); ++id) {
      const bool brick = id >= text_blocks() && id < text_blocks() + bricks();
      blocks.emplace_back(id, brick ? stable_version(tick) : 2);
      const bool last = id + 1 == sent.size();
      if (blocks.size() < 16 && !last) continue;
      out.push_back(frame_of(std::exchange(blocks, {}), tick, last ? kLastOfPass | last_flags : 0));
    }
    return out;
  }

  /// One tick record of `index`, whose tick is index + 1.
  [[nodiscard]] Message record(std::uint64_t index, std::uint64_t start_ns) const {
    TickRecord record{};
    record.tick = index + 1;
    record.start_ns = start_ns;
    Message out;
    append(out, RecordsHead{.magic = kRecordsMagic,
                            .flags = 0,
                            .session = hello.session,
                            .ring = 0,
                            .count = 1,
                            .first = index,
                            .stride = 1,
                            .raw_bytes = sizeof record,
                            .payload_bytes = sizeof record,
                            .reserved = 0});
    append(out, record);
    return out;
  }
};

}  // namespace kerf::bridge::test
