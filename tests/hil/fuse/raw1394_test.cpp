// SPDX-License-Identifier: Apache-2.0
// A foreign program on the emulated bus: it knows the card by its own node, and takes channels and
// bandwidth from the resource manager there.
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <doctest/doctest.h>
#include <fcntl.h>
#include <linux/firewire-cdev.h>
#include <sys/mman.h>
#include <unistd.h>

#include "controller/device/device_driver.hpp"
#include "controller/device/firewire/firewire_port.hpp"
#include "hil/front/firewire/firewire_node.hpp"
#include "tests/hil/clients/raw1394_client.hpp"
#include "tests/hil/fuse/mounted_node.hpp"
#include "tests/hil/fuse/plain_client.hpp"

namespace kerf::raw1394_test {

using kerf::test::PlainClient;
using kerf::test::Raw1394Client;

namespace {

constexpr std::uint32_t kOmni = 0xFFC0, kHost = 0xFFC1;
constexpr std::uint64_t kBandwidth = Raw1394Client::kBandwidth;
constexpr std::uint64_t kLow = Raw1394Client::kChannelsLow, kHigh = Raw1394Client::kChannelsHigh;

/// A bus with both of its nodes, in real time: epoll does not take a bus in lock-step to the
/// answer, as poll() does.
class MountedBus {
 public:
  explicit MountedBus(std::vector<kerf::ScriptedFault> script = {})
      : omni_({.clock = kerf::BusClock::real_time(), .script = std::move(script)}, arm_) {
    mount_.add("fw0", omni_, kerf::FirewireNode::kHostFile);
    mount_.add("fw1", omni_);
    thread_ = std::thread([this] { mount_.serve([this] { return !stop_; }); });
  }
  ~MountedBus() {
    stop_ = true;
    thread_.join();
  }
  MountedBus(const MountedBus&) = delete;
  MountedBus& operator=(const MountedBus&) = delete;
  [[nodiscard]] std::string folder() const { return folder_.path(); }
  [[nodiscard]] std::string host() const { return folder() + "/fw0"; }
  [[nodiscard]] std::string omni() const { return folder() + "/fw1"; }

