// SPDX-License-Identifier: Apache-2.0
// The Omni's driver below its bus: the option --port fw, serial numbers, cycles, the sent queue.
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <vector>

#include <doctest/doctest.h>
#include <linux/firewire-cdev.h>

#include "controller/device/firewire/firewire_file.hpp"
#include "controller/device/firewire/firewire_streams.hpp"
#include "tests/support/errors.hpp"
#include "tests/support/temporary_folder.hpp"

namespace kerf::firewire_test {

using kerf::test::error_of;
using kerf::test::has;

TEST_CASE("--port fw takes a node or serial and options in any order after it") {
  CHECK(parse_firewire_port("").where == "");
  CHECK(parse_firewire_port(":/dev/fw1").where == "/dev/fw1");
  CHECK(parse_firewire_port(":50626300006").where == "50626300006");
  const FirewireOptions both = parse_firewire_port(":/tmp/bus,fill,20010");
  CHECK(both.where == "/tmp/bus");
  CHECK(both.fill);
  CHECK(both.write_20010);
  const FirewireOptions bare = parse_firewire_port(",20010");
  CHECK(bare.where == "");
  CHECK(bare.write_20010);
  CHECK_FALSE(bare.fill);
  CHECK(has(error_of([] { static_cast<void>(parse_firewire_port(":/dev/fw1,fast")); }),
            "'fast' is not known"));
}

TEST_CASE("the serial number is unpacked as printed, whatever bit 0 is") {
  CHECK(kerf::firewire_serial(0x82B6'980C) == "50626300006");
  CHECK(kerf::firewire_serial(0x82B6'980D) == "50626300006");
  CHECK(kerf::firewire_serial(0x83A6'D80E) == "70427300007");
}

TEST_CASE("if no device is there, one line names the way out") {
  const kerf::test::TemporaryFolder empty;
  const auto refused = [&](const std::string& where, const char* part) {
    FirewireOptions options;
    options.where = where;
    CAPTURE(where);
    CHECK(has(error_of([&] { static_cast<void>(kerf::find_firewire(options, empty.path())); }),
              part));
  };
  refused(empty.path(), "no device of SensAble is there; connect one, or try ./kerf demo");
  refused("/dev/fw-nothing", "--port fw:/dev/fw-nothing: no such node; ");
  refused("12345678901", "no device of SensAble with this serial number is there");
  refused("/dev/null", "no device of SensAble");  // it opens, and is something else
}

TEST_CASE("cycles are counted over the wrap of a stamp's eight seconds") {
  CHECK(cycle_of_stamp(0x0000) == 0);
  CHECK(cycle_of_stamp(1U << 13 | 5) == 8005);
  CHECK(cycle_of_stamp(0xFFFF'0000U | 7U << 13 | 7999) == 63'999);
  CHECK(cycles_between(0, 8) == 8);
  CHECK(cycles_between(8, 0) == -8);
  CHECK(cycles_between(63'999, 1) == 2);
  CHECK(cycles_between(1, 63'999) == -2);
  CHECK(cycles_between(0, 31'999) == 31'999);
}

namespace {

constexpr int kPeriod = 8;

/// A controller that sends one entry a cycle and reports them 64 at a time, as the kernel does.
/// The file of the transmitter is closed: only its bookkeeping is at work.
struct Engine {
  /// One tick at cycle `now`: returns in how many cycles its packet goes out.
  int tick(std::int64_t now) {
    run_to(now);
    const int skips = transmitter.wanted_skips(static_cast<std::int32_t>(now % 64'000), kPeriod);
    transmitter.send(file, packet, skips);
    if (next_cycle <= now) next_cycle = now + 1;  // woken
    const auto at = next_cycle + static_cast<std::int64_t>(queued - sent);
    queued += static_cast<std::uint64_t>(skips) + 1;
    return static_cast<int>(at - now);
  }
  void run_to(std::int64_t now) {
    while (sent < queued && next_cycle <= now) {
      stamps.push_back(next_cycle++);
      ++sent;
      if (stamps.size() == 64) tell();
    }
  }
  void tell() {
    std::vector<std::uint8_t> event(24 + 4 * stamps.size());
    fw_cdev_event_iso_interrupt head{};
    head.header_length = static_cast<std::uint32_t>(4 * stamps.size());
    std::memcpy(event.data(), &head, 20);
    for (std::size_t i = 0; i < stamps.size(); ++i) {
      const auto second = static_cast<std::uint32_t>(stamps[i] / 8000 % 8);
      const auto stamp = second << 13 | static_cast<std::uint32_t>(stamps[i] % 8000);
      event[20 + 4 * i + 2] = static_cast<std::uint8_t>(stamp >> 8);
      event[20 + 4 * i + 3] = static_cast<std::uint8_t>(stamp);
    }
    transmitter.take(event);
    stamps.clear();
  }

  kerf::FirewireFile file;
  kerf::FirewireTransmitter transmitter;
  std::array<std::uint8_t, 16> packet{};
  std::uint64_t queued = 0, sent = 0;
  std::int64_t next_cycle = 0;
  std::vector<std::int64_t> stamps;
};

}  // namespace

TEST_CASE("a filled queue keeps its depth: in step, with drift, over the wrap of the stamps") {
  for (const std::int64_t drift_ticks : {0, 200, -200}) {  // a cycle gained or lost each so often
    CAPTURE(drift_ticks);
    Engine engine;
    std::int64_t now = 60'000;
    int deepest = 0;
    for (std::int64_t tick = 0; tick < 10'000; ++tick) {
      const int delay = engine.tick(now);
      if (tick > 20) deepest = std::max(deepest, delay);
      now += kPeriod;
      if (drift_ticks != 0 && tick % drift_ticks == 0) now += drift_ticks > 0 ? 1 : -1;
    }
    CHECK(deepest <= 5);
  }
}

TEST_CASE("a filled queue is at its depth again soon after the servo was late or made up for it") {
  Engine engine;
  std::int64_t now = 1000;
  for (int i = 0; i < 100; ++i) static_cast<void>(engine.tick(now += kPeriod));
  now += 60 * kPeriod;                                         // late: the queue ran dry
  for (int i = 0; i < 60; ++i) CHECK(engine.tick(now) <= 80);  // all missed ticks at once
  int delay = 0;
  for (int i = 0; i < 20; ++i) delay = engine.tick(now += kPeriod);
  CHECK(delay <= 5);
}

}  // namespace kerf::firewire_test
