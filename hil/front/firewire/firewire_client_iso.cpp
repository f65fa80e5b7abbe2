// SPDX-License-Identifier: Apache-2.0
// The isochronous side of an open: its one context.
#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <vector>

#include <linux/firewire-cdev.h>

#include "hil/front/firewire/firewire_client.hpp"
#include "hil/front/fuse/caller_memory.hpp"

namespace kerf {
namespace {

constexpr std::size_t kMaxContexts = 4;        // per direction, of a typical controller
constexpr std::uint32_t kFlushesOverflow = 5;  // from this version of the interface on
// Of one QUEUE_ISO: descriptor memory is full before so much is looked at.
constexpr std::size_t kMaxEntryBytes = 16 << 20;

}  // namespace

// ---- isochronous contexts ----

int FirewireClient::create_context() {
  auto request = argument<fw_cdev_create_iso_context>();
  const bool transmits = request.type == FW_CDEV_ISO_CONTEXT_TRANSMIT;
  if (request.type == FW_CDEV_ISO_CONTEXT_RECEIVE_MULTICHANNEL) return -ENOSYS;
  if (!transmits && request.type != FW_CDEV_ISO_CONTEXT_RECEIVE) return -EINVAL;
  if (request.channel > 63 || (transmits && request.speed > SCODE_3200)) return -EINVAL;
  if (!transmits && (request.header_size < 4 || request.header_size % 4 != 0)) return -EINVAL;
  if (context_) return -EBUSY;
  std::size_t others = 0;
  for (const IsoContext* other : bus_.contexts()) {
    if (other->settings().transmits != transmits) continue;
    ++others;
    if (!transmits && other->settings().channel == request.channel) return -EBUSY;
  }
  if (others >= kMaxContexts) return -EBUSY;
  context_.emplace(IsoSettings{.transmits = transmits,
                               .channel = request.channel,
                               .header_size = request.header_size,
                               .closure = request.closure,
                               .drops_overflow = version_ < kFlushesOverflow},
                   events_);
  bus_.attach(*context_);
  request.handle = 0;
  give_back(request);
  return 0;
}

int FirewireClient::queue(const FuseIoctl& call) {
  auto request = argument<fw_cdev_queue_iso>();
  if (!has_context(request.handle)) return -EINVAL;
  std::vector<std::uint8_t> entries(std::min<std::size_t>(request.size, kMaxEntryBytes));
  const std::size_t readable = read_caller(call.thread, request.packets, entries);
  const bool all = readable == entries.size();
  entries.resize(readable);
  const IsoContext::Queued queued = context_->queue(entries, all);
  if (queued.error != 0) return -queued.error;
  request.packets += queued.bytes;
  request.size -= static_cast<std::uint32_t>(queued.bytes);
  request.data = 0;
  give_back(request);
  return queued.entries;
}

int FirewireClient::start() {
  const auto request = argument<fw_cdev_start_iso>();
  if (!has_context(request.handle)) return -EINVAL;
  if (!context_->settings().transmits &&
      (request.tags == 0 || request.tags > 15 || request.sync > 15)) {
    return -EINVAL;
  }
  // 2 bits of the second and 13 of the cycle; -1 is the next one.
  std::int64_t first = bus_.cycle() + 1;
  if (request.cycle >= 0) {
    constexpr std::int64_t kPeriod = 4 * kBusCyclesPerSecond;
    const std::int64_t wanted =
        (request.cycle >> 13 & 3) * kBusCyclesPerSecond + (request.cycle & 0x1FFF);
    first += ((wanted - first) % kPeriod + kPeriod) % kPeriod;
  }
  return -context_->start(first, request.tags);
}

int FirewireClient::stop() {
  const auto request = argument<fw_cdev_stop_iso>();
  if (!has_context(request.handle)) return -EINVAL;
  context_->stop();
  return 0;
}

int FirewireClient::flush() {
  const auto request = argument<fw_cdev_flush_iso>();
  if (!has_context(request.handle)) return -EINVAL;
  if (bus_.clock().is_lock_step() && !context_->settings().transmits) {
    bus_.pass(bus_.settings().lockstep_cycles);
  }
  context_->flush();
  return 0;
}

}  // namespace kerf
