// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include <linux/firewire-cdev.h>

namespace kerf {

/// Where the variable part of an event begins: events have padding behind it, so their size is not
/// that of their fixed part.
inline constexpr std::size_t kResponseDataAt = offsetof(fw_cdev_event_response, data);
inline constexpr std::size_t kIsoHeadersAt = offsetof(fw_cdev_event_iso_interrupt, header);

/// The fixed part of an event; what is missing of a short one is zero.
template <class Event>
[[nodiscard]] Event event_as(std::span<const std::uint8_t> bytes) noexcept {
  Event event{};
  std::memcpy(&event, bytes.data(), std::min(sizeof event, bytes.size()));
  return event;
}

}  // namespace kerf
