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

#include "arm/service_arm.hpp"
#include "controller/device/arm/arm_port.hpp"
#include "hil/device/emulator.hpp"
#include "hil/front/inverse3/service_front.hpp"
#include "hil/script/fault_script.hpp"
#include "hil/script/faulty_device.hpp"
#include "shared/arm/arm_page.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "shared/wire/cartesian.hpp"
#include "tests/support/temporary_folder.hpp"

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

  [[nodiscard]] ServiceArm::Options options(const std::string& handle = "") const {
    ServiceArm::Options options;
    options.service.port = front_.port();
    options.event_port = *front_.event_port();
    options.wanted.handle_id = inverse3::ShortText(handle);
    options.patience_ms = 0;
    options.priority = 0;
    return options;
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
inline const std::string kWireless = "40213";

/// The arm as `kerf-arm` runs it, in this process, and the controller's port to it by their page.
class ServedPort final : public PacketPort {
 public:
  ServedPort(const ServiceArm::Options& options, bool lockstep)
      : page_(name(), Personality::inverse3, 1000),
        exchange_(page_, force_figures(Personality::inverse3).peak_n, 1000),
        arm_(options, exchange_, kNoStop) {
    arm_.open();
    page_.set_state(ArmState::running, "");
    port_.emplace(name(), LinkHello{Personality::inverse3, lockstep, 1000}, 0, kNoStop);
    arm_.start();
  }
  ~ServedPort() override {
    exchange_.let_go();
    const std::int64_t give_up_ns = monotonic_ns() + 200'000'000;
    while (!exchange_.finished() && monotonic_ns() < give_up_ns) {
      sleep_until_ns(monotonic_ns() + 1'000'000);
    }
    arm_.stop();
    arm_.close();
  }
  ServedPort(const ServedPort&) = delete;
  ServedPort& operator=(const ServedPort&) = delete;

  [[nodiscard]] std::size_t receive(std::span<std::uint8_t> out) noexcept override {
    return port_->receive(out);
  }
  bool send(std::span<const std::uint8_t> packet) noexcept override { return port_->send(packet); }
  [[nodiscard]] bool closed() const noexcept override {
    return port_->closed() || exchange_.failure() != 0;  // as the program's main thread
  }
  [[nodiscard]] bool wait(int milliseconds) noexcept override { return port_->wait(milliseconds); }
  /// Of the arm.
  [[nodiscard]] std::uint64_t counter(std::string_view wanted) const {
    for (const auto& [name, value] : arm_.errors()) {
      if (name == wanted) return value;
    }
    FAIL("no such counter");
    return 0;
  }

 private:
  /// One for each of this process, in a folder of its own.
  [[nodiscard]] const std::string& name() const {
    static const RuntimeFolder folder;
    static std::atomic<int> newest{0};
    if (name_.empty()) name_ = "served-" + std::to_string(++newest);
    return name_;
  }

  mutable std::string name_;
  ArmPageAdapter page_;
  ArmExchange exchange_;
  ServiceArm arm_;
  std::optional<ArmPort> port_;
};

inline std::unique_ptr<ServedPort> open(const ServiceArm::Options& options, bool lockstep = false) {
  return std::make_unique<ServedPort>(options, lockstep);
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

inline std::uint64_t counter(const ServedPort& port, std::string_view name) {
  return port.counter(name);
}

/// Waits until the counter is `least`; fails after ten seconds.
inline void until_counted(ServedPort& port, std::string_view name, std::uint64_t least) {
  const std::int64_t give_up_ns = monotonic_ns() + 10 * kNsPerSecond;
  while (counter(port, name) < least && monotonic_ns() < give_up_ns) {
    command(port, 0);
    static_cast<void>(newest(port));
    sleep_until_ns(monotonic_ns() + 1'000'000);
  }
  REQUIRE(counter(port, name) >= least);
}

}  // namespace kerf::test
