// SPDX-License-Identifier: Apache-2.0
// In real time: the age of the newest packet when the servo reads it, and the time from a packet to
// the command that it caused. Figures of the machine at hand; only medians are checked.
// KERF_TIMING_SECONDS makes it longer than 2 s.
#include <atomic>
#include <cstdint>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <doctest/doctest.h>

#include "controller/device/firewire/firewire_port.hpp"
#include "hil/front/serving.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "shared/wire/omni.hpp"
#include "tests/hil/fuse/mounted_node.hpp"
#include "tests/hil/fuse/spread.hpp"

namespace kerf::firewire_timing_test {

using kerf::test::Spread;
using kerf::test::spread_of;

namespace {

/// Counts bus cycles in its packets, and sees in its commands which of them the host has read.
class EchoDevice final : public kerf::PacketDevice {
 public:
  void receive(std::span<const std::uint8_t> packet) noexcept override {
    const auto command = kerf::decode_command(packet);
    if (!command || !command->motors_on) return;
    const auto read = static_cast<std::uint32_t>(command->motor[0]);
    loops_.push_back(static_cast<std::int64_t>(counter_ + 1 - read) & 0x7FF);
  }
  void advance(int /*cycles*/) noexcept override { due_ = true; }
  std::span<const std::uint8_t> next_packet() noexcept override {
    if (!std::exchange(due_, false)) return {};
    packet_ = kerf::encode(kerf::OmniReport{.counter = ++counter_});
    return packet_;
  }
  [[nodiscard]] const std::vector<std::int64_t>& loops() const noexcept { return loops_; }

 private:
  bool due_ = false;
  std::uint32_t counter_ = 0;
  kerf::omni::ReportBytes packet_{};
  std::vector<std::int64_t> loops_;
};

struct Figures {
  Spread age_us, io_us, loop_cycles;
  std::uint64_t missed = 0;
};

/// At 1 kHz, driver and server on one core.
Figures measure(bool fill, double drift_ppm) {
  constexpr int kWarmUp = 100;
  const int ticks = kerf::test::timing_ticks();
  Figures figures;
  std::vector<std::int64_t> ages, calls;
  EchoDevice device;
  kerf::FirewireSettings settings;
  settings.clock = kerf::BusClock::real_time(drift_ppm);
  const auto clock = settings.clock;
  kerf::test::MountedDevice mounted(settings, device,
                                    [] { static_cast<void>(kerf::make_real_time(75, -1)); });
  std::thread([&] {
    static_cast<void>(kerf::make_real_time(70, -1));
    const std::atomic<bool> go_on{false};
    kerf::FirewireOptions options;
    options.where = mounted.path();
    options.fill = fill;
    kerf::FirewirePort port(options, 1000, go_on);
    std::int64_t deadline_ns = kerf::monotonic_ns();
    std::uint32_t last = 0;
    for (int tick = 0; tick < ticks; ++tick) {
      deadline_ns += 1'000'000;
      kerf::sleep_until_ns(deadline_ns);
      const std::int64_t begin_ns = kerf::monotonic_ns();
      std::array<std::uint8_t, 45> packet{};
      std::uint32_t newest = last;
      while (port.receive(packet) == 44) {
        newest = kerf::decode_report(std::span(packet).first(44))->counter;
        if (last != 0) figures.missed += newest - last - 1;
        last = newest;
      }
      const std::int64_t read_ns = kerf::monotonic_ns();
      kerf::OmniCommand command;
      command.motor[0] = static_cast<std::int16_t>(newest & 0x7FF);
      command.motors_on = tick >= kWarmUp;
      port.send(kerf::encode(command));
      const std::int64_t end_ns = kerf::monotonic_ns();
      if (tick < kWarmUp) continue;
      const auto now = clock.at(read_ns);
      const std::int64_t cycle =
          now.cycle +
          kerf::cycles_between(static_cast<std::int32_t>(now.cycle % 64'000), port.newest_cycle());
      ages.push_back((read_ns - clock.begin_ns(cycle)) / 1000);
      calls.push_back((end_ns - begin_ns) / 1000);
    }
  }).join();
  mounted.stop();
  figures.age_us = spread_of(ages);
  figures.io_us = spread_of(calls);
  figures.loop_cycles = spread_of(device.loops());
  return figures;
}

}  // namespace

TEST_CASE("a tick reads packets of the last two cycles, and its command arrives within a few") {
  struct {
    const char* name;
    bool fill;
    double drift_ppm;
  } const cases[] = {
      {"dry", false, 0}, {"filled", true, 0}, {"filled, bus 100 ppm slow", true, 100}};
  for (const auto& c : cases) {
    const Figures f = measure(c.fill, c.drift_ppm);
    MESSAGE(std::string(c.name), ": p50 / p99 / p99.9 (max): age us ", text(f.age_us),
            ", calls of a tick us ", text(f.io_us), ", loop cycles ", text(f.loop_cycles), ", ",
            f.missed, " missed");
    CHECK(f.age_us.p50 > 124);  // a packet is there when its cycle has ended
    CHECK(f.age_us.p50 < 1000);
    CHECK(f.loop_cycles.p50 <= (c.fill ? 12 : 8));
  }
}

}  // namespace kerf::firewire_timing_test
