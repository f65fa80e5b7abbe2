// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include <doctest/doctest.h>

#include "controller/device/firewire_port.hpp"
#include "controller/device/omni_driver.hpp"
#include "controller/shell/allocation_counter.hpp"
#include "hil/hand_script_file.hpp"
#include "tests/hil/fuse/mounted_node.hpp"
#include "tests/servo/support.hpp"

using kerf::BusFault;
using kerf::FirewirePort;
using kerf::FirewireSettings;
using kerf::OmniDriver;
using kerf::ServoOutput;
using kerf::test::MountedNode;

namespace {

const std::atomic<bool> kGoOn{false};

kerf::FirewireOptions options_for(const MountedNode& mounted) {
  kerf::FirewireOptions options;
  options.where = mounted.path();
  return options;
}

/// A driver and a servo that touches a half-space, in lock-step with a mounted node.
struct Session {
  struct Tick {
    kerf::DeviceReport report;
    ServoOutput output;
  };
  explicit Session(const FirewireSettings& settings, kerf::FirewireOptions extra = {})
      : mounted(settings, {}, kerf::read_hand_script(KERF_HANDS "/touch.toml")) {
    kerf::FirewireOptions options = options_for(mounted);
    options.write_20010 = extra.write_20010;
    options.fill = extra.fill;
    port = std::make_unique<FirewirePort>(options, 1000, kGoOn);
    driver = std::make_unique<OmniDriver>(*port);
    servo = kerf::compile(scene);
  }
  ~Session() {
    driver.reset();
    port.reset();
  }
  Tick tick() {
    Tick now;
    now.report = driver->read();
    now.output = servo->step(now.report);
    driver->command(now.output);
    return now;
  }
  /// Ends the driver and then the node.
  void end() {
    driver.reset();
    port.reset();
    mounted.stop();
  }

  MountedNode mounted;
  kerf::Scene scene = kerf::test::half_space_scene();
  std::unique_ptr<FirewirePort> port;
  std::unique_ptr<OmniDriver> driver;
  std::unique_ptr<kerf::Servo> servo;
};

}  // namespace

TEST_CASE("the driver finds the device, reads every packet and is heard each tick") {
  Session session({});
  CHECK(session.port->device().serial == "50626300006");
  for (int i = 0; i < 1000; ++i) {
    const auto tick = session.tick();
    CHECK(tick.report.fresh);
  }
  CHECK(session.driver->lost() == 0);
  CHECK(session.driver->refused() == 0);
  CHECK(session.port->misqueued() == 0);
  CHECK(session.port->stats().armings == 1);
  session.end();
  const auto& stats = session.mounted.node().bus().stats();
  CHECK(stats.commands >= 1000);
  CHECK(stats.unheard == 0);
  CHECK(session.mounted.emulator().stats().refused == 0);
  CHECK_FALSE(session.mounted.emulator().model().motors_on());
}

TEST_CASE("in lock-step a run above the servo is repeated bit by bit") {
  constexpr int kTicks = 10'000;
  std::vector<std::uint64_t> command_hashes, output_hashes;
  for (int run = 0; run < 2; ++run) {
    Session session({});
    std::uint64_t output_hash = 0;
    int contact = 0;
    const auto begin = std::chrono::steady_clock::now();
    for (int i = 0; i < kTicks; ++i) {
      const auto tick = session.tick();
      output_hash = tick.output.output_hash;
      contact += tick.output.contact ? 1 : 0;
    }
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
    MESSAGE((kTicks / took.count()), " ticks/s, ",
            (static_cast<double>(session.mounted.mount().requests()) / kTicks), " calls a tick");
    CHECK(contact > 1000);
    session.end();
    command_hashes.push_back(session.mounted.node().bus().stats().command_hash);
    output_hashes.push_back(output_hash);
  }
  CHECK(command_hashes[0] == command_hashes[1]);
  CHECK(output_hashes[0] == output_hashes[1]);
}
