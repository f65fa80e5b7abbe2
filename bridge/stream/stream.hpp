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

/// What a link has shown to deliver, and how many bytes may be under way on it.
///
/// The rate of an ack is what was acknowledged since its frame was sent, over that time; the
/// highest of the last `kSamples` counts, since a sender with little to say delivers less than the
/// link could. Twice rate times round trip is under way when the link is full and acks come in
/// clumps; one frame more starts it. The round trip is the kernel's least one, because that of an
/// ack contains the sending time of its frame, and would let a queue grow that it then measures.
///
/// Bytes, not frames: a packed frame is a quarter of a plain one, and a window of so many frames
/// would be as much smaller, just when the link is what holds a pass up.
///
/// `now_ns` never falls. One thread.
class LinkRate {
 public:
  static constexpr std::size_t kSamples = 32;
  /// One frame is applied while the next is on its way, however large they are.
  static constexpr std::size_t kLeastFrames = 2;
  /// Until a program has its turn on a processor, applies a frame and answers. It counts on a quick
  /// link only, whose join is a sixth shorter for it; at 4 Mbit/s it is 1 KiB of the window.
  static constexpr std::int64_t kTurnNs = 1'000'000;
  /// Of which a link of more than 13 MB/s at a round trip of 40 ms waits for acks.
  static constexpr std::size_t kMostBytes = 32 * kMaxRawBytes;

  void set_round_trip(std::int64_t least_ns) noexcept { round_trip_ns_ = least_ns; }

  /// What is sent beside frames.
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
  /// The reader outlives this. `ring` is one that a run of so many arms has.
  RecordBatches(const SegmentReader& reader, Ring ring) noexcept : reader_(reader), ring_(ring) {}

  /// Of what was published since, at most `records` (and 1 at least) are to go out until the next
  /// call.
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

/// The messages to one viewer of one run: the greeting, then passes in frames, and records. Without
/// a network: the caller takes the next message whenever it can send one.
///
/// Volumes and records share the link. While a pass is under way the link is what holds it up, and
/// records take at most `kRecordShare` of what it delivers; else they take what they need.
///
/// One thread. The snapshot outlives this.
class Stream {
 public:
  /// Of the delivered bytes. A quarter is a state every 4 ms on 4 Mbit/s, and lets a pass take a
  /// third longer at most.
  static constexpr double kRecordShare = 0.25;
  /// The bridge may be late by so many slots (133 ms), and all records still go; a link that falls
  /// further behind gets fewer, so that those it gets are new.
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

  /// False if the viewer answers what it was never sent. An ack of another run is passed over.
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

  double record_bytes_ = 0;  // that records may take yet, while a pass is under way

  LinkRate link_;
  PackChoice pack_choice_;
  std::vector<std::byte> raw_;
  RecordBatches ticks_, dirty_;
};

}  // namespace kerf::bridge
