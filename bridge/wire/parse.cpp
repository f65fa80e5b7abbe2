// SPDX-License-Identifier: Apache-2.0
#include "bridge/wire/parse.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <iterator>
#include <string>
#include <type_traits>
#include <utility>

#include "bridge/wire/compression.hpp"
#include "shared/volume/brick_grid.hpp"
#include "shared/volume/voxel_grid.hpp"

namespace kerf::bridge {
namespace {

using Bytes = std::span<const std::byte>;

template <class T>
[[nodiscard]] T value_at(Bytes message, std::size_t at) noexcept {
  static_assert(std::is_trivially_copyable_v<T>);
  T value;
  std::memcpy(&value, message.data() + at, sizeof value);
  return value;
}

void require(bool holds, const char* what, std::uint64_t value, const char* expected) {
  if (!holds) {
    throw WireError(std::string("message: ") + what + " = " + std::to_string(value) +
                    "; expected " + expected);
  }
}

/// Checks and returns the head of a message of one kind.
template <class Head>
[[nodiscard]] Head head_of(Bytes message, std::uint32_t magic) {
  require(message.size() <= kMaxMessageBytes, "size", message.size(), "at most 20 KiB");
  require(message.size() >= sizeof(Head), "size", message.size(), "a whole head");
  const Head head = value_at<Head>(message, 0);
  require(head.magic == magic, "magic", head.magic, "that of its kind");
  return head;
}

/// The payload of a message; unpacked into `scratch` if `packed`.
[[nodiscard]] Bytes decoded(Bytes payload, bool packed, std::size_t raw_bytes,
                            std::span<std::byte, kMaxRawBytes> scratch) {
  require(raw_bytes <= kMaxRawBytes, "raw_bytes", raw_bytes, "at most 16 KiB");
  if (!packed) {
    require(payload.size() == raw_bytes, "payload_bytes", payload.size(), "raw_bytes");
    return payload;
  }
  const std::span out = scratch.first(raw_bytes);
  require(unpack(payload, out), "raw_bytes", raw_bytes, "what the LZ4 block decodes to");
  return out;
}

void check_volume(const VolumeDescriptor& volume) {
  require(volume.nx > 0 && volume.ny > 0 && volume.nz > 0, "voxels", 0, "an edge of 1 to 65535");
  require(volume.log2_brick == kBrickLog2, "log2_brick", volume.log2_brick, "3");
  require(volume.bits_per_voxel == 8 * sizeof(Density), "bits", volume.bits_per_voxel, "16");
  const BrickGrid bricks = BrickGrid::of({volume.nx, volume.ny, volume.nz});
  const std::uint64_t count = std::uint64_t{volume.bricks_x} * volume.bricks_y * volume.bricks_z;
  require(std::uint64_t{volume.bricks_x} == static_cast<std::uint32_t>(bricks.bx) &&
              std::uint64_t{volume.bricks_y} == static_cast<std::uint32_t>(bricks.by) &&
              std::uint64_t{volume.bricks_z} == static_cast<std::uint32_t>(bricks.bz) &&
              count == volume.brick_count && count <= kMaxBricks,
          "brick_count", volume.brick_count, "that of the grid, at most 1024^3 voxels");
  const auto finite = [](double number) { return std::isfinite(number); };
  require(std::all_of(std::begin(volume.spacing_mm), std::end(volume.spacing_mm),
                      [](double mm) { return std::isfinite(mm) && mm > 0; }),
          "spacing", 0, "positive numbers");
  require(std::all_of(std::begin(volume.origin_mm), std::end(volume.origin_mm), finite) &&
              std::all_of(std::begin(volume.orientation), std::end(volume.orientation), finite),
          "place", 0, "finite numbers");
  require(volume.off_versions == 0 && volume.off_bricks == 0 && volume.off_labels <= 1, "offset",
          volume.off_labels, "none");
}

}  // namespace

ParsedHello parse_hello(Bytes message) {
  ParsedHello out;
  HelloMessage& head = out.head = head_of<HelloMessage>(message, kHelloMagic);
  require(head.protocol == kProtocol, "protocol", head.protocol, "1");
  require(head.volume_count >= 1 && head.volume_count <= kMaxVolumes, "volumes", head.volume_count,
          "1 to 8");
  require(head.scene_bytes <= kMaxSceneBytes, "scene_bytes", head.scene_bytes, "at most 64 MiB");
  require(head.tick_ns > 0, "tick_ns", head.tick_ns, "a period");
  require(message.size() == sizeof head + head.volume_count * sizeof(VolumeDescriptor), "size",
          message.size(), "a head and its volumes");
  std::end(head.build_id)[-1] = 0;
  for (std::uint32_t i = 0; i < head.volume_count; ++i) {
    out.volumes.push_back(
        value_at<VolumeDescriptor>(message, sizeof head + i * sizeof(VolumeDescriptor)));
    check_volume(out.volumes.back());
  }
  return out;
}

FrameParser::FrameParser(const ParsedHello& hello)
    : plan_(hello.head.scene_bytes, hello.volumes), session_(hello.head.session) {}

FrameHead FrameParser::parse(Bytes message) {
  blocks_.clear();
  const FrameHead head = head_of<FrameHead>(message, kFrameMagic);
  require(head.session == session_, "session", head.session, "that of the greeting");
  require(head.blocks <= kMaxRawBytes / kLabelBlockBytes, "blocks", head.blocks, "at most 32");
  const std::size_t payload_at = sizeof head + head.blocks * kBlockEntryBytes;
  require(message.size() == payload_at + std::uint64_t{head.payload_bytes}, "payload_bytes",
          head.payload_bytes, "the rest of the message");
  const std::size_t ids_at = sizeof head + head.blocks * sizeof(std::uint64_t);
  const Bytes bytes =
      decoded(message.subspan(payload_at), (head.flags & kPacked) != 0, head.raw_bytes, raw_);
  std::vector<Block> blocks;
  std::size_t at = 0;
  for (std::uint32_t i = 0; i < head.blocks; ++i) {
    const auto id = value_at<std::uint32_t>(message, ids_at + i * sizeof(std::uint32_t));
    require(id < plan_.count(), "block", id, "one of the plan");
    const auto version = value_at<std::uint64_t>(message, sizeof head + i * sizeof(std::uint64_t));
    const BlockPlane& plane = plan_.plane_of(id);
    require(version != 0 && version % 2 == 0 &&
                (plane.kind == BlockKind::density || version == kConstantVersion),
            "version", version, "an even one");
    const std::size_t size = plane.block_bytes();
    require(size <= bytes.size() - at, "raw_bytes", head.raw_bytes, "that of the blocks");
    blocks.push_back({id, version, bytes.subspan(at, size)});
    at += size;
  }
  require(at == bytes.size(), "raw_bytes", head.raw_bytes, "that of the blocks");
  blocks_ = std::move(blocks);
  return head;
}

ParsedRecords parse_records(Bytes message, std::uint64_t session,
                            std::span<std::byte, kMaxRawBytes> scratch) {
  const auto head = head_of<RecordsHead>(message, kRecordsMagic);
  require(head.session == session, "session", head.session, "that of the greeting");
  require(head.ring <= static_cast<std::uint32_t>(Ring::pairs), "ring", head.ring, "0 to 2");
  require(head.stride >= 1, "stride", head.stride, "1 or more");
  require(head.raw_bytes == std::uint64_t{head.count} * record_bytes(static_cast<Ring>(head.ring)),
          "raw_bytes", head.raw_bytes, "that of the records");
  require(head.count == 0 || head.first <= UINT64_MAX - std::uint64_t{head.stride} * head.count,
          "first", head.first, "an index");
  require(message.size() == sizeof head + std::uint64_t{head.payload_bytes}, "payload_bytes",
          head.payload_bytes, "the rest of the message");
  return {head, decoded(message.subspan(sizeof head), (head.flags & kPacked) != 0, head.raw_bytes,
                        scratch)};
}

ReplyMessage parse_reply(Bytes message) {
  const auto reply = head_of<ReplyMessage>(message, kReplyMagic);
  require(message.size() == sizeof reply, "size", message.size(), "16");
  return reply;
}

ViewMessage parse_view(Bytes message) {
  const auto view = head_of<ViewMessage>(message, kViewMagic);
  require(message.size() == sizeof view, "size", message.size(), "80");
  return view;
}

std::uint32_t magic_of(Bytes message) noexcept {
  return message.size() < sizeof(std::uint32_t) ? 0 : value_at<std::uint32_t>(message, 0);
}

std::optional<std::variant<AckMessage, CommandMessage, ViewMessage>> parse_up(
    Bytes message) noexcept {
  if (magic_of(message) == kAckMagic && message.size() == sizeof(AckMessage)) {
    return value_at<AckMessage>(message, 0);
  }
  if (magic_of(message) == kCommandMagic && message.size() == sizeof(CommandMessage)) {
    return value_at<CommandMessage>(message, 0);
  }
  if (magic_of(message) == kViewMagic && message.size() == sizeof(ViewMessage)) {
    return value_at<ViewMessage>(message, 0);
  }
  return std::nullopt;
}

}  // namespace kerf::bridge
