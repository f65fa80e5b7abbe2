// SPDX-License-Identifier: Apache-2.0
// The two nodes against the kernel's usbfs and hidraw, by system calls alone, and as libnifalcon
// uses them.
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <vector>

#include <doctest/doctest.h>
#include <fcntl.h>
#include <linux/hidraw.h>
#include <linux/usbdevice_fs.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "shared/wire/falcon.hpp"
#include "shared/wire/woodenhaptics.hpp"
#include "tests/hil/clients/nifalcon_client.hpp"
#include "tests/hil/fuse/mounted_node.hpp"

namespace kerf::usb_node_test {

using kerf::test::MountedArm;
using kerf::test::MountedFalcon;
using kerf::test::NifalconClient;

namespace {

constexpr auto kLatency = static_cast<std::uint8_t>(kerf::falcon::FtdiRequest::latency);

/// One open of a node.
class Client {
 public:
  explicit Client(const std::string& path) : fd_(open(path.c_str(), O_RDWR)) {}
  ~Client() { close(fd_); }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  /// What ioctl() returns, or a negative errno.
  template <class T>
  int call(unsigned long command, T argument) const {
    const int result = ioctl(fd_, command, argument);
    return result < 0 ? -errno : result;
  }
  /// A request to the Falcon's chip.
  [[nodiscard]] int control(std::uint8_t request, std::uint16_t value) const {
    usbdevfs_ctrltransfer transfer{};
    transfer.bRequestType = kerf::falcon::kFtdiRequestType;
    transfer.bRequest = request;
    transfer.wValue = value;
    return call(USBDEVFS_CONTROL, &transfer);
  }
  [[nodiscard]] int ready(short events, int milliseconds) const {
    pollfd watched{fd_, events, 0};
    return poll(&watched, 1, milliseconds) > 0 ? watched.revents : 0;
  }
  /// The address of the oldest transfer that is done, within the time.
  [[nodiscard]] usbdevfs_urb* reap(int milliseconds = 500) const {
    if ((ready(POLLOUT, milliseconds) & POLLOUT) == 0) return nullptr;
    void* urb = nullptr;
    return call(USBDEVFS_REAPURBNDELAY, &urb) == 0 ? static_cast<usbdevfs_urb*>(urb) : nullptr;
  }
  [[nodiscard]] int fd() const noexcept { return fd_; }

