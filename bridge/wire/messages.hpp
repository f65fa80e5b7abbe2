// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <span>
#include <vector>

#include "shared/segment/layout.hpp"
#include "shared/segment/presented_view.hpp"

namespace kerf::bridge {

/// The protocol between a bridge and its viewers, version 1, byte by byte.
///
///     server to viewer   HelloMessage (first, and again for a new run), FrameHead + blocks,
///                        RecordsHead + records, ReplyMessage, ViewMessage
///     viewer to server   AckMessage (for each frame, once it is applied), CommandMessage,
///     ViewMessage
///
/// Each is one binary WebSocket message of at most `kMaxMessageBytes`, little-endian, naturally
/// aligned. Times are CLOCK_MONOTONIC of the server's machine, in ns.
///
/// A *pass* is the changes between two snapshots of the segment, in one or more *frames*. After the
/// last frame of a pass, a viewer whose set hash equals that of the frame holds exactly the volumes
/// of `tick`. If nothing changed, the pass is one empty frame, which shows that the server is
/// alive.

inline constexpr std::uint32_t kProtocol = 1;
inline constexpr std::size_t kMaxMessageBytes = 20 * 1024;  ///< server to viewer
inline constexpr std::size_t kMaxRawBytes = 16 * 1024;      ///< payload, unpacked
inline constexpr std::size_t kMaxUpBytes = 256;             ///< viewer to server
inline constexpr const char* kBridgePath = "/bridge";       ///< path of the WebSocket

/// Four characters in memory order.
[[nodiscard]] constexpr std::uint32_t magic(const char (&text)[5]) noexcept {
  std::uint32_t value = 0;
  for (std::size_t i = 4; i-- > 0;) value = value << 8 | static_cast<unsigned char>(text[i]);
  return value;
}
inline constexpr std::uint32_t kHelloMagic = magic("KBH1");
inline constexpr std::uint32_t kFrameMagic = magic("KBF1");
inline constexpr std::uint32_t kRecordsMagic = magic("KBS1");
inline constexpr std::uint32_t kReplyMagic = magic("KBR1");
inline constexpr std::uint32_t kAckMagic = magic("KBA1");
inline constexpr std::uint32_t kCommandMagic = magic("KBC1");

inline constexpr std::uint32_t kViewMagic = magic("KBV1");

inline constexpr std::uint32_t kMayCommand = 1;  ///< HelloMessage::flags
inline constexpr std::uint32_t kTwoArms = 2;  ///< HelloMessage::flags: Ring::pairs instead of ticks
inline constexpr std::uint32_t kPacked = 1;   ///< of frames and records: LZ4 payload
inline constexpr std::uint32_t kLastOfPass = 2;  ///< FrameHead::flags
inline constexpr std::uint32_t kRunEnded = 4;    ///< FrameHead::flags: the controller has gone

/// WebSocket status code with which the server closes a connection.
enum class CloseCode : std::uint16_t {
  no_token = 4001,
  too_slow = 4002,
  not_understood = 4003,
  too_many = 4004,
};

/// The constants of a run. The viewer discards all blocks that it holds. `volume_count` times
/// `VolumeDescriptor` follows, with `off_labels` 1 if there are labels, and all other offsets 0.
struct HelloMessage {
  std::uint32_t magic;
  std::uint32_t protocol;  ///< version of this protocol
  std::uint64_t session;   ///< session of the run: `SegmentHeader::session_id`
  std::uint64_t config_hash;
  std::uint64_t abi_hash;      ///< hash of the layout; readers of records need an equal one
  std::uint32_t layout_major;  ///< major layout version; readers of records need an equal one
  std::uint32_t layout_minor;  ///< minor layout version; readers of records need an equal one
  std::uint32_t tick_ns;
  std::uint32_t flags;
  std::int64_t server_ns;  ///< time when the message was written
  std::uint64_t start_ns;  ///< start of the run; 0 in lock-step
  std::uint32_t volume_count;
  std::uint32_t record_bytes;  ///< sizeof(TickRecord)
  std::uint32_t dirty_bytes;   ///< sizeof(DirtyRecord)
  std::uint32_t scene_bytes;
  char build_id[64];
};
static_assert(sizeof(HelloMessage) == 144);

/// u64 version[blocks], u32 id[blocks] and the payload follow: the blocks in that order.
struct FrameHead {
  std::uint32_t magic;
  std::uint32_t flags;
  std::uint64_t session;
  std::uint64_t frame;    ///< number of the frame since the hello: 1, 2, ...
  std::uint64_t tick;     ///< tick of the pass
  std::int64_t taken_ns;  ///< time when the snapshot of the pass was taken
  std::int64_t heartbeat_ns;
  std::uint64_t set_hash;  ///< over all blocks that the viewer holds after this frame
  std::uint32_t lifecycle;
  std::uint32_t blocks;
  std::uint32_t raw_bytes;
  std::uint32_t payload_bytes;
  std::int64_t sent_ns;
};
static_assert(sizeof(FrameHead) == 80);
inline constexpr std::size_t kBlockEntryBytes = sizeof(std::uint64_t) + sizeof(std::uint32_t);

/// A run of two arms has `pairs` instead of `ticks`: the first arm's record of a tick, then the
/// second's of the same tick.
enum class Ring : std::uint32_t { ticks = 0, dirty = 1, pairs = 2 };

/// The payload follows: `count` records of the ring as in the segment. Record i has the index
/// `first + i * stride`. On a slow link the stride is above 1; the newest record is always sent.
struct RecordsHead {
  std::uint32_t magic;
  std::uint32_t flags;
  std::uint64_t session;
  std::uint32_t ring;
  std::uint32_t count;
  std::uint64_t first;
  std::uint32_t stride;
  std::uint32_t raw_bytes;
  std::uint32_t payload_bytes;
  std::uint32_t reserved;
};
static_assert(sizeof(RecordsHead) == 48);
[[nodiscard]] constexpr std::size_t record_bytes(Ring ring) noexcept {
  return ring == Ring::dirty   ? sizeof(DirtyRecord)
         : ring == Ring::pairs ? 2 * sizeof(TickRecord)
                               : sizeof(TickRecord);
}

/// Reply to one command.
struct ReplyMessage {
  std::uint32_t magic;
  std::uint32_t sequence;  ///< number of the command that is answered
  std::uint32_t status;    ///< ReplyStatus
  std::uint32_t index;     ///< Reply::index
};
static_assert(sizeof(ReplyMessage) == 16);

/// Sent when a frame has been applied.
struct AckMessage {
  std::uint32_t magic;
  std::uint32_t reserved;
  std::uint64_t session;
  std::uint64_t frame;
};
static_assert(sizeof(AckMessage) == 24);

/// `SegmentCommand` of a viewer.
struct CommandMessage {
  std::uint32_t magic;
  std::uint16_t kind;  ///< CommandKind
  std::uint16_t arm;   ///< arm of `select_tool`: 0 the first, 1 the second; other kinds: 0
  std::uint32_t argument;
  std::uint32_t sequence;  ///< chosen by the viewer; the reply repeats it
};
static_assert(sizeof(CommandMessage) == 16);

/// The view that one viewer presents to those who follow it (shared/segment/presented_view.hpp).
/// From the server when it changes, and to a viewer that comes later; none before anybody has
/// presented. From a viewer with the right to command: its own view, or that it presents no longer.
struct ViewMessage {
  std::uint32_t magic;
  std::uint32_t presenter;  ///< from the server: 0 nobody, 1 another viewer, 2 the receiver; from a
                            ///< viewer: 1 the viewer presents, 0 it presents no longer
  double eye_mm[3];         ///< position of the eye in the world; if nobody presents, the last one
  double target_mm[3];      ///< position in the world at the middle of the picture
  double up[3];             ///< direction in the world that is upright in the picture
};
static_assert(sizeof(ViewMessage) == 80);
enum class Presenter : std::uint32_t { nobody = 0, another = 1, receiver = 2 };

[[nodiscard]] inline ViewMessage view_message(Presenter who, const PresentedView& view) noexcept {
  ViewMessage message{kViewMagic, static_cast<std::uint32_t>(who), {}, {}, {}};
  static_assert(sizeof message == offsetof(ViewMessage, eye_mm) + sizeof view);
  std::memcpy(message.eye_mm, view.eye_mm, sizeof message.eye_mm);
  std::memcpy(message.target_mm, view.target_mm, sizeof message.target_mm);
  std::memcpy(message.up, view.up, sizeof message.up);
  return message;
}
/// It may be none (`is_valid`).
[[nodiscard]] inline PresentedView view_in(const ViewMessage& message) noexcept {
  PresentedView view;
  std::memcpy(view.eye_mm, message.eye_mm, sizeof view.eye_mm);
  std::memcpy(view.target_mm, message.target_mm, sizeof view.target_mm);
  std::memcpy(view.up, message.up, sizeof view.up);
  return view;
}

/// Contribution of one held block to the set hash, which is the sum of all contributions mod 2^64.
/// So the order of blocks does not matter, and a new version of a block changes one term. Different
/// sets have equal hashes as rarely as two random 64-bit numbers are equal.
[[nodiscard]] constexpr std::uint64_t block_hash(std::uint32_t id, std::uint64_t version,
                                                 std::uint64_t session) noexcept {
  std::uint64_t z = (version ^ session) * 0x9e3779b97f4a7c15 + id * 0xd1342543de82ef95 + 1;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
  z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
  return z ^ (z >> 31);
}

/// The set hash after block `id` changes from version `old` (0: not held) to `version`.
[[nodiscard]] constexpr std::uint64_t with_block(std::uint64_t hash, std::uint32_t id,
                                                 std::uint64_t old, std::uint64_t version,
                                                 std::uint64_t session) noexcept {
  if (old != 0) hash -= block_hash(id, old, session);
  return hash + block_hash(id, version, session);
}

inline constexpr std::size_t kTextBlockBytes = 1024;
inline constexpr std::size_t kDensityBlockBytes = 1024;  ///< a brick: 512 densities, x fastest
inline constexpr std::size_t kLabelBlockBytes = 512;     ///< labels of a brick, u8, x fastest
inline constexpr std::uint64_t kConstantVersion = 2;     ///< version of text and label blocks

enum class BlockKind : std::uint8_t { text, density, labels };

/// Consecutive blocks of one kind.
struct BlockPlane {
  BlockKind kind;
  std::uint32_t volume;  ///< for density and labels
  std::uint32_t first;   ///< number of the first block
  std::uint32_t count;
  [[nodiscard]] std::size_t block_bytes() const noexcept {
    return kind == BlockKind::labels ? kLabelBlockBytes : kDensityBlockBytes;
  }
};

/// Numbers of all blocks that a viewer holds, in this order: scene text (the last block is padded
/// with zeros), the densities of each volume, the labels of each volume that has them. Bricks of a
/// volume are in the order of `BrickGrid`.
class BlockPlan {
 public:
  BlockPlan() = default;
  /// Uses `brick_count` and `off_labels` (0: no labels) of `volumes`.
  BlockPlan(std::uint32_t scene_bytes, std::span<const VolumeDescriptor> volumes);

