// SPDX-License-Identifier: Apache-2.0
// A foreign program on the emulated bus: it knows the card by its own node, and asks the resource
// manager there for channels and bandwidth.
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

using kerf::test::PlainClient;
using kerf::test::Raw1394Client;

namespace {

constexpr std::uint32_t kOmni = 0xFFC0, kHost = 0xFFC1;

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

using kerf::test::kGoOn;

}  // namespace

TEST_CASE("raw1394: the card is the node with the local id, the Omni the other one") {
  const MountedBus bus;
  const Raw1394Client client(bus.folder());
  CHECK(client.local_path() == bus.host());
  CHECK(client.local_id() == kHost);
  CHECK(client.manager_id() == kHost);
  CHECK(client.node_count() == 2);
  CHECK(client.nodes() == std::vector<std::uint32_t>{kOmni, kHost});
}

TEST_CASE("raw1394: where only the device has a node there is no card to begin with") {
  const kerf::test::MountedNode alone;
  CHECK_THROWS_AS(const Raw1394Client client(alone.folder()), std::runtime_error);
}

TEST_CASE("raw1394: the card answers for its ROM, its time and the resource manager") {
  const MountedBus bus;
  Raw1394Client client(bus.folder());
  CHECK(client.read(kHost, Raw1394Client::kCsr + 0x404).quadlet() == 0x3133'3934);
  CHECK((client.read(kHost, Raw1394Client::kCsr + 0x408).quadlet() & 0xF000'0000) == 0xF000'0000);
  CHECK(client.read(kOmni, Raw1394Client::kCsr + 0x40C).quadlet() == 0x000B'9900);
  CHECK(client.read(kHost, Raw1394Client::kCsr + 0x40C).quadlet() == 0x001F'1100);
  CHECK(client.read(kHost, Raw1394Client::kCsr + 0x008).quadlet() == kHost << 16);
  const std::uint32_t time = client.read(kHost, Raw1394Client::kCsr + 0x200).quadlet();
  CHECK(client.read(kHost, Raw1394Client::kCsr + 0x200).quadlet() != time);
  CHECK(client.read(kHost, Raw1394Client::kCsr + 0x234).quadlet() == 0x8000'001F);
  CHECK(client.read(kHost, Raw1394Client::kBusManager).quadlet() == 1);
  CHECK(client.read(kHost, Raw1394Client::kBandwidth).quadlet() == 4915);
  CHECK(client.read(kHost, Raw1394Client::kChannelsLow).quadlet() == 0xFFFF'FFFF);
  CHECK(client.read(kHost, Raw1394Client::kChannelsHigh).quadlet() == 0xFFFF'FFFF);

  // What it has not, and what may not be done to what it has.
  CHECK(client.read(kHost, Raw1394Client::kCsr + 0x22C).rcode == RCODE_ADDRESS_ERROR);
  CHECK(client.read(kHost, Raw1394Client::kBandwidth + 1).rcode == RCODE_ADDRESS_ERROR);
  CHECK(client.read(kHost, 0x1087).rcode == RCODE_ADDRESS_ERROR);  // the Omni's
  CHECK(client.read(kHost, Raw1394Client::kBandwidth, 8).rcode == RCODE_TYPE_ERROR);
  CHECK(client.write(kHost, Raw1394Client::kBandwidth, 0).rcode == RCODE_TYPE_ERROR);
  CHECK(client.swap(kOmni, Raw1394Client::kBandwidth, 4915, 0).rcode == RCODE_TYPE_ERROR);
  CHECK(client.read(kHost, Raw1394Client::kBandwidth).quadlet() == 4915);
}

TEST_CASE("raw1394: channels and bandwidth go to who swaps first; a stale swap changes nothing") {
  const MountedBus bus;
  Raw1394Client one(bus.folder()), other(bus.folder());
  CHECK(one.take_channel(0));
  CHECK_FALSE(other.take_channel(0));
  CHECK(one.read(kHost, Raw1394Client::kChannelsLow).quadlet() == 0x7FFF'FFFF);
  CHECK(other.take_channel(63));
  CHECK(one.read(kHost, Raw1394Client::kChannelsHigh).quadlet() == 0xFFFF'FFFE);
  CHECK_FALSE(one.free_channel(5));  // nobody has it
  CHECK(one.take_bandwidth(4000));
  CHECK_FALSE(other.take_bandwidth(916));
  CHECK(other.take_bandwidth(915));
  CHECK(one.read(kHost, Raw1394Client::kBandwidth).quadlet() == 0);

  const auto stale = other.swap(kHost, Raw1394Client::kBandwidth, 4915, 7);
  CHECK(stale.rcode == RCODE_COMPLETE);
  CHECK(stale.quadlet() == 0);  // what it holds
  CHECK(one.read(kHost, Raw1394Client::kBandwidth).quadlet() == 0);
  const auto manager = one.swap(kHost, Raw1394Client::kBusManager, 0x3F, 0);
  CHECK(manager.quadlet() == 1);  // there is one already

  CHECK(one.free_bandwidth(4915));
  CHECK(one.read(kHost, Raw1394Client::kBandwidth).quadlet() == 4915);
  CHECK(one.free_channel(0));
  CHECK(one.free_channel(63));
  CHECK(one.read(kHost, Raw1394Client::kChannelsLow).quadlet() == 0xFFFF'FFFF);
}

TEST_CASE("raw1394: what the kernel gave away is not there for a swap, and the reverse") {
  const MountedBus bus;
  Raw1394Client client(bus.folder());
  CHECK(client.take_channel(0));
  const PlainClient omni(bus.omni());
  CHECK(omni.allocate(0b11, 100) == 0);
  const auto given = omni.event().as<fw_cdev_event_iso_resource>();
  CHECK(given.channel == 1);  // 0 was swapped away
  CHECK_FALSE(client.take_channel(1));
  CHECK(client.read(kHost, Raw1394Client::kBandwidth).quadlet() == 4815);
}

TEST_CASE("raw1394: a reset gives all back, is told by the local node, and ages requests") {
  const MountedBus bus;
  Raw1394Client client(bus.folder()), late(bus.folder());
  CHECK(client.take_channel(7));
  CHECK(client.take_bandwidth(1000));
  CHECK(client.reset_bus());
  CHECK(client.generation() == 2);
  CHECK(client.read(kHost, Raw1394Client::kChannelsLow).quadlet() == 0xFFFF'FFFF);
  CHECK(client.read(kHost, Raw1394Client::kBandwidth).quadlet() == 4915);
  // Another one, that has not read its events yet.
  CHECK(late.read(kHost, Raw1394Client::kBandwidth).rcode == RCODE_GENERATION);
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
  CHECK(client.read(kHost, Raw1394Client::kBandwidth).rcode == RCODE_GENERATION);
  CHECK(client.read(kHost, Raw1394Client::kBandwidth).quadlet() == 4915);  // it has heard
}

TEST_CASE("raw1394: isochronous packets into mapped memory are what FUSE cannot give") {
  const MountedBus bus;
  const PlainClient card(bus.host());
  CHECK(card.create(FW_CDEV_ISO_CONTEXT_RECEIVE, 3, 8) == 0);
  void* const at = mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_SHARED, card.fd(), 0);
  CHECK(at == MAP_FAILED);
  CHECK(errno == ENODEV);
}

TEST_CASE("raw1394: our own driver finds the Omni beside the card, and both share the bus") {
  const MountedBus bus;
  Raw1394Client client(bus.folder());
  kerf::FirewireOptions options;
  options.where = bus.folder();
  kerf::FirewirePort port(options, 0, kGoOn);
  kerf::OmniDriver driver(port);
  bool fresh = false;
  for (int i = 0; i < 1000 && !fresh; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    fresh = driver.read().fresh;
    driver.command({});
  }
  CHECK(fresh);
  CHECK(client.read(kHost, Raw1394Client::kChannelsLow).quadlet() == 0x3FFF'FFFF);
  CHECK(client.read(kHost, Raw1394Client::kBandwidth).quadlet() < 4915);
}
