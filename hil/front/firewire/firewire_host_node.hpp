// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>

#include "hil/front/firewire/firewire_node.hpp"
#include "hil/front/fuse/fuse_node.hpp"

namespace kerf {

/// The node of the host's own card (`/dev/fw0` where the card came up alone), beside that of the
/// device: programs that know every node of a bus, such as those above libraw1394, begin with it
/// and ask it for channels and bandwidth. Its opens are opens of the same bus, so what it says and
/// when is the device node's business; it stays when the device is unplugged. In the same folder as
/// `device`, which outlives it.
class FirewireHostNode final : public FuseNode {
 public:
  explicit FirewireHostNode(FirewireNode& device) : device_(device) {}

  [[nodiscard]] bool present() const noexcept override { return true; }
  void open(FuseOpen open) override { device_.open_host(open); }
  void release(FuseOpen open) override { device_.release(open); }
  std::optional<FuseAnswer> read(FuseOpen open, FuseRequest request, std::uint64_t offset,
                                 std::size_t size) override {
    return device_.read(open, request, offset, size);
  }
  std::optional<FuseAnswer> ioctl(FuseOpen open, const FuseIoctl& call) override {
    return device_.ioctl(open, call);
  }
  std::uint32_t poll(FuseOpen open, bool sleeps) override { return device_.poll(open, sleeps); }
  void interrupted(FuseRequest request) override { device_.interrupted(request); }
  /// The device node wakes for both.
  [[nodiscard]] std::int64_t next_wake_ns() const noexcept override {
    return std::numeric_limits<std::int64_t>::max();
  }
  void wake() override {}

 private:
  FirewireNode& device_;
};

}  // namespace kerf
