// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "controller/device/port/packet_port.hpp"
#include "shared/arm/arm_page.hpp"
#include "shared/wire/emulator_link.hpp"

namespace kerf {

/// The port to `kerf-arm`, which stands between a vendor's library or service and the page that
/// both map (shared/arm/arm_page.hpp). No method makes a system call, except `wait`, and `send` if
/// it has to wake the adapter.
///
/// The port closes if the adapter ends or fails, if another adapter takes its page, or, but in
/// lock-step, if no report has come for kSilenceNs: so a killed adapter needs no lock to be read in
/// the loop. The servo has latched `stale_input` long before.
class ArmPort final : public PacketPort {
 public:
  static constexpr std::int64_t kSilenceNs = 1'000'000'000;

  /// `name`: of the adapter. Tries for `patience_ms` while none runs, or until `stop`. `starts`: if
  /// none runs, starts one for the device, which ends with this controller, and waits until that is
  /// ready, or has ended with a line of its own (AlreadySaid). Throws std::runtime_error with one
  /// line, if its device does not fit `ours` too.
  ArmPort(const std::string& name, const LinkHello& ours, int patience_ms,
          const std::atomic<bool>& stop, bool starts = false);

  [[nodiscard]] std::size_t receive(std::span<std::uint8_t> out) noexcept override;
  bool send(std::span<const std::uint8_t> packet) noexcept override;
  [[nodiscard]] bool closed() const noexcept override {
    return silent_.load(std::memory_order_relaxed) || page_->over();
  }
  [[nodiscard]] bool wait(int milliseconds) noexcept override;
  [[nodiscard]] std::vector<LinkCounter> counters() const override;

 private:
  std::unique_ptr<ArmPageController> page_;
  bool in_lockstep_ = false;
  std::int64_t heard_ns_ = 0;  ///< when the last report was taken
  std::atomic<bool> silent_{false};
  std::uint64_t packets_ = 0;
  std::atomic<std::uint64_t> commands_{0};
};

/// What follows "arm" in `--port arm[:NAME]`: the name of the adapter; empty: the word of the
/// device. Throws std::runtime_error with one line.
[[nodiscard]] std::string parse_arm_port(std::string_view text);

}  // namespace kerf