 private:
  int fd_;
};

void fill(usbdevfs_urb& urb, std::uint8_t endpoint, std::span<std::uint8_t> buffer) {
  std::memset(&urb, 0, sizeof urb);
  urb.type = USBDEVFS_URB_TYPE_BULK;
  urb.endpoint = endpoint;
  urb.buffer = buffer.data();
  urb.buffer_length = static_cast<int>(buffer.size());
}

}  // namespace

TEST_CASE("usbfs: descriptors are read from an offset, and have the ids of the device") {
  const MountedFalcon falcon;
  const Client client(falcon.path());
  std::array<std::uint8_t, 100> bytes{};
  CHECK(read(client.fd(), bytes.data(), 18) == 18);
  CHECK((bytes[8] | bytes[9] << 8) == kerf::falcon::kVendorId);
  CHECK((bytes[10] | bytes[11] << 8) == kerf::falcon::kProductId);
  CHECK(read(client.fd(), bytes.data(), bytes.size()) == 32);  // the configuration
  CHECK(bytes[1] == 2);
  CHECK(read(client.fd(), bytes.data(), bytes.size()) == 0);
  CHECK(lseek(client.fd(), 0, SEEK_SET) == 0);
  CHECK(read(client.fd(), bytes.data(), bytes.size()) == 50);
  CHECK(write(client.fd(), bytes.data(), 1) == -1);
}

TEST_CASE("usbfs: an interface has one owner, and unknown ones are refused") {
  const MountedFalcon falcon;
  const Client first(falcon.path()), second(falcon.path());
  unsigned interface = 0, none = 1;
  CHECK(first.call(USBDEVFS_CLAIMINTERFACE, &none) == -ENOENT);
  CHECK(first.call(USBDEVFS_RELEASEINTERFACE, &interface) == -EINVAL);
  CHECK(first.call(USBDEVFS_CLAIMINTERFACE, &interface) == 0);
  CHECK(first.call(USBDEVFS_CLAIMINTERFACE, &interface) == 0);
  CHECK(second.call(USBDEVFS_CLAIMINTERFACE, &interface) == -EBUSY);
  CHECK(first.call(USBDEVFS_RELEASEINTERFACE, &interface) == 0);
  CHECK(second.call(USBDEVFS_CLAIMINTERFACE, &interface) == 0);
  CHECK(first.call(USBDEVFS_GET_SPEED, 0) == 2);
  CHECK(first.call(USBDEVFS_GETDRIVER, &interface) == -ENODATA);
  unsigned endpoint = 0x85;
  CHECK(first.call(USBDEVFS_CLEAR_HALT, &endpoint) == -ENOENT);
  CHECK(first.call(USBDEVFS_FORBID_SUSPEND, 0) == -ENOTTY);
  CHECK(first.call(USBDEVFS_CLAIMINTERFACE, static_cast<unsigned*>(nullptr)) == -EFAULT);
}

TEST_CASE("usbfs: a read waits for the device, a discarded one comes back, none is invented") {
  const MountedFalcon falcon({.firmware_runs = true}, {}, std::nullopt);
  const Client client(falcon.path());
  std::array<std::uint8_t, 64> in{};
  usbdevfs_urb read_urb;
  fill(read_urb, kerf::falcon::kEndpointIn, in);
  void* none = nullptr;
  CHECK(client.call(USBDEVFS_REAPURBNDELAY, &none) == -EAGAIN);
  CHECK(client.call(USBDEVFS_DISCARDURB, &read_urb) == -EINVAL);

  // Status alone comes when the latency timer of 16 ms has run out, and again 16 ms later.
  const std::int64_t begin_ns = kerf::monotonic_ns();
  CHECK(client.call(USBDEVFS_SUBMITURB, &read_urb) == 0);
  CHECK(client.reap() == &read_urb);
  CHECK(read_urb.status == 0);
  CHECK(read_urb.actual_length == 2);
  CHECK(client.call(USBDEVFS_SUBMITURB, &read_urb) == 0);
  CHECK(client.reap() == &read_urb);
  CHECK(kerf::monotonic_ns() - begin_ns > 10'000'000);

  CHECK(client.control(kLatency, 255) == 0);  // ms: nothing comes meanwhile
  CHECK(client.call(USBDEVFS_SUBMITURB, &read_urb) == 0);
  CHECK(client.call(USBDEVFS_DISCARDURB, &read_urb) == 0);
  CHECK(client.reap() == &read_urb);
  CHECK(read_urb.status == -ENOENT);

  usbdevfs_urb bad;
  fill(bad, 0x83, in);
  CHECK(client.call(USBDEVFS_SUBMITURB, &bad) == -ENOENT);
  fill(bad, kerf::falcon::kEndpointIn, in);
  bad.type = USBDEVFS_URB_TYPE_ISO;
  CHECK(client.call(USBDEVFS_SUBMITURB, &bad) == -EINVAL);
  CHECK(client.call(USBDEVFS_SUBMITURB, static_cast<usbdevfs_urb*>(nullptr)) == -EFAULT);
}

TEST_CASE("usbfs: one exchange per frame, two bytes of status before the answer") {
  const MountedFalcon falcon({.firmware_runs = true}, {}, std::nullopt);
  const Client client(falcon.path());
  CHECK(client.control(kLatency, 1) == 0);
  CHECK(client.control(77, 1) == -EPIPE);
  std::array<std::uint8_t, 64> in{};
  auto command = encode(kerf::FalconCommand{});
  int answers = 0;
  const std::int64_t begin_ns = kerf::monotonic_ns();
  for (int i = 0; i < 100; ++i) {
    usbdevfs_urb write_urb, read_urb;
    fill(write_urb, kerf::falcon::kEndpointOut, command);
    fill(read_urb, kerf::falcon::kEndpointIn, in);
    REQUIRE(client.call(USBDEVFS_SUBMITURB, &write_urb) == 0);
    REQUIRE(client.call(USBDEVFS_SUBMITURB, &read_urb) == 0);
    REQUIRE(client.reap() == &write_urb);  // at once
    CHECK(write_urb.actual_length == 16);
    REQUIRE(client.reap() == &read_urb);
    if (read_urb.actual_length != 2 + 16) continue;
    ++answers;
    CHECK(kerf::falcon::decode_report(std::span(in).subspan(2, 16)));
  }
  CHECK(answers >= 99);
  CHECK(kerf::monotonic_ns() - begin_ns >= 98'000'000);
}

TEST_CASE("usbfs: after unplugging, pending transfers come back, then everything is ENODEV") {
  std::atomic<bool> waits{false};
  const MountedFalcon falcon({.firmware_runs = true},
                             {{100, UsbFault::stall}, {0, UsbFault::vanish, &waits}}, std::nullopt);
  const Client client(falcon.path());
  std::array<std::uint8_t, 64> in{};
  usbdevfs_urb read_urb;
  int status = 0;
  while (status == 0) {
    fill(read_urb, kerf::falcon::kEndpointIn, in);
    REQUIRE(client.call(USBDEVFS_SUBMITURB, &read_urb) == 0);
    REQUIRE(client.reap() == &read_urb);
    status = read_urb.status;
  }
  CHECK(status == -EPIPE);
  CHECK(client.call(USBDEVFS_SUBMITURB, &read_urb) == 0);  // halted: waits
  waits = true;
  CHECK(client.reap() == &read_urb);
  CHECK(read_urb.status == -ESHUTDOWN);
  CHECK((client.ready(POLLOUT, 0) & (POLLERR | POLLHUP)) == (POLLERR | POLLHUP));
  void* none = nullptr;
  CHECK(client.call(USBDEVFS_REAPURBNDELAY, &none) == -ENODEV);
  CHECK(client.call(USBDEVFS_SUBMITURB, &read_urb) == -ENODEV);
  CHECK(open(falcon.path().c_str(), O_RDWR) == -1);
}

TEST_CASE("hidraw: its ids, its descriptor, one report per read, from the first write on") {
  for (const std::size_t bytes : {std::size_t{14}, std::size_t{64}}) {
    const MountedArm arm({.packet_bytes = bytes, .serial = "S1"}, std::nullopt);
    const Client client(arm.path());
    hidraw_devinfo info{};
    CHECK(client.call(HIDIOCGRAWINFO, &info) == 0);
    CHECK(info.vendor == (bytes == 14 ? 0x1234 : 0x16C0));
    CHECK(info.product == (bytes == 14 ? 0x0006 : 0x0486));
    int size = 0;
    CHECK(client.call(HIDIOCGRDESCSIZE, &size) == 0);
    hidraw_report_descriptor descriptor{};
    descriptor.size = static_cast<unsigned>(size);
    CHECK(client.call(HIDIOCGRDESC, &descriptor) == 0);
    CHECK(descriptor.value[0] == 0x06);
    CHECK(descriptor.value[size - 1] == 0xC0);
    std::array<char, 32> serial{};
    CHECK(client.call(HIDIOCGRAWUNIQ(32), serial.data()) == 3);
    CHECK(std::string(serial.data()) == "S1");
    CHECK(client.call(HIDIOCSFEATURE(8), serial.data()) == -EPIPE);
    CHECK(client.call(0x4801, &size) == -ENOTTY);

    CHECK((client.ready(POLLIN, 20) & POLLIN) == 0);  // it waits for its host
    std::array<std::uint8_t, 65> report{};
    CHECK(write(client.fd(), report.data(), 1) == -1);
    CHECK(write(client.fd(), report.data(), 1 + bytes) == static_cast<ssize_t>(1 + bytes));
    for (int i = 0; i < 20; ++i) {
      CHECK((client.ready(POLLIN, 500) & POLLIN) != 0);
      CHECK(read(client.fd(), report.data(), report.size()) == static_cast<ssize_t>(bytes));
      CHECK(kerf::wooden::decode_report(std::span(report).first(bytes)));
    }
  }
}

TEST_CASE("hidraw: unplugged, it gives the waiting reports and then EIO; a write fails") {
  std::atomic<bool> streams{false};
  const MountedArm arm({.script = {{0, UsbFault::vanish, &streams}}}, std::nullopt);
  const Client client(arm.path());
  std::array<std::uint8_t, 15> report{};
  CHECK(write(client.fd(), report.data(), report.size()) == 15);
  while ((client.ready(POLLIN, 500) & POLLERR) == 0) {
    if (read(client.fd(), report.data(), report.size()) <= 0) break;
    streams = true;
  }
  while (read(client.fd(), report.data(), report.size()) > 0) {
  }
  CHECK(errno == EIO);
  CHECK((client.ready(POLLIN, 0) & (POLLERR | POLLHUP)) == (POLLERR | POLLHUP));
  CHECK(write(client.fd(), report.data(), report.size()) == -1);
  CHECK(errno == ENODEV);
  CHECK(open(arm.path().c_str(), O_RDWR) == -1);
}

// ---- a foreign host of the Falcon: requests in another order than our own driver, open reads ----

namespace {

std::vector<std::uint8_t> firmware_of(std::size_t bytes) {
  std::vector<std::uint8_t> firmware(bytes);
  for (std::size_t i = 0; i < bytes; ++i) firmware[i] = static_cast<std::uint8_t>(i * 7 + i / 256);
  return firmware;
}

}  // namespace

TEST_CASE("nifalcon: firmware is checked for, loaded once above a read that waits, and answers") {
  // Whole chunks, one with a rest, and one byte.
  for (const std::size_t bytes : {std::size_t{620}, std::size_t{1000}, std::size_t{1}}) {
    CAPTURE(bytes);
    MountedFalcon falcon({.firmware_runs = false}, {}, std::nullopt);
    {
      const Client node(falcon.path());
      NifalconClient client(node.fd());
      CHECK_FALSE(client.firmware_answers());
      CHECK(client.reads());
      CHECK(client.load(firmware_of(bytes)) == "");
      CHECK(client.firmware_answers());
      CHECK(client.firmware_answers());  // again, with the read of the first time under way
      for (int i = 0; i < 50; ++i) {
        const auto report = client.exchange({.homing = true, .blue = true});
        REQUIRE(report);
        CHECK(report->buttons == 0);
      }
      CHECK(client.reads());
    }
    falcon.stop();
    CHECK(falcon.node().chip().firmware_bytes() == static_cast<std::int64_t>(bytes));
    CHECK(falcon.node().chip().lost() == 0);
    CHECK(falcon.node().rash_clears() == 0);
    CHECK(falcon.emulator().stats().refused == 0);
  }
}

TEST_CASE("nifalcon: a host that loads without asking starts a running Falcon anew") {
  const MountedFalcon falcon({.firmware_runs = true}, {}, std::nullopt);
  const Client node(falcon.path());
  NifalconClient client(node.fd());
  CHECK(client.firmware_answers());
  CHECK(client.load(firmware_of(200)) == "");
  CHECK(client.load(firmware_of(100)) == "");
  CHECK(client.firmware_answers());
}

TEST_CASE(
    "nifalcon: closed with a read under way, the next host is in step from its first question") {
  const MountedFalcon falcon({.firmware_runs = true}, {}, std::nullopt);
  for (int host = 0; host < 5; ++host) {
    CAPTURE(host);
    const Client node(falcon.path());
    NifalconClient client(node.fd());
    CHECK(client.firmware_answers());
    CHECK(client.reads());
  }
}

TEST_CASE(
    "nifalcon: a host that gives the interface up leaves no reads that take packets of another") {
  const MountedFalcon falcon({.firmware_runs = true}, {}, std::nullopt);
  const Client leaving(falcon.path()), coming(falcon.path());
  unsigned interface = 0;
  std::array<std::uint8_t, 64> buffer{};
  usbdevfs_urb read;
  fill(read, kerf::falcon::kEndpointIn, buffer);
  REQUIRE(leaving.control(kLatency, 255) == 0);  // ms: nothing comes by itself
  REQUIRE(leaving.call(USBDEVFS_CLAIMINTERFACE, &interface) == 0);
  REQUIRE(leaving.call(USBDEVFS_SUBMITURB, &read) == 0);
  REQUIRE(leaving.call(USBDEVFS_RELEASEINTERFACE, &interface) == 0);
  CHECK(leaving.reap() == &read);
  CHECK(read.status == -ENOENT);
  NifalconClient client(coming.fd());
  CHECK(client.firmware_answers());
}

}  // namespace kerf::usb_node_test
