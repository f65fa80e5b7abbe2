// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <cstdint>
#include <vector>

#include <doctest/doctest.h>

#include "controller/loop/allocation_counter.hpp"
#include "tests/hil/fuse/lockstep_session.hpp"

using kerf::FirewireSettings;
using kerf::test::FirewireSession;

TEST_CASE("the driver finds the device, reads every packet and is heard each tick") {
  constexpr int kTicks = 1000;
  FirewireSession session;
  CHECK(session.port().device().serial == "50626300006");
  for (int i = 0; i < kTicks; ++i) CHECK(session.tick().report.fresh);
  CHECK(session.driver().lost() == 0);
  CHECK(session.driver().refused() == 0);
  CHECK(session.port().misqueued() == 0);
  CHECK(session.port().stats().armings == 1);
  session.end();

  const auto& node = session.mounted().node();
  CHECK(node.bus().stats().commands >= kTicks);
  CHECK(node.bus().stats().unheard == 0);
  CHECK(node.double_starts() == 0);
  CHECK(node.events_high_water() <= 4);  // it reads what it causes
  CHECK(session.mounted().emulator().stats().refused == 0);
  CHECK_FALSE(session.mounted().emulator().model().motors_on());
  CHECK_FALSE(node.bus().registers().streams());  // its enable bit is clear again
  CHECK(node.bus().registers().mode_20010() == 0);
}

TEST_CASE("the device's cycle of a packet moves by one servo period a tick, over its wrap") {
  FirewireSession session;
  static_cast<void>(session.tick());
  std::int32_t last = session.port().newest_cycle();
  for (int i = 0; i < 5000; ++i) {
    static_cast<void>(session.tick());
    const std::int32_t now = session.port().newest_cycle();
    CHECK(kerf::cycles_between(last, now) == 8);
    last = now;
  }
}

TEST_CASE("in lock-step a run above the servo is repeated bit by bit") {
  constexpr int kTicks = 10'000;
  std::vector<std::uint64_t> command_hashes, output_hashes;
  for (int run = 0; run < 2; ++run) {
    FirewireSession session;
    std::uint64_t output_hash = 0;
    int contact = 0;
    const auto begin = std::chrono::steady_clock::now();
    for (int i = 0; i < kTicks; ++i) {
      const auto tick = session.tick();
      output_hash = tick.output.output_hash;
      contact += tick.output.contact ? 1 : 0;
    }
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
    session.end();
    const double calls = static_cast<double>(session.mounted().mount().requests());
    MESSAGE((kTicks / took.count()), " ticks/s, ", (calls / kTicks), " calls a tick");
    CHECK(contact > 1000);
    command_hashes.push_back(session.mounted().node().bus().stats().command_hash);
    output_hashes.push_back(output_hash);
  }
  CHECK(command_hashes[0] == command_hashes[1]);
  CHECK(output_hashes[0] == output_hashes[1]);
}

TEST_CASE("a tick of the driver allocates nothing") {
  FirewireSession session;
  kerf::ServoOutput output;
  for (int i = 0; i < 100; ++i) static_cast<void>(session.tick());
  const std::uint64_t before = kerf::CountedAllocations::total();
  {
    const kerf::CountedAllocations counted;
    for (int i = 0; i < 2000; ++i) {
      static_cast<void>(session.driver().read());
      session.driver().command(output);
    }
  }
  CHECK(kerf::CountedAllocations::total() == before);
}

TEST_CASE("a device of 1 kHz, a filled queue and the disputed register work, too") {
  for (const bool slow : {false, true}) {
    for (const bool fill : {false, true}) {
      CAPTURE(slow);
      CAPTURE(fill);
      FirewireSettings settings;
      settings.packet_cycles = slow ? 8 : 1;
      settings.abi_version = slow ? 6 : 5;  // a newer kernel, too
      kerf::FirewireOptions options;
      options.write_20010 = true;
      options.fill = fill;
      FirewireSession session(settings, options);
      int fresh = 0;
      for (int i = 0; i < 3000; ++i) fresh += session.tick().report.fresh ? 1 : 0;
      CHECK(fresh >= 2999);
      CHECK(session.driver().lost() == 0);
      session.end();
      const auto& stats = session.mounted().node().bus().stats();
      // What is still queued at the end is at most a servo period and its margin.
      CHECK(stats.commands >= 2998);
      CHECK(session.mounted().node().bus().registers().mode_20010() == 0x0FF8);
      CHECK(session.mounted().node().events_high_water() <= 4);
    }
  }
}

TEST_CASE("two sessions, one after the other, on one node") {
  const kerf::test::MountedNode mounted;
  const std::atomic<bool> go_on{false};
  for (int i = 0; i < 3; ++i) {
    kerf::FirewireOptions options;
    options.where = mounted.folder();  // the only device in there
    kerf::FirewirePort port(options, 0, go_on);
    kerf::OmniDriver driver(port);
    CHECK(driver.wait(100));
    CHECK(driver.read().fresh);
  }
}
