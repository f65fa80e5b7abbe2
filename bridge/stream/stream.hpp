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

/// Measures the delivery rate of a link and limits the bytes in flight to a window.
///
/// Each ack gives one sample of the rate: the bytes acknowledged since its frame was sent, divided
/// by the time since the last ack before that. The rate is the maximum of the last `kSamples`,
/// because samples of an idle sender are too low. Window = twice the bandwidth-delay product plus
/// one frame: twice, because acks arrive in bursts; one frame, so that the first measurement is
/// possible. The delay is the kernel's minimum RTT. The RTT of an ack would include the time to
/// send the frame, and so the queue that the window itself creates.
///
/// The window counts bytes, not frames. A packed frame has a quarter of the bytes of a plain one,
/// so a window in frames would shrink to a quarter just when the link limits a pass.
///
/// `now_ns` never decreases. One thread.
class LinkRate {
 public:
  static constexpr std::size_t kSamples = 32;
  /// Frames that are always allowed in flight, of any size: one is applied while the next arrives.
  static constexpr std::size_t kLeastFrames = 2;
  /// Added to the round trip: time for the receiver to be scheduled, apply a frame and reply. It
  /// matters on fast links only (a join takes a sixth less time); at 4 Mbit/s it adds 1 KiB.
  static constexpr std::int64_t kTurnNs = 1'000'000;
  /// Upper limit of the window. With a round trip of 40 ms it limits the rate to 13 MB/s.
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
  /// Bytes that may be in flight.
  [[nodiscard]] std::size_t window() const noexcept;
  /// 0 before the first ack.
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

/// Sends the records of one ring in messages of at most `kMaxRawBytes`, starting with the newest at
/// the first `plan`. If the link is too slow for all, sends every n-th, and always the newest.
class RecordBatches {
 public:
  /// `reader` outlives this. `ring` is `pairs` for two arms, `ticks` for one, or `dirty`.
  RecordBatches(const SegmentReader& reader, Ring ring) noexcept : reader_(reader), ring_(ring) {}

  /// Selects what to send until the next call: at most `records` (at least 1) of the records that
  /// are not sent yet.
  void plan(std::uint64_t records) noexcept;
  [[nodiscard]] bool waiting() const noexcept { return next_ < end_; }

  /// Writes the next message to `out`, packed if that is faster on a link of `bytes_per_s`. Returns
  /// false, with `out` empty, if the records have been overwritten.
  bool write(double bytes_per_s, std::vector<std::byte>& out);

  [[nodiscard]] Ring ring() const noexcept { return ring_; }
  /// Raw bytes per packed byte.
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

/// Interval at which passes may begin and records are sent: 60 Hz.
inline constexpr std::int64_t kSlotNs = 16'666'667;

/// Makes the messages to one viewer of one run: the hello, then frames and records. Uses no
/// network: the caller calls `next` whenever it can send a message.
///
/// Volumes and records share the link. During a pass, which uses all of the link, records get at
/// most the fraction `kRecordShare` of its rate; at other times all records are sent.
///
/// One thread. The snapshot outlives this.
class Stream {
 public:
  /// Fraction of the delivery rate for records during a pass. A quarter allows one tick record
  /// every 4 ms at 4 Mbit/s, and makes a pass at most a third longer.
  static constexpr double kRecordShare = 0.25;
  /// All records are sent while at most this many slots (133 ms) of them wait. If more wait, some
  /// are skipped, so that those that are sent are recent.
  static constexpr std::uint64_t kSlotsBehind = 8;

  /// `flags`: of the hello; `kTwoArms` is added if needed.
  Stream(RunSnapshot& snapshot, std::uint32_t flags);
  ~Stream();
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  /// Call for every stream after each `RunSnapshot::update`.
  void note_changes();
  /// Call every `kSlotNs`, after `note_changes`. `ended`: the controller has gone.
  void slot(std::int64_t now_ns, bool ended);

  /// Writes the next message to `out`. False if there is none, or no credit for a frame.
  bool next(std::int64_t now_ns, std::vector<std::byte>& out);

  /// Applies an ack; ignores one of another run. False if its frame was never sent.
  [[nodiscard]] bool acked(const AckMessage& ack, std::int64_t now_ns);

  /// The kernel's minimum RTT.
  void set_round_trip(std::int64_t least_ns) noexcept { link_.set_round_trip(least_ns); }

  [[nodiscard]] const LinkRate& link() const noexcept { return link_; }
  /// True while a pass has blocks that are not sent yet.
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
  /// Copies the next blocks of the pass to `raw_`, up to `kMaxRawBytes`. Returns their number.
  std::size_t take_blocks();

  RunSnapshot& snapshot_;
  std::uint32_t flags_;
  std::uint64_t session_;
  bool greeted_ = false, ended_ = false, pass_due_ = false, opened_ = false;
  // Ticks, dirty boxes and frames take turns, so that none of them can fill a slow link.
  static constexpr int kSources = 3;
  int next_source_ = 0;

  std::vector<std::uint64_t> held_;     // version per block; 0: not sent yet
  std::vector<std::uint32_t> waiting_;  // blocks for the next pass
  std::vector<bool> is_waiting_;
  std::vector<Entry> pass_;
  std::size_t sent_of_pass_ = 0;
  Tick pass_tick_ = 0;
  std::int64_t pass_taken_ns_ = 0, slot_ns_ = 0;
  std::uint64_t frame_ = 0, set_hash_ = 0;

  double record_bytes_ = 0;  // budget of records during a pass

  LinkRate link_;
  PackChoice pack_choice_;
  std::vector<std::byte> raw_;
  RecordBatches ticks_, dirty_;
};

}  // namespace kerf::bridge
