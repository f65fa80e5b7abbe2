// SPDX-License-Identifier: Apache-2.0
#include "hil/front/firewire/iso_context.hpp"

#include <algorithm>
#include <array>
#include <cerrno>

#include <linux/firewire-cdev.h>

namespace kerf {
namespace {

constexpr std::size_t kHeaderPageBytes = 4096;
constexpr std::size_t kDescriptorBytes = 16;
constexpr std::uint8_t kStaleByte = 0xA5;  // content of the unused part of a receive buffer

constexpr std::uint32_t payload_bytes(std::uint32_t control) noexcept {
  return control & 0xFFFF;
}
constexpr std::uint32_t tag_of(std::uint32_t control) noexcept {
  return control >> 18 & 3;
}
constexpr std::uint32_t header_bytes(std::uint32_t control) noexcept {
  return control >> 24;
}

void put_big_endian(std::span<std::uint8_t> out, std::uint32_t value) noexcept {
  for (std::size_t i = 0; i < 4; ++i) out[i] = static_cast<std::uint8_t>(value >> (24 - 8 * i));
}

}  // namespace

IsoContext::Queued IsoContext::queue(std::span<const std::uint8_t> entries, bool readable) {
  Queued queued;
  while (queued.bytes < entries.size()) {
    auto rest = entries.subspan(queued.bytes);
    std::uint32_t control = 0;
    if (rest.size() < sizeof control) {
      queued.error = readable ? EINVAL : EFAULT;
      return queued;
    }
    std::memcpy(&control, rest.data(), sizeof control);
    rest = rest.subspan(sizeof control);
    const std::size_t sent = settings_.transmits ? header_bytes(control) : 0;
    const bool bad_length =
        settings_.transmits
            ? header_bytes(control) % 4 != 0
            : header_bytes(control) == 0 || header_bytes(control) % settings_.header_size != 0;
    if (bad_length || sent > rest.size()) {
      queued.error = bad_length || readable ? EINVAL : EFAULT;
      return queued;
    }
    const bool skips = settings_.transmits && (control & FW_CDEV_ISO_SKIP) != 0;
    // A payload would need memory of mmap().
    if (payload_bytes(control) > 0 || (skips && header_bytes(control) > 0)) {
      queued.error = EINVAL;
      return queued;
    }
    if (!append(control, rest.first(sent))) break;
    queued.bytes += sizeof control + sent;
    ++queued.entries;
  }
  if (queued.bytes == entries.size() && !readable) {
    queued.error = EFAULT;
    return queued;
  }
  halted_ = false;  // the engine is woken, unless an entry was bad
  return queued;
}

/// Returns false if descriptor memory is full. Block sizes: ohci.c, queue_iso_transmit and
/// queue_iso_packet_per_buffer.
bool IsoContext::append(std::uint32_t control, std::span<const std::uint8_t> data) {
  const bool interrupts = (control & FW_CDEV_ISO_INTERRUPT) != 0;
  const auto blocks = [](std::size_t bytes) {
    return (bytes + kDescriptorBytes - 1) / kDescriptorBytes;
  };
  if (settings_.transmits) {
    const bool skips = (control & FW_CDEV_ISO_SKIP) != 0;
    const std::size_t block = skips ? 1 : 2 + (data.empty() ? 0 : 1) + blocks(data.size());
    if (!memory_.take(block * kDescriptorBytes)) return false;
    descriptors_.push_back(
        {memory_.page(), interrupts, skips, tag_of(control), {data.begin(), data.end()}, 0});
  } else {
    const std::size_t packets = header_bytes(control) / settings_.header_size;
    const std::size_t block = 1 + blocks(std::max<std::size_t>(settings_.header_size, 8));
    for (std::size_t i = 0; i < packets; ++i) {
      if (!memory_.take(block * kDescriptorBytes)) return false;
      const bool last = i + 1 == packets;
      descriptors_.push_back({memory_.page(), interrupts && last, false, 0, {}, 0});
    }
  }
  if (interrupts) interrupts_at_.push_back(completed_ + descriptors_.size() - 1);
  return true;
}

int IsoContext::start(std::int64_t cycle, std::uint32_t tags) noexcept {
  if (descriptors_.empty()) return ENODATA;
  if (running_) ++double_starts_;
  // Descriptors that were done but not yet handled run again.
  done_ = 0;
  running_ = true;
  halted_ = false;
  start_cycle_ = cycle;
  tags_ = tags;
  return 0;
}

bool IsoContext::can_work() noexcept {
  if (!running_) return false;
  if (done_ == descriptors_.size()) halted_ = true;
  return !halted_;
}

std::optional<IsoContext::Packet> IsoContext::transmit(std::int64_t cycle) {
  if (cycle < start_cycle_ || !can_work()) return std::nullopt;
  const Descriptor& descriptor = descriptors_[done_];
  std::optional<Packet> packet;
  if (!descriptor.skips) packet = Packet{descriptor.tag, descriptor.data};
  done(cycle);
  return packet;
}

void IsoContext::receive(std::uint32_t tag, std::span<const std::uint8_t> packet,
                         std::int64_t cycle) {
  if (cycle < start_cycle_ || !running_ || (tags_ >> tag & 1) == 0) return;
  if (!can_work()) {
    ++missed_;
    return;
  }
  // The header of the packet and its time stamp, then the packet; big-endian, cut to the header
  // size.
  std::vector<std::uint8_t>& data = descriptors_[done_].data;
  data.assign(std::max<std::size_t>(settings_.header_size, 8), kStaleByte);
  put_big_endian(data, static_cast<std::uint32_t>(packet.size()) << 16 | tag << 14 |
                           settings_.channel << 8 | 0xA0);
  put_big_endian(std::span(data).subspan(4), 0xFFFF'0000U | iso_stamp(cycle));
  std::copy_n(packet.begin(), std::min(packet.size(), data.size() - 8), data.begin() + 8);
  data.resize(settings_.header_size);
  done(cycle);
}

void IsoContext::done(std::int64_t cycle) {
  Descriptor& descriptor = descriptors_[done_++];
  descriptor.stamp = iso_stamp(cycle);
  if (descriptor.interrupts) complete(false);
}

/// The driver handles the descriptors that the engine has completed.
void IsoContext::complete(bool flush) {
  for (; done_ > 0; --done_) {
    const Descriptor& front = descriptors_.front();
    std::array<std::uint8_t, 4> stamp{};
    put_big_endian(stamp, 0x8011'0000U | front.stamp);  // status: done, acknowledged
    const std::span<const std::uint8_t> header =
        settings_.transmits ? std::span<const std::uint8_t>(stamp) : front.data;
    if (headers_.size() + header.size() > kHeaderPageBytes && !settings_.drops_overflow) emit();
    if (headers_.size() + header.size() <= kHeaderPageBytes) {
      headers_.insert(headers_.end(), header.begin(), header.end());
      last_stamp_ = front.stamp;
    }
    if (front.interrupts) {
      interrupts_at_.pop_front();
      emit();
    }
    descriptors_.pop_front();
    ++completed_;
    memory_.complete_before(descriptors_.empty() ? memory_.page() : descriptors_.front().page);
  }
  if (flush && !headers_.empty()) emit();
}

void IsoContext::emit() {
  fw_cdev_event_iso_interrupt event{};
  event.closure = settings_.closure;
  event.type = FW_CDEV_EVENT_ISO_INTERRUPT;
  event.cycle = last_stamp_;
  event.header_length = static_cast<std::uint32_t>(headers_.size());
  events_.push(event, headers_, offsetof(fw_cdev_event_iso_interrupt, header));
  headers_.clear();
}

std::int64_t IsoContext::until_interrupt() const noexcept {
  const std::uint64_t next = completed_ + done_;
  for (const std::uint64_t at : interrupts_at_) {
    if (at >= next) return running_ && !halted_ ? static_cast<std::int64_t>(at - next + 1) : 0;
  }
  return 0;
}

}  // namespace kerf
