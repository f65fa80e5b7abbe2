// SPDX-License-Identifier: Apache-2.0
#include "hil/script/faulty_device.hpp"

#include <vector>

#include <doctest/doctest.h>

#include "shared/wire/omni.hpp"

using kerf::DeviceFault;
using kerf::FaultKind;

namespace {

/// An Omni whose motors push, so that the faults' clock runs, and that is asked once a cycle.
struct Bench {
  explicit Bench(const DeviceFault& fault)
      : emulator(kerf::OmniParams{}, std::nullopt), device(emulator, {{fault}, 1}) {
    const auto push = kerf::encode(kerf::OmniCommand{.motor = {0, 400, 0}, .motors_on = true});
    device.receive(push);
    device.advance(1);
    device.advance(1);
  }
  /// Packets of the next `cycles` cycles.
  std::vector<std::vector<std::uint8_t>> packets(int cycles) {
    std::vector<std::vector<std::uint8_t>> all;
    for (int i = 0; i < cycles; ++i) {
      device.advance(1);
      for (auto p = device.next_packet(); !p.empty(); p = device.next_packet()) {
        all.emplace_back(p.begin(), p.end());
      }
    }
    return all;
  }
  std::vector<std::uint32_t> counters(int cycles) {
    std::vector<std::uint32_t> all;
    for (const auto& packet : packets(cycles)) {
      const auto report = kerf::decode_report(packet);
      all.push_back(report ? report->counter : 0);
    }
    return all;
  }

  kerf::Emulator emulator;
  kerf::FaultyDevice device;
};

constexpr double kCycleS = 1.0 / 8000;

}  // namespace

TEST_CASE("without a running fault every packet passes as it is") {
  Bench bench({.kind = FaultKind::lose, .at_s = 3600});
  CHECK(bench.counters(5) == std::vector<std::uint32_t>{1, 2, 3, 4, 5});
}

TEST_CASE("a script by the emulator's clock does not wait for a push") {
  kerf::Emulator emulator(kerf::OmniParams{}, std::nullopt);
  kerf::FaultyDevice device(emulator, {.faults = {{.kind = FaultKind::silence, .for_s = 1}},
                                       .clock = kerf::FaultClock::start});
  for (int i = 0; i < 80; ++i) {
    device.advance(1);
    CHECK(device.next_packet().empty());
  }
  CHECK(device.withheld() == 80);
}

TEST_CASE("lose: each n-th packet, for as long as asked") {
  Bench bench({.kind = FaultKind::lose, .at_s = 4 * kCycleS, .for_s = 6 * kCycleS, .every = 2});
  const auto counters = bench.counters(12);
  CHECK(counters.size() == 9);
}

TEST_CASE("duplicate: twice, at once") {
  Bench bench({.kind = FaultKind::duplicate, .for_s = 1});
  CHECK(bench.counters(2) == std::vector<std::uint32_t>{1, 1, 2, 2});
}

TEST_CASE("delay: late, none lost, in order") {
  Bench bench({.kind = FaultKind::delay, .for_s = 1, .ms = 0.5});
  CHECK(bench.counters(6) == std::vector<std::uint32_t>{1, 2});
}

TEST_CASE("reorder: a packet comes after later ones") {
  Bench bench({.kind = FaultKind::reorder, .for_s = 1, .every = 100});
  const auto counters = bench.counters(12);
  REQUIRE(counters.size() >= 10);
  CHECK(counters[0] == 2);
  CHECK(std::count(counters.begin(), counters.end(), 1U) == 1);
}

TEST_CASE("truncate and corrupt: other bytes, never more") {
  Bench shorter({.kind = FaultKind::truncate, .for_s = 1});
  for (const auto& packet : shorter.packets(50)) CHECK(packet.size() < kerf::omni::kReportBytes);
  Bench wrong({.kind = FaultKind::corrupt, .for_s = 1});
  Bench right({.kind = FaultKind::lose, .at_s = 3600});
  const auto a = wrong.packets(50), b = right.packets(50);
  REQUIRE(a.size() == b.size());
  for (std::size_t i = 0; i < a.size(); ++i) CHECK(a[i] != b[i]);
}

TEST_CASE("stick, jump and park: what the device says of itself") {
  Bench right({.kind = FaultKind::lose, .at_s = 3600});
  const auto true_count = kerf::decode_report(right.packets(1)[0])->encoder[1];
  Bench jump({.kind = FaultKind::jump, .for_s = 1, .axis = 1, .counts = 100});
  const auto jumped = kerf::decode_report(jump.packets(1)[0])->encoder[1];
  CHECK(static_cast<std::int16_t>(jumped - true_count) == 100);
  Bench parked({.kind = FaultKind::park, .for_s = 1});
  CHECK(kerf::decode_report(parked.packets(1)[0])->docked);
}

TEST_CASE("silence still hears, unplug does not") {
  const auto off = kerf::encode(kerf::OmniCommand{});
  Bench silent({.kind = FaultKind::silence, .for_s = 1});
  CHECK(silent.packets(10).empty());
  silent.device.receive(off);
  silent.device.advance(1);
  CHECK_FALSE(silent.emulator.model().motors_on());
  Bench unplugged({.kind = FaultKind::unplug, .for_s = 1});
  CHECK(unplugged.packets(10).empty());
  unplugged.device.receive(off);
  unplugged.device.advance(1);
  CHECK(unplugged.emulator.model().motors_on());
}

TEST_CASE("host_late: says so for as long as it lasts") {
  Bench bench({.kind = FaultKind::host_late, .at_s = 8 * kCycleS, .ms = 1});
  int late = 0;
  for (int i = 0; i < 100; ++i) {
    bench.device.advance(1);
    late += bench.device.host_is_late() ? 1 : 0;
  }
  CHECK(late == 8);
  CHECK(bench.device.begun() == 1);
}

TEST_CASE("a fault has been met when it changed something, not when its time has come") {
  Bench lost({.kind = FaultKind::lose, .at_s = 2 * kCycleS, .for_s = 1});
  CHECK(lost.device.met() == 0);
  lost.packets(8);
  CHECK(lost.device.met() == 1);
  Bench stuck({.kind = FaultKind::stick,  // of an arm that stands still anyhow
               .at_s = 6 * kCycleS,
               .for_s = 1});
  stuck.packets(8);
  CHECK(stuck.device.begun() == 1);
  CHECK(stuck.device.met() == 0);
  Bench late({.kind = FaultKind::host_late, .ms = 1});
  late.packets(1);
  CHECK(late.device.met() == 1);
}
