// SPDX-License-Identifier: Apache-2.0
#include "bridge/stream/record_batches.hpp"

#include <algorithm>
#include <cstring>
#include <limits>

#include "bridge/stream/packing.hpp"

namespace kerf::bridge {
namespace {

template <class T>
void append(std::vector<std::byte>& out, const T& value) {
  const auto* const at = reinterpret_cast<const std::byte*>(&value);
  out.insert(out.end(), at, at + sizeof value);
}

}  // namespace

void RecordBatches::plan(std::uint64_t records) noexcept {
  const SegmentInfo& info = reader_.info();
  const bool ticks = ring_ == Ring::ticks;
  const std::uint64_t head = ticks ? reader_.state_head() : reader_.dirty_head();
  const std::uint64_t slots = ticks ? info.state_slots : info.dirty_slots;
  end_ = head;
  if (head == 0) return;
  if (!started_) next_ = head - 1;
  started_ = true;
  // What the writer is about to overwrite is left to it.
  next_ = std::max(next_, head - std::min(head, slots - slots / 4));
  const std::uint64_t waiting = end_ - std::min(end_, next_);
  if (waiting == 0) return;
  const std::uint64_t most = std::clamp<std::uint64_t>(records, 1, waiting);
  const std::uint64_t stride = (waiting + most - 1) / most;
  stride_ = static_cast<std::uint32_t>(
      std::min<std::uint64_t>(stride, std::numeric_limits<std::uint32_t>::max()));
  next_ += (waiting - 1) % stride_;  // the last of them is the newest
}

bool RecordBatches::read(std::uint64_t index, std::vector<std::byte>& out) const {
  if (ring_ == Ring::ticks) {
    TickRecord record;
    if (reader_.state_at(index, record) != ReadState::ok) return false;
    append(out, record);
  } else {
    DirtyRecord record;
    if (reader_.dirty_at(index, record) != ReadState::ok) return false;
    append(out, record);
  }
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

}  // namespace kerf::bridge
