// SPDX-License-Identifier: Apache-2.0
// Conformance of the node with the kernel's firewire-cdev, by plain system calls: calls
// of any file, requests, time.
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <ctime>

#include <doctest/doctest.h>
#include <sys/mman.h>
#include <sys/time.h>

#include "tests/hil/fuse/firewire_bench.hpp"

namespace kerf::firewire_node_test {

using kerf::test::Bench;
using kerf::test::Check;
using kerf::test::kControl;
using kerf::test::PlainClient;
using kerf::test::quadlet;
using kerf::test::rcode_of;

namespace {

void ignore_signal(int /*signal*/) {}

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
};
// clang-format on

}  // namespace

TEST_CASE("any call, requests and time are answered as by the kernel's firewire-cdev") {
  kerf::test::run(kChecks);
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
    if (number == 0x05) continue;  // a million resets show nothing new
    const auto command = _IOC(_IOC_READ | _IOC_WRITE, '#', number, 40);
    static_cast<void>(ioctl(next() % 2 ? other.fd() : bench.client.fd(), command, argument.data()));
    while (other.ready() != 0) static_cast<void>(other.event(0, next() % 100 + 1));
  }
  const PlainClient fresh(bench.mounted.path());
  CHECK(fresh.info() == 1);
}

}  // namespace kerf::firewire_node_test
