// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "bridge/stream/run_snapshot.hpp"
#include "bridge/wire/compression.hpp"
#include "bridge/wire/messages.hpp"
#include "shared/segment/reader.hpp"

namespace kerf::bridge {

/// The measured delivery rate of a link, and the window: how many bytes may be in flight on it.
///
/// Each ack gives a delivery rate: the bytes acknowledged since its frame was sent, over the time
/// since the last ack before that sending. The maximum of the last `kSamples` is used, because an
/// idle sender underestimates the link. Window = twice the bandwidth-delay product plus one frame:
/// twice, because acks arrive in bursts; the frame allows the first measurement. The round trip is
/// the kernel's minimum RTT: an ack's own RTT includes the frame's sending time and would measure
/// the queue it creates.
///
/// The window counts bytes, not frames: a packed frame has a quarter of the bytes of a plain one,
/// so a window in frames would shrink by as much, just when the link limits a pass.
///
/// `now_ns` never decreases. One thread.
class LinkRate {
 public:
  static constexpr std::size_t kSamples = 32;
  /// Frames that are always allowed in flight, whatever their size: one is applied while the next
  /// arrives.
  static constexpr std::size_t kLeastFrames = 2;
  /// Allowance for the receiver to be scheduled, apply a frame and answer. It matters on fast links
  /// only (a join takes a sixth less time); at 4 Mbit/s it adds 1 KiB to the window.
  static constexpr std::int64_t kTurnNs = 1'000'000;
  /// Upper limit of the window. At a round trip of 40 ms it limits links faster than 13 MB/s, which
  /// then wait for acks.
  static constexpr std::size_t kMostBytes = 32 * kMaxRawBytes;

  void set_round_trip(std::int64_t least_ns) noexcept { round_trip_ns_ = least_ns; }

  /// Counts bytes that are sent outside frames.
  void sent(std::size_t bytes) noexcept { bytes_sent_ += bytes; }
  void sent_frame(std::uint64_t frame, std::size_t bytes, std::int64_t now_ns);
  /// All frames up to `frame` have been applied.
  void acked(std::uint64_t frame, std::int64_t now_ns);

  [[nodiscard]] bool has_credit() const noexcept {
    return flight_.size() < kLeastFrames || flight_.back().bytes_with - bytes_acked_ < window();
  }
  [[nodiscard]] bool waits_for_ack() const noexcept { return !flight_.empty(); }
  /// Bytes.
  [[nodiscard]] std::size_t window() const noexcept;
  /// 0: nothing was acknowledged yet.
  [[nodiscard]] double bytes_per_s() const noexcept;

 private:
  struct Flight {
    std::uint64_t frame;
    std::uint64_t bytes_before;  // acknowledged when it was sent
    std::uint64_t bytes_with;    // sent up to its end
    std::int64_t since_ns;
  };

  std::deque<Flight> flight_;
  std::array<double, kSamples> bytes_per_ns_{};
  std::size_t next_sample_ = 0;
  std::uint64_t bytes_acked_ = 0, bytes_sent_ = 0;
  std::int64_t acked_ns_ = 0, round_trip_ns_ = 0;
};

/// The records of one ring, in messages of at most `kMaxRawBytes`, from the newest at the start on.
/// If the link is too slow for all of them, every n-th is sent, and always the newest.
class RecordBatches {
 public:
  /// The reader outlives this. `ring` must be one that a run with this number of arms has.
  RecordBatches(const SegmentReader& reader, Ring ring) noexcept : reader_(reader), ring_(ring) {}

  /// Plans to send at most `records` (at least 1) of the records published since then, until the
  /// next call.
  void plan(std::uint64_t records) noexcept;
  [[nodiscard]] bool waiting() const noexcept { return next_ < end_; }

  /// The next message, packed if that pays on a link of `bytes_per_s`. False, and `out` is
  /// empty, if the records were overwritten meanwhile.
  bool write(double bytes_per_s, std::vector<std::byte>& out);

