// SPDX-License-Identifier: Apache-2.0
// Conformance of the node with the kernel's firewire-cdev, by plain system calls: one table.
#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <ctime>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <doctest/doctest.h>
#include <sys/mman.h>
#include <sys/time.h>

#include "shared/wire/omni_packet.hpp"
#include "tests/hil/fuse/mounted_node.hpp"
#include "tests/hil/fuse/plain_client.hpp"

using kerf::BusFault;
using kerf::FirewireSettings;
using kerf::test::MountedNode;
using kerf::test::PlainClient;
using kerf::test::room_for;

namespace {

constexpr std::uint32_t kTransmit = FW_CDEV_ISO_CONTEXT_TRANSMIT;
constexpr std::uint32_t kReceive = FW_CDEV_ISO_CONTEXT_RECEIVE;
constexpr std::uint32_t kInterrupt = FW_CDEV_ISO_INTERRUPT;
constexpr std::uint32_t kSkip = FW_CDEV_ISO_SKIP;
constexpr std::uint32_t kSixteen = FW_CDEV_ISO_HEADER_LENGTH(16U);
constexpr std::uint64_t kControl = 0x1087;

/// Nodes in lock-step where a flush of a received stream lets 8 cycles pass, or a second.
struct Bench {
  explicit Bench(FirewireSettings settings = {}) : mounted(settings), client(mounted.path()) {}

  /// Makes the device stream on channel 2; an open that receives it, started.
  void stream() {
    for (const auto& [offset, value] : {std::pair{0x1000, 1}, {0x1001, 2}, {0x1087, 8}}) {
      client.write_byte(static_cast<std::uint64_t>(offset), static_cast<std::uint8_t>(value));
      static_cast<void>(client.event());
    }
  }
  PlainClient& receiver(std::uint32_t packets = 64, std::uint32_t tags = 15) {
    stream();
    opened = std::make_unique<PlainClient>(mounted.path());
    opened->create(kReceive, 2);
    for (std::uint32_t i = 0; i < packets / 4; ++i) opened->queue({room_for(4)});
    if (packets % 4 != 0) opened->queue({room_for(packets % 4)});
    opened->start(tags);
    return *opened;
  }
  /// Lets `flushes` steps pass: by a stream of its own, on a channel where nothing comes.
  void pass(int flushes) {
    if (!watch) {
      watch = std::make_unique<PlainClient>(mounted.path());
      watch->create(kReceive, 60);
    }
    for (int i = 0; i < flushes; ++i) watch->flush();
  }

