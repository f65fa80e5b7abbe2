// SPDX-License-Identifier: Apache-2.0
#include "controller/device/firewire/firewire_streams.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>

#include <linux/firewire-cdev.h>

#include "controller/device/firewire/firewire_file.hpp"

namespace kerf {
namespace {

constexpr std::uint32_t kTag0 = FW_CDEV_ISO_CONTEXT_MATCH_TAG0;

std::uint32_t big_endian(std::span<const std::uint8_t> bytes) noexcept {
  return static_cast<std::uint32_t>(bytes[0]) << 24 | static_cast<std::uint32_t>(bytes[1]) << 16 |
         static_cast<std::uint32_t>(bytes[2]) << 8 | bytes[3];
}

/// A count of cycles as time stamps have it, 0..63999.
std::int32_t wrapped(std::int64_t cycles) noexcept {
  return static_cast<std::int32_t>((cycles % 64'000 + 64'000) % 64'000);
}

int create(FirewireFile& file, std::uint32_t type, std::int32_t channel,
           std::size_t header_bytes) noexcept {
  fw_cdev_create_iso_context request{};
  request.type = type;
  request.header_size = static_cast<std::uint32_t>(header_bytes);
  request.channel = static_cast<std::uint32_t>(channel);
  request.speed = SCODE_100;
  return file.call(FW_CDEV_IOC_CREATE_ISO_CONTEXT, &request);
}

int start_now(FirewireFile& file) noexcept {
  fw_cdev_start_iso request{.cycle = -1, .sync = 0, .tags = kTag0, .handle = 0};
  return file.call(FW_CDEV_IOC_START_ISO, &request);
}

int queue_entries(FirewireFile& file, const void* entries, std::size_t bytes) noexcept {
  fw_cdev_queue_iso request{};
  request.packets = reinterpret_cast<std::uintptr_t>(entries);
  request.size = static_cast<std::uint32_t>(bytes);
  return file.call(FW_CDEV_IOC_QUEUE_ISO, &request);
}

void stop_stream(FirewireFile& file) noexcept {
  fw_cdev_stop_iso request{0};
  file.call(FW_CDEV_IOC_STOP_ISO, &request);
}

/// The headers of an ISO_INTERRUPT event, whatever follows them.
std::span<const std::uint8_t> headers_of(std::span<const std::uint8_t> event) noexcept {
  if (event.size() < kIsoHeadersAt) return {};
  const auto length = event_as<fw_cdev_event_iso_interrupt>(event).header_length;
  return event.subspan(kIsoHeadersAt, std::min<std::size_t>(length, event.size() - kIsoHeadersAt));
}

}  // namespace

int FirewireReceiver::prepare(FirewireFile& file, std::int32_t channel) noexcept {
  headers_ = {};
  running_ = false;
  free_packets_ = 0;
  entries_ = 0;
  if (const int error = create(file, FW_CDEV_ISO_CONTEXT_RECEIVE, channel, kHeaderBytes);
      error < 0) {
    return error;
  }
  const int queued = queue(file, kEntries);
  if (queued < 0) return queued;
  return queued == kEntries ? 0 : -ENOMEM;
}

void FirewireReceiver::stop(FirewireFile& file) noexcept {
  running_ = true;  // as far as `turn` is concerned
  stop_stream(file);
}

int FirewireReceiver::queue(FirewireFile& file, int entries) noexcept {
  std::array<std::uint32_t, kEntries> control{};
  for (int i = 0; i < entries; ++i) {
    const bool interrupts = (entries_ + static_cast<std::uint32_t>(i) + 1) % kEntries == 0;
    control[static_cast<std::size_t>(i)] =
        FW_CDEV_ISO_HEADER_LENGTH(static_cast<std::uint32_t>(kHeaderBytes) * kPacketsPerEntry) |
        (interrupts ? FW_CDEV_ISO_INTERRUPT : 0U);
  }
  const int queued =
      queue_entries(file, control.data(), static_cast<std::size_t>(entries) * sizeof control[0]);
  if (queued > 0) entries_ += static_cast<std::uint32_t>(queued);
  return queued;
}

void FirewireReceiver::turn(FirewireFile& file) noexcept {
  if (!running_) running_ = start_now(file) >= 0;
  const int entries = std::min(free_packets_ / kPacketsPerEntry, kEntries);
  if (entries > 0) free_packets_ -= kPacketsPerEntry * std::max(queue(file, entries), 0);
  fw_cdev_flush_iso request{0};
  file.call(FW_CDEV_IOC_FLUSH_ISO, &request);
}

void FirewireReceiver::take(std::span<const std::uint8_t> event) noexcept {
  headers_ = headers_of(event);
  headers_ = headers_.first(headers_.size() / kHeaderBytes * kHeaderBytes);
  free_packets_ += static_cast<int>(headers_.size() / kHeaderBytes);
}

FirewireReceiver::Packet FirewireReceiver::next() noexcept {
  if (headers_.empty()) return {};
  const auto one = headers_.first(kHeaderBytes);
  headers_ = headers_.subspan(kHeaderBytes);
  newest_cycle_ = cycle_of_stamp(big_endian(one.subspan(4)));
  // A shorter packet leaves old bytes behind it, a longer one is cut: its length field shows which.
  const std::size_t size = big_endian(one) >> 16;
  const auto bytes = one.subspan(8);
  return {.size = std::max<std::size_t>(size, 1),
          .bytes = bytes.first(std::min(size, bytes.size()))};
}

int FirewireTransmitter::start(FirewireFile& file, std::int32_t channel,
                               std::span<const std::uint8_t> first) noexcept {
  entries_.store(0, std::memory_order_relaxed);
  drained_at_ = sent_out_ = 0;
  lead_ = -1;
  if (const int error = create(file, FW_CDEV_ISO_CONTEXT_TRANSMIT, channel, 4); error < 0) {
    return error;
  }
  if (!send(file, first)) return -ENOMEM;
  return start_now(file);
}

void FirewireTransmitter::stop(FirewireFile& file) noexcept {
  stop_stream(file);
}

bool FirewireTransmitter::send(FirewireFile& file, std::span<const std::uint8_t> packet,
                               int skips) noexcept {
  constexpr std::size_t kPacketQuadlets = omni::kCommandBytes / 4;
  constexpr int kMaxSkips = 32;
  if (packet.size() != omni::kCommandBytes) return false;
  skips = std::clamp(skips, 0, kMaxSkips);
  const auto count = static_cast<std::uint32_t>(skips) + 1;
  const std::uint64_t begin = entries_.fetch_add(count, std::memory_order_relaxed);

  std::array<std::uint32_t, 1 + kPacketQuadlets + kMaxSkips> entries{};
  entries[0] = FW_CDEV_ISO_HEADER_LENGTH(static_cast<std::uint32_t>(omni::kCommandBytes));
  // One entry of each 64 interrupts, wherever it falls.
  if (begin / kInterruptEvery != (begin + count) / kInterruptEvery) {
    entries[0] |= FW_CDEV_ISO_INTERRUPT;
  }
  std::memcpy(&entries[1], packet.data(), packet.size());
  std::fill_n(&entries[1 + kPacketQuadlets], skips, FW_CDEV_ISO_SKIP);
  const std::size_t quadlets = 1 + kPacketQuadlets + static_cast<std::size_t>(skips);
  // A count of 0: descriptor memory is full; the kernel sets no errno for this.
  return queue_entries(file, entries.data(), quadlets * sizeof entries[0]) > 0;
}

void FirewireTransmitter::take(std::span<const std::uint8_t> event) noexcept {
  const auto stamps = headers_of(event);
  if (stamps.size() < 4) return;
  sent_out_ += stamps.size() / 4;
  const std::int32_t cycle = cycle_of_stamp(big_endian(stamps.last(4)));
  delay(wrapped(cycle - static_cast<std::int64_t>(sent_out_ - 1)));
}

/// Takes over a lead that is later than the known one.
void FirewireTransmitter::delay(std::int32_t lead) noexcept {
  const std::int32_t known = lead_.load(std::memory_order_relaxed);
  if (known < 0 || cycles_between(known, lead) > 0) lead_ = lead;
}

int FirewireTransmitter::wanted_skips(std::int32_t now, int period) noexcept {
  if (now < 0) return period - 1;
  const auto entries = static_cast<std::int64_t>(entries_.load(std::memory_order_relaxed));
  delay(wrapped(now + 1 - entries));  // if the queue is empty, the next entry goes out next
  const std::int32_t turn = wrapped(lead_.load(std::memory_order_relaxed) + entries);
  const std::int32_t depth = cycles_between(now, turn) - 1;
  return std::clamp(kMargin + period - depth - 1, 0, period + kMargin);
}

}  // namespace kerf
