// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <linux/firewire-cdev.h>

#include "hil/front/firewire/firewire_bus.hpp"
#include "hil/front/firewire/iso_context.hpp"
#include "hil/front/fuse/fuse_node.hpp"

namespace kerf {

/// One open file of a FireWire node: the ioctls of linux/firewire-cdev.h with the errors of the
/// kernel's core-cdev.c (6.1), and the events that this open has not read yet.
///
/// Not modelled, ENOSYS (of which FUSE makes ENOTTY): address ranges, PHY packets, descriptors of
/// the configuration ROM, broadcasts, several channels in one context, resources for one
/// generation.
class FirewireClient : public std::enable_shared_from_this<FirewireClient> {
 public:
  /// `node`: the node whose file it is, kOmniNodeId or kHostNodeId.
  FirewireClient(FirewireBus& bus, std::uint32_t node)
      : bus_(bus), node_(node), next_handle_(bus.settings().abi_version > 5 ? 1 : 0) {}
  ~FirewireClient();
  FirewireClient(const FirewireClient&) = delete;
  FirewireClient& operator=(const FirewireClient&) = delete;

  [[nodiscard]] FuseReply ioctl(const FuseIoctl& call);

  [[nodiscard]] EventQueue& events() noexcept { return events_; }
  [[nodiscard]] const std::optional<IsoContext>& context() const noexcept { return context_; }

  /// After a bus reset: claims its channels and bandwidth again. An event reports each loss to
  /// another client.
  void reclaim_resources();
  /// Queues a BUS_RESET event if GET_INFO was called before.
  void queue_bus_reset();
  /// The lowest isochronous channel that it holds; -1 if none.
  [[nodiscard]] std::int32_t lowest_channel() const noexcept;
  [[nodiscard]] std::uint32_t node() const noexcept { return node_; }
  /// From now on every call returns ENODEV.
  void shut_down() noexcept { gone_ = true; }
  [[nodiscard]] bool gone() const noexcept { return gone_; }

 private:
  struct Resource {
    std::uint64_t channels;  ///< asked for; 0: bandwidth alone
    std::int32_t channel;    ///< got, -1: not yet
    std::int32_t bandwidth;
    std::uint64_t closure;
  };

  // Each returns the ioctl's result, or a negative errno.
  int handle(const FuseIoctl& call);
  int get_info(const FuseIoctl& call);
  int send_request(const FuseIoctl& call);
  int allocate();
  int deallocate();
  int create_context();
  int queue(const FuseIoctl& call);
  int start();
  int stop();
  int flush();
  int get_cycle_timer();
  int get_cycle_timer2();

  [[nodiscard]] fw_cdev_event_bus_reset bus_reset_event() const noexcept;
  void respond(std::uint64_t closure, std::uint32_t rcode, std::span<const std::uint8_t> data = {});
  void execute(std::uint32_t tcode, std::uint64_t offset, std::uint32_t generation,
               std::uint64_t closure, std::vector<std::uint8_t> data);
  void ask_device(std::uint32_t tcode, std::uint64_t offset, std::uint64_t closure,
                  std::vector<std::uint8_t> data);
  void try_allocation(std::uint32_t handle);
  void queue_resource_event(std::uint32_t type, std::uint32_t handle, const Resource& resource,
                            std::int32_t channel, std::int32_t bandwidth);
  template <class T>
  [[nodiscard]] T argument() const noexcept;
  template <class T>
  void give_back(const T& value) noexcept;
  [[nodiscard]] bool has_context(std::uint32_t handle) const noexcept {
    return context_.has_value() && handle == 0;
  }

  static constexpr std::size_t kLargestArgument = 40;
  static constexpr int kDeviceSpeed = SCODE_400;

  FirewireBus& bus_;
  std::uint32_t node_;
  EventQueue events_;
  std::optional<IsoContext> context_;
  std::map<std::uint32_t, Resource> resources_;
  std::uint32_t next_handle_;  ///< newer kernels begin at 1
  std::uint32_t version_ = 0;
  std::uint64_t reset_closure_ = 0;
  bool linked_ = false;
  bool gone_ = false;
  int requests_on_the_way_ = 0;
  std::array<std::uint8_t, kLargestArgument> argument_{};
};

template <class T>
T FirewireClient::argument() const noexcept {
  static_assert(sizeof(T) <= kLargestArgument);
  T value{};
  std::memcpy(&value, argument_.data(), sizeof value);
  return value;
}

template <class T>
void FirewireClient::give_back(const T& value) noexcept {
  std::memcpy(argument_.data(), &value, sizeof value);
}

}  // namespace kerf
