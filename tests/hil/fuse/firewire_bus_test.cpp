// SPDX-License-Identifier: Apache-2.0
// Conformance of the node with the kernel's firewire-cdev, by plain system calls: channels and
// bandwidth, bus resets, a lost device.
#include <array>
#include <cerrno>
#include <cstdint>
#include <utility>
#include <vector>

#include <doctest/doctest.h>

#include "tests/hil/fuse/firewire_bench.hpp"

namespace kerf::firewire_bus_test {

using kerf::test::Bench;
using kerf::test::Check;
using kerf::test::kControl;
using kerf::test::PlainClient;
using kerf::test::rcode_of;

namespace {

int channel_of(const PlainClient& client, int milliseconds = 1000) {
  return client.event(milliseconds).as<fw_cdev_event_iso_resource>().channel;
}

FirewireSettings seconds_per_flush(std::vector<kerf::ScriptedFault> script = {}) {
  FirewireSettings settings;
  settings.lockstep_cycles = 8000;
  settings.script = std::move(script);
  return settings;
}

// clang-format off
const Check kChecks[] = {
  // ---- channels and bandwidth
  {"asking for nothing is EINVAL", -EINVAL, [](Bench& b) -> std::int64_t {
    return b.client.allocate(0, 0); }},
  {"more than a cycle of bandwidth is EINVAL", -EINVAL, [](Bench& b) -> std::int64_t {
    return b.client.allocate(1, 4916); }},
  {"the lowest channel of the mask is given; bit 0 is channel 0", 3, [](Bench& b) -> std::int64_t {
    std::uint32_t handle = 9;
    return b.client.allocate(0x28, 100, &handle) == 0 && handle == 0 ? channel_of(b.client) : -1; }},
  {"a channel in use is refused by an event", -EBUSY, [](Bench& b) -> std::int64_t {
    const PlainClient other(b.mounted.path());
    other.allocate(0x20, 0);
    static_cast<void>(other.event());
    b.client.allocate(0x20, 700);
    const auto event = b.client.event().as<fw_cdev_event_iso_resource>();
    return event.bandwidth == 0 ? event.channel : 1; }},
  {"bandwidth runs out", -EBUSY, [](Bench& b) -> std::int64_t {
    b.client.allocate(1, 4000);
    static_cast<void>(b.client.event());
    b.client.allocate(2, 1000);
    return channel_of(b.client); }},
  {"an unknown handle is EINVAL", -EINVAL, [](Bench& b) -> std::int64_t {
    fw_cdev_deallocate none{3};
    return b.client.call(FW_CDEV_IOC_DEALLOCATE_ISO_RESOURCE, &none); }},
  {"what is given back is told, and free again", 5, [](Bench& b) -> std::int64_t {
    fw_cdev_deallocate first{0};
    b.client.allocate(0x20, 4000);
    static_cast<void>(b.client.event());
    b.client.call(FW_CDEV_IOC_DEALLOCATE_ISO_RESOURCE, &first);
    if (b.client.event().type() != FW_CDEV_EVENT_ISO_RESOURCE_DEALLOCATED) return -1;
    b.client.allocate(0x20, 4000);
    return channel_of(b.client); }},
  {"closing gives everything back", 5, [](Bench& b) -> std::int64_t {
    {
      const PlainClient other(b.mounted.path());
      other.allocate(0x20, 4000);
      static_cast<void>(other.event());
    }
    b.client.allocate(0x20, 4000);
    return channel_of(b.client); }},
  {"for a second after a reset nothing new is given", 1, [](Bench& b) -> std::int64_t {
    b.pass(1);  // the reset
    b.client.allocate(1, 100);
    b.pass(100);
    while (b.client.ready() != 0) {
      if (b.client.event().type() != FW_CDEV_EVENT_BUS_RESET) return -1;
    }
    return channel_of(b.client) == 0; },
   [] { FirewireSettings s; s.script = {{4, BusFault::reset}}; return s; }},
  // ---- faults
  {"a stream runs on through a bus reset", 24 + 52 * 8, [](Bench& b) -> std::int64_t {
    auto& rx = b.receiver();
    std::size_t last = 0;
    bool reset = false;
    for (int i = 0; i < 6; ++i) {
      rx.flush();
      while (rx.ready() != 0) {
        const auto event = rx.event();
        if (event.type() == FW_CDEV_EVENT_BUS_RESET) reset = true;
        else last = event.size();
      }
    }
    return reset ? static_cast<std::int64_t>(last) : -1; },
   [] { FirewireSettings s; s.script = {{30, BusFault::reset}}; return s; }},
  {"a device that forgets its channels in a reset falls silent", 1, [](Bench& b) -> std::int64_t {
    auto& rx = b.receiver();
    for (int i = 0; i < 4; ++i) rx.flush();
    while (rx.ready() != 0) static_cast<void>(rx.event());
    rx.flush();
    return !rx.ready(); },
   [] { FirewireSettings s; s.script = {{20, BusFault::reset}}; s.reset_stops_stream = true;
        return s; }},
  {"a reset by the device changes the generation at once and is told half a second later", 1,
   [](Bench& b) -> std::int64_t {
    b.pass(1);
    const bool early = b.client.ready() != 0;
    const std::uint32_t generation = b.client.info();
    b.pass(500);
    return !early && generation == 2 && b.client.event(0).size() == 40; },
   [] { FirewireSettings s; s.script = {{4, BusFault::device_reset}}; return s; }},
  {"a channel that another node takes in a reset is lost by an event", -EBUSY,
   [](Bench& b) -> std::int64_t {
    b.client.allocate(0x30, 100);
    if (channel_of(b.client) != 4) return 1;
    b.pass(1);
    const auto first = b.client.event(0), second = b.client.event(0);
    const auto& lost = first.type() == FW_CDEV_EVENT_BUS_RESET ? second : first;
    return lost.type() == FW_CDEV_EVENT_ISO_RESOURCE_DEALLOCATED
               ? lost.as<fw_cdev_event_iso_resource>().channel : 1; },
   [] { return seconds_per_flush({{5000, BusFault::steal}}); }},
  {"a resource survives a reset without a word", 1, [](Bench& b) -> std::int64_t {
    b.client.allocate(0x30, 100);
    if (channel_of(b.client) != 4) return 0;
    b.pass(1);
    return b.client.event(0).type() == FW_CDEV_EVENT_BUS_RESET && !b.client.ready(); },
   [] { return seconds_per_flush({{5000, BusFault::reset}}); }},
  {"for two seconds a lost device is only silent: requests get 0x14", 0x14,
   [](Bench& b) -> std::int64_t {
    b.pass(1);
    return !b.client.ready() && b.client.write_byte(kControl, 0) == 0 ? rcode_of(b.client) : -1; },
   [] { return seconds_per_flush({{5000, BusFault::vanish}}); }},
  {"then everything is ENODEV and the name is gone", 1, [](Bench& b) -> std::int64_t {
    b.pass(3);
    std::array<char, 64> buffer{};
    const bool read_fails = read(b.client.fd(), buffer.data(), buffer.size()) < 0 && errno == ENODEV;
    pollfd watched{b.client.fd(), POLLIN, 0};
    poll(&watched, 1, 0);
    const bool open_fails = open(b.mounted.path().c_str(), O_RDWR) < 0 && errno == ENOENT;
    return read_fails && open_fails && b.client.write_byte(kControl, 0) == -ENODEV &&
           watched.revents == (POLLHUP | POLLERR); },
   [] { return seconds_per_flush({{5000, BusFault::vanish}}); }},
  {"a device that is back within two seconds is a bus reset", 1, [](Bench& b) -> std::int64_t {
    b.pass(3);
    return b.client.event(0).type() == FW_CDEV_EVENT_BUS_RESET &&
           b.client.write_byte(kControl, 0) == 0 && rcode_of(b.client) == 0; },
   [] { return seconds_per_flush({{5000, BusFault::vanish}, {15'000, BusFault::back}}); }},
  {"a device that is back later can be opened, old opens stay dead", 1,
   [](Bench& b) -> std::int64_t {
    b.pass(1);
    const PlainClient fresh(b.mounted.path());
    return fresh.info() > 0 && b.client.info() == 0; },
   [] { auto s = seconds_per_flush({{5000, BusFault::vanish}, {29'000, BusFault::back}});
        s.lockstep_cycles = 32'000; return s; }},
};
// clang-format on

}  // namespace

TEST_CASE("resources, resets and loss are reported as by the kernel's firewire-cdev") {
  kerf::test::run(kChecks);
}

}  // namespace kerf::firewire_bus_test
