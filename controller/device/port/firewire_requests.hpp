// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string>

#include <linux/firewire-cdev.h>

#include "controller/device/port/firewire_file.hpp"

namespace kerf {

/// Where the variable part of an event begins: events have padding behind it, so their size is not
/// that of their fixed part.
inline constexpr std::size_t kResponseDataAt = offsetof(fw_cdev_event_response, data);
inline constexpr std::size_t kIsoHeadersAt = offsetof(fw_cdev_event_iso_interrupt, header);

inline constexpr int kFirewireAnswerMs = 50;  ///< a device answers sooner, or not at all

/// The fixed part of an event; what is missing of a short one is zero.
template <class Event>
[[nodiscard]] Event event_as(std::span<const std::uint8_t> bytes) noexcept {
  Event event{};
  std::memcpy(&event, bytes.data(), std::min(sizeof event, bytes.size()));
  return event;
}

/// A channel and its bandwidth, asked for or given.
struct FirewireClaim {
  std::uint32_t handle = 0;
  std::int32_t channel = -1;  ///< -1: not given
};

/// One open file of the device's node, through which its registers are reached and channels are
/// claimed.
///
/// Every request is answered by an event that has its `closure`, a failed one too. A request made
/// in an older generation of the bus fails with RCODE_GENERATION. Nothing allocates, throws or
/// sleeps but where it says so.
class FirewireRequests {
 public:
  [[nodiscard]] int open(const std::string& path) noexcept { return file_.open(path); }
  [[nodiscard]] bool gone() const noexcept { return file_.gone(); }
  [[nodiscard]] bool ready(int milliseconds) noexcept { return file_.ready(milliseconds); }
  /// The oldest event; valid until the next one.
  [[nodiscard]] std::span<const std::uint8_t> event() noexcept { return file_.read(event_); }

  [[nodiscard]] std::uint32_t generation() const noexcept { return generation_; }
  void set_generation(std::uint32_t generation) noexcept { generation_ = generation; }
  /// Asks for the generation of now, which an event may tell only half a second later. True when it
  /// was another one.
  bool refresh() noexcept;

  void write(std::uint64_t offset, std::span<const std::uint8_t> bytes,
             std::uint64_t closure) noexcept;
  void write(std::uint64_t offset, std::uint8_t byte, std::uint64_t closure) noexcept {
    write(offset, {&byte, 1}, closure);
  }
  /// A register of one byte; sleeps for the answer, three times 50 ms at most. Other events that
  /// come meanwhile are lost.
  [[nodiscard]] std::optional<std::uint8_t> read_byte(std::uint64_t offset) noexcept;

  /// Any channel but 31, the broadcast channel, and the bandwidth of a packet of `payload_bytes` in
  /// each cycle. Nothing when it cannot even be asked for.
  [[nodiscard]] std::optional<FirewireClaim> claim(std::uint64_t closure,
                                                   std::size_t payload_bytes) noexcept;
  void give_back(const FirewireClaim& claim) noexcept;

 private:
  static constexpr std::size_t kEventBytes = 128;  // no answer that we ask for is longer

  FirewireFile file_;
  std::uint32_t generation_ = 0;
  alignas(8) std::array<std::uint8_t, kEventBytes> event_{};
};

}  // namespace kerf
