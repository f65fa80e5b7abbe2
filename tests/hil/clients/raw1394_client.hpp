// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

struct fw_cdev_event_bus_reset;

namespace kerf::test {

/// A program on a FireWire bus that asks as libraw1394 does, with none of its code: it opens every
/// node of the bus, knows the card by the node whose id is the local one, learns of events through
/// one epoll, and takes channels and bandwidth by reading a register of the resource manager and
/// swapping it. One thread.
class Raw1394Client {
 public:
  /// Opens all of `folder` that is a FireWire node. Throws std::runtime_error if no node is the
  /// local one.
  explicit Raw1394Client(const std::string& folder);
  ~Raw1394Client();
  Raw1394Client(const Raw1394Client&) = delete;
  Raw1394Client& operator=(const Raw1394Client&) = delete;

  [[nodiscard]] std::uint32_t local_id() const noexcept { return local_id_; }
  [[nodiscard]] std::uint32_t manager_id() const noexcept { return manager_id_; }
  [[nodiscard]] int node_count() const noexcept { return nodes_on_bus_; }
  [[nodiscard]] std::uint32_t generation() const noexcept { return generation_; }
  /// The nodes that have a file.
  [[nodiscard]] std::vector<std::uint32_t> nodes() const;
  [[nodiscard]] const std::string& local_path() const noexcept { return local_path_; }

  struct Answer {
    int rcode = -1;  ///< -1: none came within a second
    std::vector<std::uint8_t> bytes;
    [[nodiscard]] std::uint32_t quadlet() const noexcept;
  };
  [[nodiscard]] Answer read(std::uint32_t node, std::uint64_t offset, std::uint32_t bytes = 4);
  [[nodiscard]] Answer write(std::uint32_t node, std::uint64_t offset, std::uint32_t value);
  /// Compare and swap of 32 bits.
  [[nodiscard]] Answer swap(std::uint32_t node, std::uint64_t offset, std::uint32_t expected,
                            std::uint32_t value);

  /// Each reads a register of the resource manager and swaps it; false: not there, or swapped by
  /// another one meanwhile.
  [[nodiscard]] bool take_bandwidth(std::uint32_t units);
  [[nodiscard]] bool free_bandwidth(std::uint32_t units);
  [[nodiscard]] bool take_channel(unsigned channel);
  [[nodiscard]] bool free_channel(unsigned channel);

  /// Resets the bus, and waits for the event of the local node.
  [[nodiscard]] bool reset_bus();

  static constexpr std::uint64_t kCsr = 0xFFFF'F000'0000;
  static constexpr std::uint64_t kBusManager = kCsr + 0x21C;
  static constexpr std::uint64_t kBandwidth = kCsr + 0x220;
  static constexpr std::uint64_t kChannelsLow = kCsr + 0x224;
  static constexpr std::uint64_t kChannelsHigh = kCsr + 0x228;

 private:
  struct Node {
    std::string path;
    int fd;
  };
  void add(const std::string& path);
  void learn(const fw_cdev_event_bus_reset& state);
  [[nodiscard]] Answer request(std::uint32_t node, std::uint32_t tcode, std::uint64_t offset,
                               std::uint32_t bytes, const void* data);
  [[nodiscard]] bool modify(std::uint64_t offset, std::uint32_t from, std::uint32_t to);
  /// One event of any node; false: none within a second.
  [[nodiscard]] bool hear();

  int epoll_;
  std::map<std::uint32_t, Node> nodes_;  ///< by their ids
  std::string local_path_;
  std::uint32_t local_id_ = 0, manager_id_ = 0, generation_ = 0;
  int nodes_on_bus_ = 0;
  std::uint64_t requests_ = 0;
  std::optional<std::uint64_t> answered_;  ///< which of them, last
  Answer answer_;
};

}  // namespace kerf::test
