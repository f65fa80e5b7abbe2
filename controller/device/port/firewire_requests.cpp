// SPDX-License-Identifier: Apache-2.0
#include "controller/device/port/firewire_requests.hpp"

#include <linux/firewire-cdev.h>

namespace kerf {
namespace {

constexpr std::uint64_t kReadClosure = ~std::uint64_t{0};
constexpr int kTries = 3;
constexpr std::uint64_t kBroadcastChannel = std::uint64_t{1} << 31;

/// Bandwidth in units of 20.3 ns: the gaps and the arbitration of a packet, and at S100 16 per
/// quadlet, its header and two checksums included.
constexpr std::uint32_t bandwidth_of(std::size_t payload_bytes) {
  return static_cast<std::uint32_t>(512 + 16 * (payload_bytes + 12) / 4);
}

}  // namespace

bool FirewireRequests::refresh() noexcept {
  const std::uint32_t before = generation_;
  generation_ = file_.link().value_or(before);
  return generation_ != before;
}

void FirewireRequests::write(std::uint64_t offset, std::span<const std::uint8_t> bytes,
                             std::uint64_t closure) noexcept {
  fw_cdev_send_request request{};
  request.tcode = TCODE_WRITE_BLOCK_REQUEST;
  request.length = static_cast<std::uint32_t>(bytes.size());
  request.offset = offset;
  request.closure = closure;
  request.data = reinterpret_cast<std::uintptr_t>(bytes.data());
  request.generation = generation_;
  file_.call(FW_CDEV_IOC_SEND_REQUEST, &request);
}

std::optional<std::uint8_t> FirewireRequests::read_byte(std::uint64_t offset) noexcept {
  for (int tries = 0; tries < kTries && !gone(); ++tries) {
    refresh();  // a bus reset may have come between
    fw_cdev_send_request request{};
    request.tcode = TCODE_READ_BLOCK_REQUEST;
    request.length = 1;
    request.offset = offset;
    request.closure = kReadClosure;
    request.generation = generation_;
    if (file_.call(FW_CDEV_IOC_SEND_REQUEST, &request) < 0) continue;
    while (ready(kFirewireAnswerMs)) {
      const auto answer = event();
      const auto response = event_as<fw_cdev_event_response>(answer);
      if (response.type != FW_CDEV_EVENT_RESPONSE || response.closure != kReadClosure) continue;
      if (response.rcode == RCODE_COMPLETE && answer.size() > kResponseDataAt) {
        return answer[kResponseDataAt];
      }
      break;
    }
  }
  return std::nullopt;
}

std::optional<FirewireClaim> FirewireRequests::claim(std::uint64_t closure,
                                                     std::size_t payload_bytes) noexcept {
  fw_cdev_allocate_iso_resource request{};
  request.closure = closure;
  request.channels = ~kBroadcastChannel;
  request.bandwidth = bandwidth_of(payload_bytes);
  if (file_.call(FW_CDEV_IOC_ALLOCATE_ISO_RESOURCE, &request) < 0) return std::nullopt;
  return FirewireClaim{request.handle, -1};
}

void FirewireRequests::give_back(const FirewireClaim& claim) noexcept {
  fw_cdev_deallocate request{claim.handle};
  file_.call(FW_CDEV_IOC_DEALLOCATE_ISO_RESOURCE, &request);
}

}  // namespace kerf
