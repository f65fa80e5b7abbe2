// SPDX-License-Identifier: Apache-2.0
#include "controller/loop/servo_loop.hpp"

#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include <doctest/doctest.h>
#include <unistd.h>

#include "controller/device/device_driver.hpp"
#include "controller/load/scene_json.hpp"
#include "controller/plan/compile.hpp"
#include "controller/run/run_start.hpp"
#include "shared/segment/reader.hpp"
#include "shared/wire/omni.hpp"
#include "tests/servo/support.hpp"

namespace {

/// Says nothing, and counts what it is told.
struct SilentPort final : kerf::PacketPort {
  std::size_t receive(std::span<std::uint8_t>) noexcept override { return 0; }
  bool send(std::span<const std::uint8_t> packet) noexcept override {
    ++sent;
    const auto command = kerf::decode_command(packet);
    pushed += command && !command->motors_on ? 0 : 1;
    return true;
  }
  bool closed() const noexcept override { return false; }
  bool wait(int) noexcept override { return false; }
  std::uint64_t sent = 0, pushed = 0;
};

/// As fast as it goes.
struct NoClock final : kerf::TickSource {
  std::int64_t wait_next() noexcept override { return 0; }
  [[nodiscard]] std::uint64_t overruns() const noexcept override { return 0; }
};

}  // namespace

TEST_CASE("a device that says nothing for 2000 ticks ends the loop, and no motor was on") {
  kerf::LoadedScene scene = kerf::test::half_space_scene(32);
  const auto servo = kerf::plan_scene(scene);
  const std::string json = kerf::canonical_json(scene);
  auto segment = kerf::SegmentWriter::create(kerf::segment_spec(scene, json, 0));
  kerf::SegmentServer server("silent-" + std::to_string(getpid()), segment, {.tools = 1});
  servo->take(scene);
  SilentPort port;
  kerf::OmniDriver device(port);
  NoClock clock;
  kerf::Publisher eyes(segment, *servo);
  std::atomic<bool> stop{false};
  kerf::LoopSignals signals{stop};
  kerf::RunRecord record;
  // A loop that forgets its limit would not end: this many ticks do.
  const kerf::LoopLimits limits{.arming_ticks = 10'000};
  CHECK(kerf::run_servo(clock, device, *servo, eyes, server, limits, signals, record) ==
        kerf::EndReason::device_gone);
  CHECK(signals.heartbeat == 2000);
  CHECK(port.sent == 2001);  // the last one on the way out
  CHECK(port.pushed == 0);

  // A place that is not known is told as none.
  const auto told = kerf::SegmentReader::map(segment.fd()).latest();
  REQUIRE(told);
  CHECK(told->tick == 2000);
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(std::isnan(told->position_mm[i]));
    CHECK(std::isnan(told->velocity_mm_per_s[i]));
  }
}
