// SPDX-License-Identifier: Apache-2.0
#include "tests/hil/clients/raw1394_client.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <system_error>

#include <fcntl.h>
#include <linux/firewire-cdev.h>
#include <sys/epoll.h>
#include <sys/ioctl.h>
#include <unistd.h>

namespace kerf::test {
namespace {

constexpr std::uint32_t kInterfaceVersion = 3;  // older than that of our own driver
constexpr std::uint32_t kMostBandwidth = 4915;
constexpr int kPatienceMs = 1000;

std::array<std::uint8_t, 4> bus_order(std::uint32_t value) {
  return {static_cast<std::uint8_t>(value >> 24), static_cast<std::uint8_t>(value >> 16),
          static_cast<std::uint8_t>(value >> 8), static_cast<std::uint8_t>(value)};
}
/// Channel 0 is the highest bit of its register.
std::uint32_t bit_of(unsigned channel) {
  return 1U << (31 - channel % 32);
}
std::uint64_t register_of(unsigned channel) {
  return channel < 32 ? Raw1394Client::kChannelsLow : Raw1394Client::kChannelsHigh;
}

}  // namespace

std::uint32_t Raw1394Client::Answer::quadlet() const noexcept {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4 && i < bytes.size(); ++i) value = value << 8 | bytes[i];
  return value;
}

Raw1394Client::Raw1394Client(const std::string& folder) : epoll_(epoll_create1(EPOLL_CLOEXEC)) {
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(folder, ignored)) {
    if (entry.path().filename().string().starts_with("fw")) add(entry.path().string());
  }
  if (local_path_.empty()) throw std::runtime_error(folder + ": no node is the local one");
}

Raw1394Client::~Raw1394Client() {
  for (const auto& [id, node] : nodes_) close(node.fd);
  close(epoll_);
}

void Raw1394Client::add(const std::string& path) {
  const int fd = open(path.c_str(), O_RDWR | O_CLOEXEC);
  if (fd < 0) return;
  fw_cdev_event_bus_reset state{};
  fw_cdev_get_info info{};
  info.version = kInterfaceVersion;
  info.bus_reset = reinterpret_cast<std::uintptr_t>(&state);
  if (ioctl(fd, FW_CDEV_IOC_GET_INFO, &info) != 0) {
    close(fd);
    return;
  }
  nodes_[state.node_id] = {path, fd};
  if (state.node_id == state.local_node_id) {
    local_path_ = path;
    learn(state);
  }
  epoll_event watched{};
  watched.events = EPOLLIN;
  watched.data.fd = fd;
  epoll_ctl(epoll_, EPOLL_CTL_ADD, fd, &watched);
}

void Raw1394Client::learn(const fw_cdev_event_bus_reset& state) {
  local_id_ = state.local_node_id;
  manager_id_ = state.irm_node_id;
  generation_ = state.generation;
  nodes_on_bus_ = static_cast<int>(state.root_node_id & 0x3F) + 1;
}

std::vector<std::uint32_t> Raw1394Client::nodes() const {
  std::vector<std::uint32_t> ids;
  for (const auto& [id, node] : nodes_) ids.push_back(id);
  return ids;
}

bool Raw1394Client::hear() {
  epoll_event ready{};
  if (epoll_wait(epoll_, &ready, 1, kPatienceMs) <= 0) return false;
  if ((ready.events & EPOLLHUP) != 0) {  // unplugged
    close(ready.data.fd);
    std::erase_if(nodes_, [&](const auto& entry) { return entry.second.fd == ready.data.fd; });
    return true;
  }
  std::array<std::uint8_t, 4096> bytes{};
  const ssize_t size = ::read(ready.data.fd, bytes.data(), bytes.size());
  if (size < static_cast<ssize_t>(sizeof(fw_cdev_event_common))) return false;
  fw_cdev_event_common about{};
  std::memcpy(&about, bytes.data(), sizeof about);
  if (about.type == FW_CDEV_EVENT_BUS_RESET) {
    fw_cdev_event_bus_reset state{};
    std::memcpy(&state, bytes.data(), sizeof state);
    if (state.node_id == state.local_node_id) learn(state);
  } else if (about.type == FW_CDEV_EVENT_RESPONSE) {
    fw_cdev_event_response response{};
    std::memcpy(&response, bytes.data(), sizeof response);
    const auto* data = bytes.data() + offsetof(fw_cdev_event_response, data);
    answered_ = response.closure;
    answer_ = {static_cast<int>(response.rcode), {data, data + response.length}};
  }
  return true;
}

