// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>

#include "hil/front/firewire/firewire_node.hpp"
#include "hil/front/serving.hpp"
#include "hil/front/socket_servers.hpp"
#include "hil/front/usb/hidraw_node.hpp"
#include "hil/front/usb/usbfs_node.hpp"
#include "tests/hil/fuse/served_node.hpp"
#include "tests/programs/watched_device.hpp"

namespace kerf::test {

/// A device behind a front in this process, so that what reaches it can be looked at. Ends with its
/// owner.
class ServedFront {
 public:
  virtual ~ServedFront() = default;
  /// What `--port` says of it.
  [[nodiscard]] virtual std::string port() const = 0;
};

/// Before the servo, where there is the right to it: what arrives is noted when it arrives.
inline void hurry() {
  static_cast<void>(make_real_time(82, -1));
}

/// One client after the other at `Server`, every 250 us.
template <class Server>
class ServedSocket final : public ServedFront {
 public:
  ServedSocket(const std::string& place, Personality personality, PacketDevice& device)
      : server_(place), thread_([this, personality, &device] {
          hurry();
          while (auto client = server_.accept(stop_)) {
            HandshakeLink link(*client, {personality, false, 4000});
            serve_real_time(link, device, 2, {0, stop_}, stats_);
          }
        }) {
    if constexpr (std::is_same_v<Server, UdpServer>) {
      port_ = "udp:" + std::to_string(server_.port());
    } else {
      port_ = "socket:" + place;
    }
  }
  ~ServedSocket() override {
    stop_ = true;
    thread_.join();
  }
  ServedSocket(const ServedSocket&) = delete;
  ServedSocket& operator=(const ServedSocket&) = delete;
  [[nodiscard]] std::string port() const override { return port_; }

 private:
  std::atomic<bool> stop_{false};
  FrontStats stats_;
  Server server_;
  std::string port_;
  std::thread thread_;
};

/// A node on FUSE.
template <class Node>
class ServedBus final : public ServedFront {
 public:
  template <class... Arguments>
  explicit ServedBus(const std::string& bus, const char* name, Arguments&&... arguments)
      : bus_(bus), node_(name, hurry, std::forward<Arguments>(arguments)...) {}
  [[nodiscard]] std::string port() const override { return bus_ + ":" + node_.path(); }

 private:
  std::string bus_;
  ServedNode<Node> node_;
};

/// How a device is reached.
struct WatchedFront {
  const char* name;
  Personality personality;
};
inline constexpr std::array<WatchedFront, 5> kWatchedFronts{{{"socket", Personality::omni},
                                                             {"udp", Personality::falcon},
                                                             {"fw", Personality::omni},
                                                             {"usb", Personality::falcon},
                                                             {"hid", Personality::woodenhaptics}}};

/// Throws `HilError` where this machine has no such front.
inline std::unique_ptr<ServedFront> serve(const WatchedFront& front, PacketDevice& device,
                                          const std::filesystem::path& folder) {
  const std::string name = front.name;
  if (name == "socket") {
    return std::make_unique<ServedSocket<SeqpacketServer>>((folder / "port").string(),
                                                           front.personality, device);
  }
  if (name == "udp") {
    return std::make_unique<ServedSocket<UdpServer>>("0", front.personality, device);
  }
  if (name == "fw") {
    FirewireSettings settings;
    settings.clock = BusClock::real_time();
    return std::make_unique<ServedBus<FirewireNode>>("fw", "fw1", settings, device);
  }
  if (name == "usb") {
    const FtdiFalcon::Settings settings{.firmware_runs = true};
    return std::make_unique<ServedBus<UsbfsNode>>("usb", "usb", settings,
                                                  std::vector<ScriptedUsbFault>{}, device);
  }
  return std::make_unique<ServedBus<HidrawNode>>("hid", "hidraw0", WoodenHid::Settings{}, device);
}

}  // namespace kerf::test
