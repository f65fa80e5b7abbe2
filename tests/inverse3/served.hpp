// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <doctest/doctest.h>

#include "controller/device/inverse3/service_port.hpp"
#include "hil/device/emulator.hpp"
#include "hil/front/inverse3/service_front.hpp"
#include "hil/script/fault_script.hpp"
#include "hil/script/faulty_device.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "shared/wire/cartesian.hpp"

namespace kerf::test {

/// An emulated service in a thread of its own. Its arm rests without a hand, so the parking button
/// is held all the time.
class ServedService {
 public:
  explicit ServedService(const ServiceSettings& settings = {}, const FaultScript& faults = {},
                         const CartesianParams& params = as_service())
      : emulator_(std::make_unique<CartesianModel>(params), std::nullopt),
        device_(emulator_, faults),
        front_({"0", 0}, settings, device_, [] {}),
        thread_([this] {
          front_.serve({0, stop_}, true, stats_);
        }) {}
  ~ServedService() { end(); }
  ServedService(const ServedService&) = delete;
  ServedService& operator=(const ServedService&) = delete;

  static CartesianParams as_service() {
    CartesianParams params(Personality::inverse3);
    params.on_request = true;
    return params;
  }

  /// `more`: words of --port ws, each with its comma.
  [[nodiscard]] inverse3::ServiceOptions options(const std::string& more = "") const {
    return inverse3::parse_service_port(":" + std::to_string(front_.port()) +
                                        ",events=" + std::to_string(*front_.event_port()) + more);
  }
  /// Of all clients, once the thread has ended.
  const std::vector<ClientRecord>& records() {
    end();
    return front_.records();
  }
  /// The device at the end, once the thread has ended.
  const DeviceModel& end() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
    return emulator_.model();
  }

 private:
  Emulator emulator_;
  FaultyDevice device_;
  ServiceFront front_;
  FrontStats stats_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

inline const std::atomic<bool> kNoStop{false};

/// The handle of the emulated service's wireless kind, where it has both.
inline const std::string kWireless = ",handle=40213";

inline std::unique_ptr<inverse3::ServicePort> open(const inverse3::ServiceOptions& options,
                                                   bool lockstep = false) {
  return std::make_unique<inverse3::ServicePort>(
      options, LinkHello{Personality::inverse3, lockstep, 1000}, 0, kNoStop);
}

/// The newest report that waits, if any.
inline std::optional<CartesianReport> newest(PacketPort& port) {
  std::optional<CartesianReport> report;
  std::array<std::uint8_t, 65> packet;
  while (const std::size_t size = port.receive(packet)) {
    const auto read = decode_cartesian_report(std::span(packet).first(size));
    REQUIRE(read);
    report = read;
  }
  return report;
}

inline void command(PacketPort& port, std::int16_t x_mn, bool force_on = true) {
  CartesianCommand command;
  command.force_mn = {x_mn, 0, 0};
  command.force_on = force_on;
  port.send(encode(command));
}

/// Commands `x_mn` each ms until a report fulfils `wanted`; fails after ten seconds. Every report
/// is seen, the oldest first.
template <class Wanted>
CartesianReport until(PacketPort& port, std::int16_t x_mn, const Wanted& wanted) {
  const std::int64_t give_up_ns = monotonic_ns() + 10 * kNsPerSecond;
  std::array<std::uint8_t, 65> packet;
  while (monotonic_ns() < give_up_ns) {
    command(port, x_mn);
    while (const std::size_t size = port.receive(packet)) {
      const auto report = decode_cartesian_report(std::span(packet).first(size));
      REQUIRE(report);
      if (wanted(*report)) return *report;
    }
    sleep_until_ns(monotonic_ns() + 1'000'000);
  }
  FAIL("no such report within 10 s");
  return {};
}

inline CartesianReport until_armed(PacketPort& port, std::int16_t x_mn = 0) {
  return until(port, x_mn, [](const CartesianReport& report) { return report.homed; });
}
inline CartesianReport until_barred(PacketPort& port, std::int16_t x_mn = 0) {
  return until(port, x_mn, [](const CartesianReport& report) { return !report.homed; });
}

inline std::uint64_t counter(const PacketPort& port, std::string_view name) {
  for (const LinkCounter& one : port.counters()) {
    if (one.name == name) return one.value;
  }
  FAIL("no such counter");
  return 0;
}

/// Waits until the counter is `least`; fails after ten seconds.
inline void until_counted(PacketPort& port, std::string_view name, std::uint64_t least) {
  const std::int64_t give_up_ns = monotonic_ns() + 10 * kNsPerSecond;
  while (counter(port, name) < least && monotonic_ns() < give_up_ns) {
    command(port, 0);
    static_cast<void>(newest(port));
    sleep_until_ns(monotonic_ns() + 1'000'000);
  }
  REQUIRE(counter(port, name) >= least);
}

}  // namespace kerf::test
