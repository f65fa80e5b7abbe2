// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "shared/segment/layout.hpp"

namespace kerf::bridge {

/// The talk of a bridge and its viewer, version 1, byte by byte.
///
///     server to viewer   HelloMessage (first, and again for a new run), FrameHead + blocks,
///                        RecordsHead + records, ReplyMessage
///     viewer to server   AckMessage (one per frame, once it is applied), CommandMessage
///
/// Each is one binary WebSocket message of at most `kMaxMessageBytes`, little-endian, naturally
/// aligned. Times are CLOCK_MONOTONIC of the server's machine, in ns.
///
/// A *pass* is what changed between two snapshots of the segment, cut into *frames*. At the last
/// frame of a pass a viewer whose set hash is the frame's holds exactly the volumes of `tick`. An
/// empty pass is the sign of life.

inline constexpr std::uint32_t kProtocol = 1;
inline constexpr std::size_t kMaxMessageBytes = 20 * 1024;  ///< server to viewer
inline constexpr std::size_t kMaxRawBytes = 16 * 1024;      ///< of a frame's blocks, of records
inline constexpr std::size_t kMaxUpBytes = 256;             ///< viewer to server
inline constexpr const char* kBridgePath = "/bridge";       ///< of the WebSocket

/// Four characters as they lie in memory.
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

inline constexpr std::uint32_t kMayCommand = 1;  ///< HelloMessage::flags
inline constexpr std::uint32_t kPacked = 1;      ///< of frames and records: one LZ4 block
inline constexpr std::uint32_t kLastOfPass = 2;  ///< FrameHead::flags
inline constexpr std::uint32_t kRunEnded = 4;    ///< FrameHead::flags: the controller has gone

/// What is told when a connection is closed.
enum class CloseCode : std::uint16_t {
  no_token = 4001,
  too_slow = 4002,
  not_understood = 4003,
  too_many = 4004,
};

/// What never changes in a run; all that the viewer holds is void. `volume_count` descriptors of
/// the segment follow, in which `off_labels` is 1 where there are labels and the other offsets are
/// 0.
struct HelloMessage {
  std::uint32_t magic;
  std::uint32_t protocol;
  std::uint64_t session;
  std::uint64_t config_hash;
  std::uint64_t abi_hash;
  std::uint32_t layout_major;
  std::uint32_t layout_minor;
  std::uint32_t tick_ns;
  std::uint32_t flags;
  std::int64_t server_ns;  ///< now
  std::uint64_t start_ns;  ///< of the run
  std::uint32_t volume_count;
  std::uint32_t record_bytes;  ///< sizeof(TickRecord)
  std::uint32_t dirty_bytes;   ///< sizeof(DirtyRecord)
  std::uint32_t scene_bytes;
  char build_id[64];
};
static_assert(sizeof(HelloMessage) == 144);

/// Then u64 version[blocks], u32 id[blocks], and the payload: the blocks in that order.
struct FrameHead {
  std::uint32_t magic;
  std::uint32_t flags;
  std::uint64_t session;
  std::uint64_t frame;  ///< 1, 2, ...
  std::uint64_t tick;
  std::int64_t taken_ns;  ///< when the snapshot of the pass was taken
  std::int64_t heartbeat_ns;
  std::uint64_t set_hash;  ///< of all that the viewer holds after this frame (set_hash.hpp)
  std::uint32_t lifecycle;
  std::uint32_t blocks;
  std::uint32_t raw_bytes;
  std::uint32_t payload_bytes;
  std::int64_t sent_ns;
};
static_assert(sizeof(FrameHead) == 80);
inline constexpr std::size_t kBlockEntryBytes = sizeof(std::uint64_t) + sizeof(std::uint32_t);

enum class Ring : std::uint32_t { ticks = 0, dirty = 1 };

/// Then the payload: `count` records of the ring as they lie in the segment. Record i has the index
/// `first + i * stride`; what is left out a slow link could not bear. The newest always comes.
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
  return ring == Ring::ticks ? sizeof(TickRecord) : sizeof(DirtyRecord);
}

struct ReplyMessage {
  std::uint32_t magic;
  std::uint32_t sequence;  ///< of the command
  std::uint32_t status;    ///< ReplyStatus
  std::uint32_t index;     ///< Reply::index
};
static_assert(sizeof(ReplyMessage) == 16);

struct AckMessage {
  std::uint32_t magic;
  std::uint32_t reserved;
  std::uint64_t session;
  std::uint64_t frame;
};
static_assert(sizeof(AckMessage) == 24);

struct CommandMessage {
  std::uint32_t magic;
  std::uint32_t kind;  ///< CommandKind
  std::uint32_t argument;
  std::uint32_t sequence;  ///< chosen by the viewer
};
static_assert(sizeof(CommandMessage) == 16);

}  // namespace kerf::bridge
