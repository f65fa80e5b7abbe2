// SPDX-License-Identifier: Apache-2.0
// A foreign host of the Falcon above the emulated node: it asks in another order than our own
// driver does, and leaves reads under way.
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include <doctest/doctest.h>
#include <fcntl.h>
#include <linux/usbdevice_fs.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "tests/hil/clients/nifalcon_client.hpp"
#include "tests/hil/fuse/bus_session.hpp"

using kerf::test::MountedFalcon;
using kerf::test::NifalconClient;

namespace {

/// An open of the node, which libusb does not close.
class Node {
 public:
  explicit Node(const std::string& path) : fd_(open(path.c_str(), O_RDWR | O_CLOEXEC)) {}
  ~Node() { close(fd_); }
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;
  [[nodiscard]] int fd() const noexcept { return fd_; }

 private:
  int fd_;
};

std::vector<std::uint8_t> firmware_of(std::size_t bytes) {
  std::vector<std::uint8_t> firmware(bytes);
  for (std::size_t i = 0; i < bytes; ++i) firmware[i] = static_cast<std::uint8_t>(i * 7 + i / 256);
  return firmware;
}

}  // namespace

TEST_CASE("nifalcon: firmware is asked for, loaded once above a read that waits, and answers") {
  // Whole chunks, one with a rest, and one byte.
  for (const std::size_t bytes : {std::size_t{620}, std::size_t{1000}, std::size_t{1}}) {
    CAPTURE(bytes);
    MountedFalcon falcon({.firmware_runs = false}, {}, std::nullopt);
    {
      const Node node(falcon.path());
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
  const Node node(falcon.path());
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
    const Node node(falcon.path());
    NifalconClient client(node.fd());
    CHECK(client.firmware_answers());
    CHECK(client.reads());
  }
}

TEST_CASE("nifalcon: who gives the interface up has no reads left that another host would miss") {
  const MountedFalcon falcon({.firmware_runs = true}, {}, std::nullopt);
  const Node leaving(falcon.path()), coming(falcon.path());
  unsigned interface = 0;
  std::vector<std::uint8_t> buffer(64);
  usbdevfs_urb read;
  std::memset(&read, 0, sizeof read);  // it ends in an array without a size
  read.type = USBDEVFS_URB_TYPE_BULK;
  read.endpoint = kerf::falcon::kEndpointIn;
  read.buffer = buffer.data();
  read.buffer_length = static_cast<int>(buffer.size());
  usbdevfs_ctrltransfer slow{};
  slow.bRequestType = kerf::falcon::kFtdiRequestType;
  slow.bRequest = static_cast<std::uint8_t>(kerf::falcon::FtdiRequest::latency);
  slow.wValue = 255;  // ms: nothing comes by itself
  REQUIRE(ioctl(leaving.fd(), USBDEVFS_CONTROL, &slow) == 0);
  REQUIRE(ioctl(leaving.fd(), USBDEVFS_CLAIMINTERFACE, &interface) == 0);
  REQUIRE(ioctl(leaving.fd(), USBDEVFS_SUBMITURB, &read) == 0);
  REQUIRE(ioctl(leaving.fd(), USBDEVFS_RELEASEINTERFACE, &interface) == 0);
  void* ended = nullptr;
  CHECK(ioctl(leaving.fd(), USBDEVFS_REAPURBNDELAY, &ended) == 0);
  CHECK(ended == &read);
  CHECK(read.status == -ENOENT);
  NifalconClient client(coming.fd());
  CHECK(client.firmware_answers());
}