  MountedNode mounted;
  PlainClient client;
  std::unique_ptr<PlainClient> opened, watch;
};

std::uint32_t rcode_of(const PlainClient& client) {
  return client.event().as<fw_cdev_event_response>().rcode;
}

int channel_of(const PlainClient& client, int milliseconds = 1000) {
  return client.event(milliseconds).as<fw_cdev_event_iso_resource>().channel;
}

FirewireSettings seconds_per_flush(std::vector<kerf::ScriptedFault> script = {}) {
  FirewireSettings settings;
  settings.lockstep_cycles = 8000;
  settings.script = std::move(script);
  return settings;
}

std::uint32_t quadlet(std::span<const std::uint8_t> bytes, std::size_t at) {
  return static_cast<std::uint32_t>(bytes[at] << 24 | bytes[at + 1] << 16 | bytes[at + 2] << 8 |
                                    bytes[at + 3]);
}

void ignore_signal(int /*signal*/) {}

struct Check {
  const char* name;
  std::int64_t expected;
  std::int64_t (*run)(Bench& bench);
  FirewireSettings (*settings)() = [] { return FirewireSettings{}; };
};

// clang-format off
const Check kChecks[] = {
  // ---- any call
  {"an unknown number is ENOTTY", -ENOTTY, [](Bench& b) -> std::int64_t {
    return b.client.call(_IO('#', 0x19), static_cast<int*>(nullptr)); }},
  {"another type is ENOTTY", -ENOTTY, [](Bench& b) -> std::int64_t {
    return b.client.call(_IO('!', 0x00), static_cast<int*>(nullptr)); }},
  {"a structure larger than any is ENOTTY", -ENOTTY, [](Bench& b) -> std::int64_t {
    std::array<char, 48> big{};
    return b.client.call(_IOC(_IOC_WRITE, '#', 0x00, 48), &big); }},
  {"PHY packets are refused; FUSE makes ENOTTY of ENOSYS", -ENOTTY, [](Bench& b) -> std::int64_t {
    fw_cdev_receive_phy_packets none{};
    return b.client.call(FW_CDEV_IOC_RECEIVE_PHY_PACKETS, &none); }},
  {"lseek() is ESPIPE", ESPIPE, [](Bench& b) -> std::int64_t {
    return lseek(b.client.fd(), 0, SEEK_SET) < 0 ? errno : 0; }},
  {"mmap() is ENODEV", ENODEV, [](Bench& b) -> std::int64_t {
    void* at = mmap(nullptr, 4096, PROT_READ, MAP_SHARED, b.client.fd(), 0);
    return at == MAP_FAILED ? errno : 0; }},
  {"write() is EINVAL", EINVAL, [](Bench& b) -> std::int64_t {
    return write(b.client.fd(), "x", 1) < 0 ? errno : 0; }},
  {"a name that is not there is ENOENT", ENOENT, [](Bench& b) -> std::int64_t {
    return open((b.mounted.folder() + "/fw2").c_str(), O_RDWR) < 0 ? errno : 0; }},
  {"many opens are separate clients", 1, [](Bench& b) -> std::int64_t {
    const PlainClient second(b.mounted.path()), third(b.mounted.path());
    b.client.write_byte(kControl, 0);
    return (b.client.ready(100) & POLLIN) != 0 && !second.ready() && !third.ready(); }},
  // ---- GET_INFO
  {"the interface has version 5", 5, [](Bench& b) -> std::int64_t {
    fw_cdev_get_info info{};
    b.client.call(FW_CDEV_IOC_GET_INFO, &info);
    return info.version; }},
  {"a short ROM buffer gets its part, and the full length", 1, [](Bench& b) -> std::int64_t {
    std::array<std::uint32_t, 3> rom{0, 0, 0xAAAA'AAAA};
    fw_cdev_get_info info{};
    info.rom = reinterpret_cast<std::uintptr_t>(rom.data());
    info.rom_length = 8;
    b.client.call(FW_CDEV_IOC_GET_INFO, &info);
    return info.rom_length == 32 && rom[1] == 0x3133'3934 && rom[2] == 0xAAAA'AAAA; }},
  {"the ROM names vendor, serial and their checksums", 1, [](Bench& b) -> std::int64_t {
    std::array<std::uint32_t, 8> rom{};
    fw_cdev_get_info info{};
    info.rom = reinterpret_cast<std::uintptr_t>(rom.data());
    info.rom_length = sizeof rom;
    b.client.call(FW_CDEV_IOC_GET_INFO, &info);
    return rom[3] == 0x000B'9900 && rom[4] == 0x82B6'980C && rom[0] >> 16 == 0x0404 &&
           (rom[0] & 0xFFFF) != 0 && rom[6] == 0x0300'0B99; }},
  {"a bad ROM pointer is EFAULT", -EFAULT, [](Bench& b) -> std::int64_t {
    fw_cdev_get_info info{};
    info.rom = 8;
    info.rom_length = 4;
    return b.client.call(FW_CDEV_IOC_GET_INFO, &info); }},
  {"a reset event comes to who asked for it, 40 bytes with its closure", 1,
   [](Bench& b) -> std::int64_t {
    const PlainClient deaf(b.mounted.path(), false);
    fw_cdev_initiate_bus_reset how{FW_CDEV_SHORT_RESET};
    b.client.call(FW_CDEV_IOC_INITIATE_BUS_RESET, &how);
    const auto event = b.client.event();
    return event.size() == 40 && event.type() == FW_CDEV_EVENT_BUS_RESET &&
           event.as<fw_cdev_event_bus_reset>().closure == 77 &&
           event.as<fw_cdev_event_bus_reset>().generation == 2 && !deaf.ready(); }},
  {"the speed is S400", 2, [](Bench& b) -> std::int64_t {
    return b.client.call(FW_CDEV_IOC_GET_SPEED, static_cast<int*>(nullptr)); }},
  // ---- SEND_REQUEST
  {"an unknown transaction is EINVAL", -EINVAL, [](Bench& b) -> std::int64_t {
    return b.client.request(0x2, kControl, 4); }},
  {"more than the speed carries is EIO", -EIO, [](Bench& b) -> std::int64_t {
    return b.client.request(TCODE_READ_BLOCK_REQUEST, kControl, 2049); }},
  {"half a quadlet is EINVAL", -EINVAL, [](Bench& b) -> std::int64_t {
    return b.client.request(TCODE_WRITE_QUADLET_REQUEST, kControl, 2); }},
  {"bad data are EFAULT", -EFAULT, [](Bench& b) -> std::int64_t {
    return b.client.request(TCODE_WRITE_BLOCK_REQUEST, kControl, 4,
                            reinterpret_cast<const void*>(8)); }},
  {"a stale generation is answered with 0x13", 0x13, [](Bench& b) -> std::int64_t {
    return b.client.request(TCODE_READ_BLOCK_REQUEST, kControl, 1, nullptr, 0, 9) != 0
               ? -1 : rcode_of(b.client); }},
  {"an address without a register is answered with 7", 7, [](Bench& b) -> std::int64_t {
    return b.client.write_byte(0x1234, 0) != 0 ? -1 : rcode_of(b.client); }},
  {"a register of another width is answered with 6", 6, [](Bench& b) -> std::int64_t {
    return b.client.request(TCODE_READ_BLOCK_REQUEST, kControl, 2) != 0 ? -1
                                                                       : rcode_of(b.client); }},
  {"a quadlet comes twice in 28 bytes, in the order of the bus", 1, [](Bench& b) -> std::int64_t {
    b.client.request(TCODE_READ_QUADLET_REQUEST, 0x1006'0010, 4, nullptr, 5);
    const auto event = b.client.event();
    return event.size() == 28 && event.as<fw_cdev_event_response>().closure == 5 &&
           event.as<fw_cdev_event_response>().length == 4 &&
           quadlet(event.bytes, 20) == 0x82B6'980C && quadlet(event.bytes, 24) == 0x82B6'980C; }},
  {"a register that was written reads the same", 0x40, [](Bench& b) -> std::int64_t {
    b.client.write_byte(0x1001, 0x40);
    static_cast<void>(b.client.event());
    b.client.request(TCODE_READ_BLOCK_REQUEST, 0x1001, 1);
    const auto event = b.client.event();
    return event.size() == 25 ? event.bytes[20] : -1; }},
  {"the answer to a write has 24 bytes", 24, [](Bench& b) -> std::int64_t {
    const std::array<std::uint8_t, 4> mode{0x00, 0x00, 0x0F, 0xF8};
    b.client.request(TCODE_WRITE_BLOCK_REQUEST, 0x20010, 4, mode.data());
    return static_cast<std::int64_t>(b.client.event().size()); }},
  {"the 65th request on the way is answered with 0x10", 0x10, [](Bench& b) -> std::int64_t {
    for (int i = 0; i < 65; ++i) b.client.request(TCODE_READ_BLOCK_REQUEST, kControl, 1, nullptr,
                                                  static_cast<std::uint64_t>(i), 1);
    const auto event = b.client.event().as<fw_cdev_event_response>();
    return event.closure == 64 ? event.rcode : -1; }},
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
  // ---- time
  {"an unknown clock is EINVAL", -EINVAL, [](Bench& b) -> std::int64_t {
    fw_cdev_get_cycle_timer2 timer{};
    timer.clk_id = CLOCK_PROCESS_CPUTIME_ID;
    return b.client.call(FW_CDEV_IOC_GET_CYCLE_TIMER2, &timer); }},
  {"the cycle timer counts cycles and seconds", 125, [](Bench& b) -> std::int64_t {
    b.pass(5);
    fw_cdev_get_cycle_timer2 timer{};
    timer.clk_id = CLOCK_MONOTONIC;
    b.client.call(FW_CDEV_IOC_GET_CYCLE_TIMER2, &timer);
    return (timer.cycle_timer >> 12 & 0x1FFF) == 40 ? timer.cycle_timer >> 25 : 0; }},
  // ---- read and poll
  {"a buffer that is too small loses the rest of the event", 1, [](Bench& b) -> std::int64_t {
    b.client.write_byte(kControl, 0);
    return b.client.event(100, 8).size() == 8 && !b.client.ready(); }},
  {"read() without an event sleeps until a signal, O_NONBLOCK or not", EINTR,
   [](Bench& b) -> std::int64_t {
    struct sigaction action {};
    action.sa_handler = ignore_signal;  // without SA_RESTART
    sigaction(SIGALRM, &action, nullptr);
    fcntl(b.client.fd(), F_SETFL, O_NONBLOCK);
    const itimerval soon{{0, 0}, {0, 50'000}}, never{};
    setitimer(ITIMER_REAL, &soon, nullptr);
    std::array<char, 64> buffer{};
    const int error = read(b.client.fd(), buffer.data(), buffer.size()) < 0 ? errno : 0;
    setitimer(ITIMER_REAL, &never, nullptr);
    return error; }},
  {"the node is never ready for writing", 0, [](Bench& b) -> std::int64_t {
    pollfd watched{b.client.fd(), POLLOUT, 0};
    return poll(&watched, 1, 0); }},
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

TEST_CASE("the node answers as the kernel's firewire-cdev") {
  for (const Check& check : kChecks) {
    const std::string name = check.name;
    CAPTURE(name);
    Bench bench(check.settings());
    REQUIRE(bench.client.fd() >= 0);
    CHECK(check.run(bench) == check.expected);
  }
  MESSAGE(std::size(kChecks), " checks");
}

TEST_CASE("a device hears what comes on its channel with tag 0, once it streams") {
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
  REQUIRE(rx.start() == 0);
  const std::int64_t begin_ns = kerf::monotonic_ns();
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

TEST_CASE("nonsense from a client never ends the server") {
  Bench bench;
  std::uint64_t random = 88172645463325252U;
  const auto next = [&random] {
    random ^= random << 13;
    random ^= random >> 7;
    return random ^= random << 17;
  };
  PlainClient other(bench.mounted.path());
  for (int i = 0; i < 20'000; ++i) {
    std::array<std::uint32_t, 10> argument{};
    for (auto& word : argument)
      word = static_cast<std::uint32_t>(next() % 4 == 0 ? next() : next() % 9);
    std::array<std::uint32_t, 4> entries{};
    for (auto& word : entries) word = static_cast<std::uint32_t>(next());
    const auto pointer = reinterpret_cast<std::uintptr_t>(entries.data());
    const auto number = static_cast<unsigned>(next() % 0x19);
    if (number == 0x09 && next() % 2 == 0) {  // plausible enough to go deep
      std::memcpy(argument.data(), &pointer, sizeof pointer);
      argument[4] = static_cast<std::uint32_t>(next() % 17);
      argument[5] = 0;
    }
    if (number == 0x05) continue;  // a million resets tell nothing new
    const auto command = _IOC(_IOC_READ | _IOC_WRITE, '#', number, 40);
    static_cast<void>(ioctl(next() % 2 ? other.fd() : bench.client.fd(), command, argument.data()));
    while (other.ready() != 0) static_cast<void>(other.event(0, next() % 100 + 1));
  }
  const PlainClient fresh(bench.mounted.path());
  CHECK(fresh.info() == 1);
}
