// SPDX-License-Identifier: Apache-2.0
// Conformance of the node with the kernel's firewire-cdev, by plain system calls: isochronous
// streams.
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <utility>
#include <vector>

#include <doctest/doctest.h>

#include "shared/posix/monotonic_clock.hpp"
#include "shared/wire/omni.hpp"
#include "tests/hil/fuse/firewire_bench.hpp"

namespace kerf::firewire_iso_test {

using kerf::test::Bench;
using kerf::test::Check;
using kerf::test::kReceive;
using kerf::test::kSixteen;
using kerf::test::kSkip;
using kerf::test::kTransmit;
using kerf::test::PlainClient;
using kerf::test::quadlet;
using kerf::test::rcode_of;
using kerf::test::room_for;

namespace {

constexpr std::uint32_t kInterrupt = FW_CDEV_ISO_INTERRUPT;

// clang-format off
const Check kChecks[] = {
  // ---- CREATE_ISO_CONTEXT
  {"a speed beyond S3200 is EINVAL", -EINVAL, [](Bench& b) -> std::int64_t {
    return b.client.create(kTransmit, 1, 0, 6); }},
  {"channel 64 is EINVAL", -EINVAL, [](Bench& b) -> std::int64_t {
    return b.client.create(kReceive, 64); }},
  {"a received header of 0 bytes is EINVAL", -EINVAL, [](Bench& b) -> std::int64_t {
    return b.client.create(kReceive, 1, 0); }},
  {"a received header of 6 bytes is EINVAL", -EINVAL, [](Bench& b) -> std::int64_t {
    return b.client.create(kReceive, 1, 6); }},
  {"a second context on one open is EBUSY", -EBUSY, [](Bench& b) -> std::int64_t {
    return b.client.create(kTransmit, 1) == 0 ? b.client.create(kReceive, 2) : -1; }},
  {"a channel that is received already is EBUSY", -EBUSY, [](Bench& b) -> std::int64_t {
    const PlainClient other(b.mounted.path());
    return other.create(kReceive, 7) == 0 ? b.client.create(kReceive, 7) : -1; }},
  {"the fifth receiver of a card is EBUSY", -EBUSY, [](Bench& b) -> std::int64_t {
    const PlainClient one(b.mounted.path()), two(b.mounted.path()), three(b.mounted.path()),
        four(b.mounted.path());
    std::uint32_t channel = 10;
    for (const PlainClient* c : {&one, &two, &three, &four}) {
      if (c->create(kReceive, channel++) != 0) return -1;
    }
    return b.client.create(kReceive, channel); }},
  // ---- QUEUE_ISO
  {"queueing without a context is EINVAL", -EINVAL, [](Bench& b) -> std::int64_t {
    return b.client.queue({kSkip}); }},
  {"queueing to another handle is EINVAL", -EINVAL, [](Bench& b) -> std::int64_t {
    b.client.create(kTransmit, 1);
    fw_cdev_queue_iso other{};
    other.handle = 1;
    return b.client.call(FW_CDEV_IOC_QUEUE_ISO, &other); }},
  {"a sent header of 6 bytes is EINVAL", -EINVAL, [](Bench& b) -> std::int64_t {
    b.client.create(kTransmit, 1);
    return b.client.queue({FW_CDEV_ISO_HEADER_LENGTH(6U), 0, 0}); }},
  {"a skip with a length is EINVAL", -EINVAL, [](Bench& b) -> std::int64_t {
    b.client.create(kTransmit, 1);
    return b.client.queue({kSkip | FW_CDEV_ISO_HEADER_LENGTH(4U), 0}); }},
  {"an entry beyond the announced size is EINVAL", -EINVAL, [](Bench& b) -> std::int64_t {
    b.client.create(kTransmit, 1);
    return b.client.queue({kSixteen, 0, 0, 0}); }},
  {"a received entry of no packet is EINVAL", -EINVAL, [](Bench& b) -> std::int64_t {
    b.client.create(kReceive, 2);
    return b.client.queue({0}); }},
  {"a received entry of half a packet is EINVAL", -EINVAL, [](Bench& b) -> std::int64_t {
    b.client.create(kReceive, 2);
    return b.client.queue({FW_CDEV_ISO_HEADER_LENGTH(26U)}); }},
  {"a payload without a mapped buffer is EINVAL", -EINVAL, [](Bench& b) -> std::int64_t {
    b.client.create(kReceive, 2);
    return b.client.queue({room_for(1) | FW_CDEV_ISO_PAYLOAD_LENGTH(4U)}); }},
  {"bad entries are EFAULT", -EFAULT, [](Bench& b) -> std::int64_t {
    b.client.create(kReceive, 2);
    fw_cdev_queue_iso wild{};
    wild.packets = 8;
    wild.size = 4;
    return b.client.call(FW_CDEV_IOC_QUEUE_ISO, &wild); }},
  {"the number of entries returns, and the structure tells what is left", 1,
   [](Bench& b) -> std::int64_t {
    b.client.create(kTransmit, 1);
    const std::array<std::uint32_t, 7> entries{kSkip, kSixteen, 1, 2, 3, 4, kSkip};
    fw_cdev_queue_iso after{};
    return b.client.queue(entries, &after) == 3 && after.size == 0 && after.data == 0 &&
           after.packets == reinterpret_cast<std::uintptr_t>(entries.data() + 7); }},
  {"what stood before a bad entry stays queued, and the structure as it was", 1,
   [](Bench& b) -> std::int64_t {
    b.client.create(kReceive, 2);
    const std::array<std::uint32_t, 2> entries{room_for(1), 0};
    fw_cdev_queue_iso after{};
    return b.client.queue(entries, &after) == -EINVAL && after.size == 8 && b.client.start() == 0; }},
  {"16 MiB of descriptors hold 204800 received packets; then the count is short", 204'800,
   [](Bench& b) -> std::int64_t {
    b.client.create(kReceive, 2);
    const std::vector<std::uint32_t> many(60'000, room_for(4));
    fw_cdev_queue_iso after{};
    const int count = b.client.queue(many, &after);
    return after.size == (60'000U - static_cast<std::uint32_t>(count)) * 4 ? 4 * count : -1; }},
  {"or 1032192 skipped cycles", 252 * 4096, [](Bench& b) -> std::int64_t {
    b.client.create(kTransmit, 1);
    const std::vector<std::uint32_t> many(1'100'000, kSkip);
    return b.client.queue(many); }},
  // ---- START, STOP, FLUSH
  {"starting with no tag is EINVAL", -EINVAL, [](Bench& b) -> std::int64_t {
    b.client.create(kReceive, 2);
    b.client.queue({room_for(1)});
    return b.client.start(0); }},
  {"a sync above 15 is EINVAL", -EINVAL, [](Bench& b) -> std::int64_t {
    b.client.create(kReceive, 2);
    b.client.queue({room_for(1)});
    return b.client.start(1, -1, 16); }},
  {"starting empty is ENODATA", -ENODATA, [](Bench& b) -> std::int64_t {
    b.client.create(kReceive, 2);
    return b.client.start(); }},
  {"stopping without a context is EINVAL", -EINVAL, [](Bench& b) -> std::int64_t {
    return b.client.stop(); }},
  {"a flush tells all packets in 24 + 52 n bytes", 24 + 52 * 8, [](Bench& b) -> std::int64_t {
    auto& rx = b.receiver();
    rx.flush();
    rx.flush();
    static_cast<void>(rx.event());  // of the first, which began within a cycle
    return static_cast<std::int64_t>(rx.event().size()); }},
  {"a packet has length, channel, stamp and the bytes of the bus", 1, [](Bench& b) -> std::int64_t {
    auto& rx = b.receiver();
    rx.flush();
    const auto event = rx.event();
    const auto iso = event.as<fw_cdev_event_iso_interrupt>();
    const auto data = event.data();
    const std::uint32_t header = quadlet(data, 0), stamp = quadlet(data, iso.header_length - 48);
    const auto report = kerf::decode_report(data.subspan(8, 44));
    return iso.closure == 99 && header == (44U << 16 | 2U << 8 | 0xA0U) && report &&
           report->docked && (stamp & 0xFFFF) == iso.cycle &&
           (stamp & 0x1FFF) < 100 && (stamp >> 13 & 7) == 125 % 8; }},
  {"a flush of nothing tells nothing", 0, [](Bench& b) -> std::int64_t {
    b.client.create(kReceive, 33);
    b.client.queue({room_for(1)});
    b.client.start();
    b.client.flush();
    return b.client.ready(); }},
  {"a packet whose tag is not wanted does not come", 0, [](Bench& b) -> std::int64_t {
    auto& rx = b.receiver(64, FW_CDEV_ISO_CONTEXT_MATCH_TAG1);
    rx.flush();
    rx.flush();
    return rx.ready(); }},
  {"without interrupt or flush nothing is told, however much has come", 0,
   [](Bench& b) -> std::int64_t {
    auto& rx = b.receiver();
    b.pass(4);
    return rx.ready(); }},
  {"an interrupt tells all up to its packet", 24 + 52 * 12, [](Bench& b) -> std::int64_t {
    b.stream();
    b.client.create(kReceive, 2);
    b.client.queue({room_for(4), room_for(4), room_for(4, true), room_for(4)});
    b.client.start();
    b.pass(4);
    return static_cast<std::int64_t>(b.client.event().size()); }},
  {"a page of headers holds 78 packets; the rest is another event", 24 + 52 * 78,
   [](Bench& b) -> std::int64_t {
    auto& rx = b.receiver(100);
    b.pass(20);
    rx.flush();
    const auto first = rx.event(), second = rx.event();
    return second.size() == 24 + 52 * 22 ? static_cast<std::int64_t>(first.size()) : -1; }},
  {"a client of version 4 loses what a page cannot hold", 1, [](Bench& b) -> std::int64_t {
    b.stream();
    b.client.info(4);
    b.client.create(kReceive, 2);
    for (int i = 0; i < 25; ++i) b.client.queue({room_for(4)});
    b.client.start();
    b.pass(20);
    b.client.flush();
    return b.client.event().size() == 24 + 52 * 78 && !b.client.ready(); }},
  {"an empty queue loses packets, and no event says so", 1, [](Bench& b) -> std::int64_t {
    auto& rx = b.receiver(4);
    b.pass(2);
    rx.flush();
    const auto first = kerf::decode_report(rx.event().data().subspan(3 * 52 + 8, 44));
    rx.queue({room_for(4)});
    rx.flush();
    const auto later = kerf::decode_report(rx.event().data().subspan(8, 44));
    return first && later && later->counter > first->counter + 1; }},
  {"done but untold packets run again after STOP and START", 24 + 52 * 4,
   [](Bench& b) -> std::int64_t {
    auto& rx = b.receiver(4);
    b.pass(2);
    rx.stop();
    rx.start();
    rx.flush();
    return static_cast<std::int64_t>(rx.event().size()); }},
  {"a sent entry is told by 4 bytes, a skipped one too", 24 + 4 * 3, [](Bench& b) -> std::int64_t {
    b.client.create(kTransmit, 1);
    b.client.queue({kSixteen, 0, 0, 0, 0, kSkip, kSkip | kInterrupt});
    b.client.start();
    b.pass(2);
    return static_cast<std::int64_t>(b.client.event().size()); }},
  {"a dry transmitter is woken by the next entry, not by a refused one", 1,
   [](Bench& b) -> std::int64_t {
    b.client.create(kTransmit, 1);
    b.client.queue({kSkip});
    b.client.start();
    b.pass(2);
    b.client.queue({kSkip, kSkip | FW_CDEV_ISO_HEADER_LENGTH(4U), 0});
    b.pass(2);
    b.client.flush();
    const auto before = b.client.event();
    b.client.queue({kSkip});
    b.pass(2);
    b.client.flush();
    const auto after = b.client.event();
    return before.size() == 24 + 4 && after.size() == 24 + 8; }},
};
// clang-format on

}  // namespace

TEST_CASE("streams run as with the kernel's firewire-cdev") {
  kerf::test::run(kChecks);
}

TEST_CASE("a device receives packets of its channel with tag 0, once it streams") {
  struct : kerf::PacketDevice {
    void receive(std::span<const std::uint8_t> /*packet*/) noexcept override { ++heard; }
    void advance(int /*cycles*/) noexcept override {}
    std::span<const std::uint8_t> next_packet() noexcept override { return {}; }
    std::atomic<int> heard{0};
  } device;
  const kerf::test::MountedDevice mounted(FirewireSettings{}, device);
  const PlainClient client(mounted.path()), sender(mounted.path()), watch(mounted.path());
  REQUIRE(sender.create(kTransmit, 1) == 0);
  REQUIRE(watch.create(kReceive, 60) == 0);
  REQUIRE(sender.queue({kSkip}) == 1);
  REQUIRE(sender.start() == 0);
  const auto send = [&](std::uint32_t tag) {
    sender.queue({kSixteen | FW_CDEV_ISO_TAG(tag), 0, 0, 0, 0});
    watch.flush();
    return device.heard.load();
  };
  CHECK(send(0) == 0);
  for (const auto& [offset, value] : {std::pair{0x1000, 1}, {0x1087, 8}}) {
    client.write_byte(static_cast<std::uint64_t>(offset), static_cast<std::uint8_t>(value));
    CHECK(rcode_of(client) == 0);
  }
  CHECK(send(1) == 0);
  CHECK(send(0) == 1);
  client.write_byte(0x1000, 5);
  CHECK(rcode_of(client) == 0);
  CHECK(send(0) == 1);
}

TEST_CASE("in real time a sleeping poll is woken by an interrupt, and the stream keeps its pace") {
  FirewireSettings settings;
  settings.clock = kerf::BusClock::real_time();
  Bench bench(settings);
  bench.stream();
  PlainClient rx(bench.mounted.path());
  REQUIRE(rx.create(kReceive, 2) == 0);
  for (int i = 0; i < 500; ++i) rx.queue({room_for(4), room_for(4, true)});
  const std::int64_t begin_ns = kerf::monotonic_ns();
  REQUIRE(rx.start() == 0);
  std::uint32_t last = 0, lost = 0;
  for (int i = 0; i < 400; ++i) {
    const auto event = rx.event();
    REQUIRE(event.size() == 24 + 8 * 52);
    for (std::size_t at = 0; at < 8; ++at) {
      const auto report = kerf::decode_report(event.data().subspan(52 * at + 8, 44));
      REQUIRE(report);
      if (last != 0) lost += report->counter - last - 1;
      last = report->counter;
    }
  }
  const double took_ms = static_cast<double>(kerf::monotonic_ns() - begin_ns) / 1e6;
  CHECK(lost == 0);
  CHECK(took_ms > 399);  // 3200 packets at 8 kHz cannot come sooner
}

}  // namespace kerf::firewire_iso_test