Raw1394Client::Answer Raw1394Client::request(std::uint32_t node, std::uint32_t tcode,
                                             std::uint64_t offset, std::uint32_t bytes,
                                             const void* data) {
  const auto found = nodes_.find(node);
  if (found == nodes_.end()) return {};
  fw_cdev_send_request request{};
  request.tcode = tcode;
  request.length = bytes;
  request.offset = offset;
  request.closure = ++requests_;
  request.data = reinterpret_cast<std::uintptr_t>(data);
  request.generation = generation_;
  if (ioctl(found->second.fd, FW_CDEV_IOC_SEND_REQUEST, &request) != 0) return {};
  while (answered_ != requests_) {
    if (!hear()) return {};
  }
  return answer_;
}

Raw1394Client::Answer Raw1394Client::read(std::uint32_t node, std::uint64_t offset,
                                          std::uint32_t bytes) {
  const std::uint32_t tcode = bytes == 4 ? TCODE_READ_QUADLET_REQUEST : TCODE_READ_BLOCK_REQUEST;
  return request(node, tcode, offset, bytes, nullptr);
}

Raw1394Client::Answer Raw1394Client::write(std::uint32_t node, std::uint64_t offset,
                                           std::uint32_t value) {
  const auto data = bus_order(value);
  return request(node, TCODE_WRITE_QUADLET_REQUEST, offset, 4, data.data());
}

Raw1394Client::Answer Raw1394Client::swap(std::uint32_t node, std::uint64_t offset,
                                          std::uint32_t expected, std::uint32_t value) {
  std::array<std::uint8_t, 8> data{};
  std::ranges::copy(bus_order(expected), data.begin());
  std::ranges::copy(bus_order(value), data.begin() + 4);
  return request(node, TCODE_LOCK_COMPARE_SWAP, offset, 8, data.data());
}

bool Raw1394Client::modify(std::uint64_t offset, std::uint32_t from, std::uint32_t to) {
  const Answer swapped = swap(manager_id_, offset, from, to);
  return swapped.rcode == RCODE_COMPLETE && swapped.quadlet() == from;
}

bool Raw1394Client::take_bandwidth(std::uint32_t units) {
  const Answer left = read(manager_id_, kBandwidth);
  if (left.rcode != RCODE_COMPLETE || left.quadlet() < units) return false;
  return modify(kBandwidth, left.quadlet(), left.quadlet() - units);
}

bool Raw1394Client::free_bandwidth(std::uint32_t units) {
  const Answer left = read(manager_id_, kBandwidth);
  if (left.rcode != RCODE_COMPLETE) return false;
  return modify(kBandwidth, left.quadlet(), std::min(left.quadlet() + units, kMostBandwidth));
}

bool Raw1394Client::take_channel(unsigned channel) {
  const Answer free = read(manager_id_, register_of(channel));
  if (free.rcode != RCODE_COMPLETE || (free.quadlet() & bit_of(channel)) == 0) return false;
  return modify(register_of(channel), free.quadlet(), free.quadlet() & ~bit_of(channel));
}

bool Raw1394Client::free_channel(unsigned channel) {
  const Answer free = read(manager_id_, register_of(channel));
  if (free.rcode != RCODE_COMPLETE || (free.quadlet() & bit_of(channel)) != 0) return false;
  return modify(register_of(channel), free.quadlet(), free.quadlet() | bit_of(channel));
}

bool Raw1394Client::reset_bus() {
  const std::uint32_t before = generation_;
  fw_cdev_initiate_bus_reset how{FW_CDEV_SHORT_RESET};
  if (ioctl(nodes_.at(local_id_).fd, FW_CDEV_IOC_INITIATE_BUS_RESET, &how) != 0) return false;
  while (generation_ == before) {
    if (!hear()) return false;
  }
  return true;
}

}  // namespace kerf::test