  [[nodiscard]] Ring ring() const noexcept { return ring_; }
  /// Raw bytes per packed one.
  [[nodiscard]] double ratio() const noexcept { return pack_choice_.ratio(); }

 private:
  [[nodiscard]] bool read(std::uint64_t index, std::vector<std::byte>& out) const;

  const SegmentReader& reader_;
  Ring ring_;
  bool started_ = false;
  std::uint64_t next_ = 0, end_ = 0;
  std::uint32_t stride_ = 1;
  PackChoice pack_choice_;
  std::vector<std::byte> raw_;
};

/// Interval at which a pass may begin and records are sent.
inline constexpr std::int64_t kSlotNs = 16'666'667;

/// The messages to one viewer of one run: the greeting, then passes in frames, and records. It uses
/// no network: the caller takes the next message whenever it can send one.
///
/// Volumes and records use the same link. During a pass the link is the bottleneck, and records
/// take at most `kRecordShare` of its rate; otherwise they take what they need.
///
/// One thread. The snapshot outlives this.
class Stream {
 public:
  /// Fraction of the delivered bytes for records during a pass. A quarter is one state every 4 ms
  /// at 4 Mbit/s, and makes a pass at most a third longer.
  static constexpr double kRecordShare = 0.25;
  /// If the bridge is late by up to this many slots (133 ms), all records are still sent; a link
  /// that falls further behind gets fewer, so that those it gets are recent.
  static constexpr std::uint64_t kSlotsBehind = 8;

  /// `flags` of the greeting.
  Stream(RunSnapshot& snapshot, std::uint32_t flags);
  ~Stream();
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  /// After each `RunSnapshot::update`, for every stream.
  void note_changes();
  /// Every `kSlotNs`, after that. `ended`: the controller has gone.
  void slot(std::int64_t now_ns, bool ended);

  /// The next message, if there is one and the link has credit for it.
  bool next(std::int64_t now_ns, std::vector<std::byte>& out);

  /// False if the viewer acknowledges a frame that was never sent. An ack of another run is
  /// ignored.
  [[nodiscard]] bool acked(const AckMessage& ack, std::int64_t now_ns);

  /// The kernel's least round trip.
  void set_round_trip(std::int64_t least_ns) noexcept { link_.set_round_trip(least_ns); }

  [[nodiscard]] const LinkRate& link() const noexcept { return link_; }
  /// True while blocks of the pass have yet to be sent.
  [[nodiscard]] bool in_pass() const noexcept { return sent_of_pass_ < pass_.size(); }

 private:
  struct Entry {
    std::uint32_t id;
    std::uint64_t version;
  };

  void write_hello(std::int64_t now_ns, std::vector<std::byte>& out);
  bool next_records(RecordBatches& ring, std::vector<std::byte>& out);
  bool next_frame(std::int64_t now_ns, std::vector<std::byte>& out);
  void begin_pass();
  void write_frame(std::int64_t now_ns, std::vector<std::byte>& out);
  /// Takes entries of the pass into `raw_`, up to `kMaxRawBytes`. Returns how many.
  std::size_t take_blocks();

  RunSnapshot& snapshot_;
  std::uint32_t flags_;
  std::uint64_t session_;
  bool greeted_ = false, ended_ = false, pass_due_ = false, opened_ = false;
  // Ticks, dirty boxes and frames in round-robin order, so that none of them can fill a slow link.
  static constexpr int kSources = 3;
  int next_source_ = 0;

  std::vector<std::uint64_t> held_;     // version by block, 0: none
  std::vector<std::uint32_t> waiting_;  // for the next pass
  std::vector<bool> is_waiting_;
  std::vector<Entry> pass_;
  std::size_t sent_of_pass_ = 0;
  Tick pass_tick_ = 0;
  std::int64_t pass_taken_ns_ = 0, slot_ns_ = 0;
  std::uint64_t frame_ = 0, set_hash_ = 0;

  double record_bytes_ = 0;  // that records may still take during the pass

  LinkRate link_;
  PackChoice pack_choice_;
  std::vector<std::byte> raw_;
  RecordBatches ticks_, dirty_;
};

}  // namespace kerf::bridge