  [[nodiscard]] const std::vector<BlockPlane>& planes() const noexcept { return planes_; }
  [[nodiscard]] std::uint32_t count() const noexcept { return count_; }
  /// The plane that contains block `id`, which is below `count()`.
  [[nodiscard]] const BlockPlane& plane_of(std::uint32_t id) const noexcept;

 private:
  void add(BlockKind kind, std::uint32_t volume, std::uint32_t count);

  std::vector<BlockPlane> planes_;
  std::uint32_t count_ = 0;
};

inline BlockPlan::BlockPlan(std::uint32_t scene_bytes, std::span<const VolumeDescriptor> volumes) {
  constexpr auto kText = static_cast<std::uint32_t>(kTextBlockBytes);
  add(BlockKind::text, 0, scene_bytes / kText + (scene_bytes % kText != 0 ? 1 : 0));
  const auto each = [&](BlockKind kind, auto wanted) {
    for (std::uint32_t i = 0; i < volumes.size(); ++i) {
      if (wanted(volumes[i])) add(kind, i, volumes[i].brick_count);
    }
  };
  each(BlockKind::density, [](const VolumeDescriptor&) { return true; });
  each(BlockKind::labels, [](const VolumeDescriptor& volume) { return volume.off_labels != 0; });
}

inline void BlockPlan::add(BlockKind kind, std::uint32_t volume, std::uint32_t count) {
  if (count == 0) return;
  planes_.push_back({kind, volume, count_, count});
  count_ += count;
}

inline const BlockPlane& BlockPlan::plane_of(std::uint32_t id) const noexcept {
  const auto after = std::upper_bound(
      planes_.begin(), planes_.end(), id,
      [](std::uint32_t wanted, const BlockPlane& plane) { return wanted < plane.first; });
  return *std::prev(after);
}

}  // namespace kerf::bridge
