// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace kerf {

/// What may happen to a device on USB.
enum class UsbFault : std::uint8_t {
  stall,   ///< the endpoint that is read halts until the host clears it (Falcon)
  split,   ///< for 0.1 s the serial line is slow: packets come in pieces (Falcon)
  deaf,    ///< for 0.1 s it takes nothing: what the host writes has to wait (FUSE nodes)
  vanish,  ///< unplugged
  back,    ///< plugged in again, without power having been lost
};

/// How long a fault lasts that passes by itself: frames of 1 ms.
inline constexpr int kUsbFaultFrames = 100;

/// A fault, and when it strikes.
struct ScriptedUsbFault {
  std::int64_t cycle = 0;  ///< of 125 us, counted from the start
  UsbFault fault = UsbFault::vanish;
  const std::atomic<bool>* when = nullptr;  ///< and not before this is set; any thread may do so
};

/// Plays faults, which are given in the order of time.
class UsbFaultScript {
 public:
  explicit UsbFaultScript(std::vector<ScriptedUsbFault> faults) : faults_(std::move(faults)) {}

  /// `strike(fault)` for each that is due in `cycle` or before it and has not struck yet.
  template <class Strike>
  void run(std::int64_t cycle, Strike strike) {
    while (next_ < faults_.size() && is_due(faults_[next_], cycle)) strike(faults_[next_++].fault);
  }

 private:
  static bool is_due(const ScriptedUsbFault& entry, std::int64_t cycle) noexcept {
    return entry.cycle <= cycle && (!entry.when || entry.when->load());
  }

  std::vector<ScriptedUsbFault> faults_;
  std::size_t next_ = 0;
};

}  // namespace kerf
