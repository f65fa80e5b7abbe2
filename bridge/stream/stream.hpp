// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "bridge/stream/link_rate.hpp"
#include "bridge/stream/pack_choice.hpp"
#include "bridge/stream/record_batches.hpp"
#include "bridge/stream/run_snapshot.hpp"
#include "bridge/wire/messages.hpp"

namespace kerf::bridge {

/// How often a pass may begin and records go out.
inline constexpr std::int64_t kSlotNs = 16'666'667;

/// All that one viewer of one run is sent: the greeting, then passes in frames, and records. No
/// network here: the caller asks for the next message whenever it can send one.
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

  /// The next message, where there is one and the link has credit for it.
  bool next(std::int64_t now_ns, std::vector<std::byte>& out);

  /// False where the viewer answers what it was never sent. An ack of another run is passed over.
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
  // Ticks, dirty boxes, a frame: by turns, so that none keeps the others from a link that is slower
  // than it alone.
  static constexpr int kTurns = 3;
  int turn_ = 0;

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
