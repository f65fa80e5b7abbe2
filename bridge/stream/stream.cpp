// SPDX-License-Identifier: Apache-2.0

#include "bridge/stream/stream.hpp"

#include <algorithm>
#include <cstring>
#include <limits>
#include <numeric>
#include <string>

#include "bridge/wire/compression.hpp"
#include "bridge/wire/messages.hpp"
#include "shared/segment/layout_table.hpp"

namespace kerf::bridge {

void LinkRate::sent_frame(std::uint64_t frame, std::size_t bytes, std::int64_t now_ns) {
  bytes_sent_ += bytes;
  flight_.push_back({frame, bytes_acked_, bytes_sent_, acked_ns_ != 0 ? acked_ns_ : now_ns});
}

void LinkRate::acked(std::uint64_t frame, std::int64_t now_ns) {
  for (; !flight_.empty() && flight_.front().frame <= frame; flight_.pop_front()) {
    const Flight& flight = flight_.front();
    bytes_acked_ = flight.bytes_with;
    const auto span_ns = static_cast<double>(now_ns - flight.since_ns + 1);
    bytes_per_ns_[next_sample_] = static_cast<double>(bytes_acked_ - flight.bytes_before) / span_ns;
    next_sample_ = (next_sample_ + 1) % kSamples;
    acked_ns_ = now_ns;
  }
}

std::size_t LinkRate::window() const noexcept {
  const double highest = *std::max_element(bytes_per_ns_.begin(), bytes_per_ns_.end());
  const double bytes = kMaxRawBytes + 2 * highest * static_cast<double>(round_trip_ns_ + kTurnNs);
  return static_cast<std::size_t>(std::min<double>(bytes, kMostBytes));
}

double LinkRate::bytes_per_s() const noexcept {
  return *std::max_element(bytes_per_ns_.begin(), bytes_per_ns_.end()) * 1e9;
}

namespace {

template <class T>
void append(std::vector<std::byte>& out, const T& value) {
  const auto* const at = reinterpret_cast<const std::byte*>(&value);
  out.insert(out.end(), at, at + sizeof value);
}

}  // namespace

void RecordBatches::plan(std::uint64_t records) noexcept {
  const SegmentInfo& info = reader_.info();
  const bool ticks = ring_ != Ring::dirty;
  const std::uint64_t head = ticks ? reader_.state_head() : reader_.dirty_head();
  const std::uint64_t slots = ticks ? info.state_slots : info.dirty_slots;
  end_ = head;
  if (head == 0) return;
  if (!started_) next_ = head - 1;
  started_ = true;
  // Skips the oldest quarter of the ring, which the writer may overwrite soon.
  next_ = std::max(next_, head - std::min(head, slots - slots / 4));
  const std::uint64_t waiting = end_ - std::min(end_, next_);
  if (waiting == 0) return;
  const std::uint64_t most = std::clamp<std::uint64_t>(records, 1, waiting);
  const std::uint64_t stride = (waiting + most - 1) / most;
  stride_ = static_cast<std::uint32_t>(
      std::min<std::uint64_t>(stride, std::numeric_limits<std::uint32_t>::max()));
  next_ += (waiting - 1) % stride_;  // so that the last one is the newest
}

bool RecordBatches::read(std::uint64_t index, std::vector<std::byte>& out) const {
  if (ring_ == Ring::dirty) {
    DirtyRecord record;
    if (reader_.dirty_at(index, record) != ReadState::ok) return false;
    append(out, record);
    return true;
  }
  TickRecord record, second;
  if (reader_.state_at(index, record) != ReadState::ok) return false;
  if (ring_ == Ring::pairs && reader_.state_at(index, second, 1) != ReadState::ok) return false;
  append(out, record);
  if (ring_ == Ring::pairs) append(out, second);
  return true;
}

bool RecordBatches::write(double bytes_per_s, std::vector<std::byte>& out) {
  RecordsHead head{};
  head.magic = kRecordsMagic;
  head.session = reader_.info().session_id;
  head.ring = static_cast<std::uint32_t>(ring_);
  head.stride = stride_;
  raw_.clear();
  out.clear();
  const std::size_t most = kMaxRawBytes / record_bytes(ring_);
  for (; next_ < end_ && head.count < most; next_ += stride_) {
    if (read(next_, raw_)) {
      if (head.count++ == 0) head.first = next_;
    } else if (head.count != 0) {
      break;  // a gap ends the message
    }
  }
  if (head.count == 0) return false;
  out.resize(sizeof head);
  if (append_payload(raw_, bytes_per_s, pack_choice_, out)) head.flags = kPacked;
  head.raw_bytes = static_cast<std::uint32_t>(raw_.size());
  head.payload_bytes = static_cast<std::uint32_t>(out.size() - sizeof head);
  std::memcpy(out.data(), &head, sizeof head);
  return true;
}

Stream::Stream(RunSnapshot& snapshot, std::uint32_t flags)
    : snapshot_(snapshot),
      flags_(flags),
      session_(snapshot.reader().info().session_id),
      held_(snapshot.plan().count()),
      waiting_(snapshot.plan().count()),
      is_waiting_(snapshot.plan().count(), true),
      ticks_(snapshot.reader(), snapshot.reader().info().arms > 1 ? Ring::pairs : Ring::ticks),
      dirty_(snapshot.reader(), Ring::dirty) {
  std::iota(waiting_.begin(), waiting_.end(), 0U);
}

Stream::~Stream() {
  for (; in_pass(); ++sent_of_pass_) {
    snapshot_.unpin(pass_[sent_of_pass_].id, pass_[sent_of_pass_].version);
  }
}

void Stream::note_changes() {
  for (const std::uint32_t id : snapshot_.changed()) {
    if (is_waiting_[id]) continue;
    is_waiting_[id] = true;
    waiting_.push_back(id);
  }
}

void Stream::slot(std::int64_t now_ns, bool ended) {
  std::uint64_t records = kSlotsBehind * kSlotNs / snapshot_.reader().info().tick_ns;
  const double rate = link_.bytes_per_s();
  if (in_pass() && rate > 0) {
    record_bytes_ += kRecordShare * rate * static_cast<double>(now_ns - slot_ns_) * 1e-9;
    record_bytes_ = std::min<double>(record_bytes_, kMaxRawBytes);
    const double each =
        static_cast<double>(record_bytes(ticks_.ring()) + record_bytes(Ring::dirty)) /
        ticks_.ratio();
    records = std::min(records, static_cast<std::uint64_t>(std::max(record_bytes_, 0.0) / each));
  } else {
    record_bytes_ = 0;
  }
  ticks_.plan(records);
  dirty_.plan(records);
  slot_ns_ = now_ns;
  ended_ = ended;
  pass_due_ = true;
}

bool Stream::next(std::int64_t now_ns, std::vector<std::byte>& out) {
  out.clear();
  if (!greeted_) {
    greeted_ = true;
    write_hello(now_ns, out);
    return true;
  }
  for (int i = 0; i < kSources; ++i) {
    const int source = (next_source_ + i) % kSources;
    const bool sent = source == 0   ? next_records(ticks_, out)
                      : source == 1 ? next_records(dirty_, out)
                                    : next_frame(now_ns, out);
    if (!sent) continue;
    next_source_ = (source + 1) % kSources;
    return true;
  }
  return false;
}

void Stream::write_hello(std::int64_t now_ns, std::vector<std::byte>& out) {
  const SegmentInfo& info = snapshot_.reader().info();
  HelloMessage head{};
  head.magic = kHelloMagic;
  head.protocol = kProtocol;
  head.session = session_;
  head.config_hash = info.config_hash;
  head.abi_hash = kAbiHash;
  head.layout_major = kLayoutMajor;
  head.layout_minor = kLayoutMinor;
  head.tick_ns = info.tick_ns;
  head.flags = flags_ | (info.arms > 1 ? kTwoArms : 0);
  head.server_ns = now_ns;
  head.start_ns = info.start_ns;
  head.volume_count = static_cast<std::uint32_t>(info.volumes.size());
  head.record_bytes = sizeof(TickRecord);
  head.dirty_bytes = sizeof(DirtyRecord);
  head.scene_bytes = static_cast<std::uint32_t>(info.scene_json.size());
  info.build_id.copy(head.build_id, sizeof head.build_id - 1);
  const std::vector<VolumeDescriptor> volumes = describe_volumes(info);
  out.resize(sizeof head + volumes.size() * sizeof(VolumeDescriptor));
  std::memcpy(out.data(), &head, sizeof head);
  std::memcpy(out.data() + sizeof head, volumes.data(), volumes.size() * sizeof(VolumeDescriptor));
  link_.sent(out.size());
}

bool Stream::next_records(RecordBatches& ring, std::vector<std::byte>& out) {
  if (!ring.waiting() || !ring.write(link_.bytes_per_s(), out)) return false;
  link_.sent(out.size());
  record_bytes_ -= static_cast<double>(out.size());
  return true;
}

bool Stream::next_frame(std::int64_t now_ns, std::vector<std::byte>& out) {
  if (!link_.has_credit()) return false;
  if (!in_pass()) {
    if (!pass_due_) return false;
    begin_pass();
    if (!opened_) return false;
  }
  write_frame(now_ns, out);
  return true;
}

void Stream::begin_pass() {
  pass_due_ = false;
  pass_.clear();
  sent_of_pass_ = 0;
  if (!snapshot_.whole()) return;  // then an empty frame with the previous tick
  opened_ = true;
  pass_tick_ = snapshot_.tick();
  pass_taken_ns_ = snapshot_.taken_ns();
  for (const std::uint32_t id : waiting_) {
    is_waiting_[id] = false;
    const std::uint64_t version = snapshot_.version(id);
    if (version == 0 || version == held_[id]) continue;
    snapshot_.pin(id);
    pass_.push_back({id, version});
  }
  waiting_.clear();
  std::sort(pass_.begin(), pass_.end(), [](const Entry& a, const Entry& b) { return a.id < b.id; });
}

std::size_t Stream::take_blocks() {
  raw_.clear();
  std::size_t blocks = 0;
  for (; in_pass(); ++sent_of_pass_, ++blocks) {
    const auto [id, version] = pass_[sent_of_pass_];
    const std::size_t bytes = snapshot_.plan().plane_of(id).block_bytes();
    if (raw_.size() + bytes > kMaxRawBytes) break;
    raw_.resize(raw_.size() + bytes);
    snapshot_.copy(id, version, std::span(raw_).last(bytes));
    snapshot_.unpin(id, version);
    set_hash_ = with_block(set_hash_, id, held_[id], version, session_);
    held_[id] = version;
  }
  return blocks;
}

void Stream::write_frame(std::int64_t now_ns, std::vector<std::byte>& out) {
  const std::size_t begin = sent_of_pass_;
  const std::size_t blocks = take_blocks();
  FrameHead head{};
  head.magic = kFrameMagic;
  head.flags = (in_pass() ? 0 : kLastOfPass) | (ended_ ? kRunEnded : 0);
  head.session = session_;
  head.frame = ++frame_;
  head.tick = pass_tick_;
  head.taken_ns = pass_taken_ns_;
  head.heartbeat_ns = static_cast<std::int64_t>(snapshot_.reader().heartbeat_ns());
  head.set_hash = set_hash_;
  head.lifecycle = static_cast<std::uint32_t>(snapshot_.reader().lifecycle());
  head.blocks = static_cast<std::uint32_t>(blocks);
  head.raw_bytes = static_cast<std::uint32_t>(raw_.size());
  head.sent_ns = now_ns;
  const std::size_t payload_at = sizeof head + blocks * kBlockEntryBytes;
  out.resize(payload_at);
  std::byte* versions = out.data() + sizeof head;
  std::byte* ids = versions + blocks * sizeof(std::uint64_t);
  for (std::size_t i = 0; i < blocks; ++i) {
    const Entry& entry = pass_[begin + i];
    std::memcpy(versions + i * sizeof entry.version, &entry.version, sizeof entry.version);
    std::memcpy(ids + i * sizeof entry.id, &entry.id, sizeof entry.id);
  }
  if (append_payload(raw_, link_.bytes_per_s(), pack_choice_, out)) head.flags |= kPacked;
  head.payload_bytes = static_cast<std::uint32_t>(out.size() - payload_at);
  std::memcpy(out.data(), &head, sizeof head);
  link_.sent_frame(frame_, out.size(), now_ns);
}

bool Stream::acked(const AckMessage& ack, std::int64_t now_ns) {
  if (ack.session != session_) return true;
  if (ack.frame > frame_) return false;
  link_.acked(ack.frame, now_ns);
  return true;
}

}  // namespace kerf::bridge