 private:
  kerf::test::TemporaryFolder folder_;
  kerf::Emulator arm_{kerf::OmniParams{}, {}};
  kerf::FirewireNode omni_;
  kerf::FuseMount mount_{folder_.path()};
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace

TEST_CASE(
    "raw1394: the card is the node with the local id; without it there is none to begin with") {
  const MountedBus bus;
  const Raw1394Client client(bus.folder());
  CHECK(client.local_path() == bus.host());
  CHECK(client.local_id() == kHost);
  CHECK(client.manager_id() == kHost);
  CHECK(client.node_count() == 2);
  CHECK(client.nodes() == std::vector<std::uint32_t>{kOmni, kHost});
  const kerf::test::MountedNode alone;
  CHECK_THROWS_AS(const Raw1394Client none(alone.folder()), std::runtime_error);
}

TEST_CASE("raw1394: the card answers for its ROM, its time and the resource manager") {
  const MountedBus bus;
  Raw1394Client client(bus.folder());
  const auto host = [&](std::uint64_t offset) {
    return client.read(kHost, Raw1394Client::kCsr + offset).quadlet();
  };
  CHECK(host(0x404) == 0x3133'3934);
  CHECK((host(0x408) & 0xF000'0000) == 0xF000'0000);
  CHECK(client.read(kOmni, Raw1394Client::kCsr + 0x40C).quadlet() == 0x000B'9900);
  CHECK(host(0x40C) == 0x001F'1100);
  CHECK(host(0x008) == kHost << 16);
  const std::uint32_t time = host(0x200);
  CHECK(host(0x200) != time);
  CHECK(host(0x234) == 0x8000'001F);
  CHECK(client.read(kHost, Raw1394Client::kBusManager).quadlet() == 1);
  CHECK(client.read(kHost, kBandwidth).quadlet() == 4915);
  CHECK(client.read(kHost, kLow).quadlet() == 0xFFFF'FFFF);
  CHECK(client.read(kHost, kHigh).quadlet() == 0xFFFF'FFFF);

  // Registers that it does not have, and accesses that are not allowed.
  CHECK(client.read(kHost, Raw1394Client::kCsr + 0x22C).rcode == RCODE_ADDRESS_ERROR);
  CHECK(client.read(kHost, kBandwidth + 1).rcode == RCODE_ADDRESS_ERROR);
  CHECK(client.read(kHost, 0x1087).rcode == RCODE_ADDRESS_ERROR);  // the Omni's
  CHECK(client.read(kHost, kBandwidth, 8).rcode == RCODE_TYPE_ERROR);
  CHECK(client.write(kHost, kBandwidth, 0).rcode == RCODE_TYPE_ERROR);
  CHECK(client.swap(kOmni, kBandwidth, 4915, 0).rcode == RCODE_TYPE_ERROR);
  CHECK(client.read(kHost, kBandwidth).quadlet() == 4915);
}

TEST_CASE(
    "raw1394: channels and bandwidth go to the first swap, the kernel's too; a reset frees all") {
  const MountedBus bus;
  Raw1394Client one(bus.folder()), other(bus.folder()), late(bus.folder());
  CHECK(one.take_channel(0));
  CHECK_FALSE(other.take_channel(0));
  CHECK(other.take_channel(63));
  CHECK(one.read(kHost, kLow).quadlet() == 0x7FFF'FFFF);
  CHECK(one.read(kHost, kHigh).quadlet() == 0xFFFF'FFFE);
  CHECK_FALSE(one.free_channel(5));  // it is free
  CHECK(one.take_bandwidth(4000));
  CHECK_FALSE(other.take_bandwidth(916));
  CHECK(other.take_bandwidth(915));
  const auto stale = other.swap(kHost, kBandwidth, 4915, 7);
  CHECK(stale.rcode == RCODE_COMPLETE);
  CHECK(stale.quadlet() == 0);  // its value
  CHECK(one.read(kHost, kBandwidth).quadlet() == 0);
  CHECK(one.swap(kHost, Raw1394Client::kBusManager, 0x3F, 0).quadlet() == 1);  // there is one
  CHECK(one.free_bandwidth(4915));
  CHECK(one.free_channel(63));

  const PlainClient omni(bus.omni());
  CHECK(omni.allocate(0b11, 100) == 0);
  CHECK(omni.event().as<fw_cdev_event_iso_resource>().channel == 1);  // 0 was swapped away
  CHECK_FALSE(one.take_channel(1));
  CHECK(one.read(kHost, kBandwidth).quadlet() == 4815);
  CHECK(omni.call(FW_CDEV_IOC_DEALLOCATE_ISO_RESOURCE, std::array{fw_cdev_deallocate{0}}.data()) ==
        0);

  CHECK(one.reset_bus());
  CHECK(one.generation() == 2);
  CHECK(one.read(kHost, kLow).quadlet() == 0xFFFF'FFFF);
  CHECK(one.read(kHost, kBandwidth).quadlet() == 4915);
  CHECK(late.read(kHost, kBandwidth).rcode == RCODE_GENERATION);  // it has not read its events yet
}

TEST_CASE("raw1394: the card stays when the Omni is unplugged") {
  const MountedBus bus({{8 * 300, kerf::BusFault::vanish}});
  Raw1394Client client(bus.folder());
  for (int i = 0; i < 500 && access(bus.omni().c_str(), F_OK) == 0; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));  // it is given up after 2 s
  }
  CHECK(open(bus.omni().c_str(), O_RDWR) == -1);
  CHECK(errno == ENOENT);
  const Raw1394Client after(bus.folder());
  CHECK(after.nodes() == std::vector<std::uint32_t>{kHost});
  CHECK(client.read(kOmni, 0x1087).rcode == -1);  // ENODEV
  CHECK(client.read(kHost, kBandwidth).rcode == RCODE_GENERATION);
  CHECK(client.read(kHost, kBandwidth).quadlet() == 4915);  // it has read its events
}

TEST_CASE("raw1394: our own driver finds the Omni beside the card, and both share the bus") {
  const MountedBus bus;
  Raw1394Client client(bus.folder());
  kerf::FirewireOptions options;
  options.where = bus.folder();
  kerf::FirewirePort port(options, 0, kerf::test::kGoOn);
  kerf::OmniDriver driver(port);
  bool fresh = false;
  for (int i = 0; i < 1000 && !fresh; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    fresh = driver.read().fresh;
    driver.command({});
  }
  CHECK(fresh);
  CHECK(client.read(kHost, kLow).quadlet() == 0x3FFF'FFFF);
  CHECK(client.read(kHost, kBandwidth).quadlet() < 4915);

  // FUSE has no isochronous packets in mapped memory.
  const PlainClient card(bus.host());
  CHECK(card.create(FW_CDEV_ISO_CONTEXT_RECEIVE, 3, 8) == 0);
  CHECK(mmap(nullptr, 4096, PROT_READ, MAP_SHARED, card.fd(), 0) == MAP_FAILED);
  CHECK(errno == ENODEV);
}

}  // namespace kerf::raw1394_test
