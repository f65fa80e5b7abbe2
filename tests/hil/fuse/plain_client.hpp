// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <span>
#include <string>
#include <vector>

#include <fcntl.h>
#include <linux/firewire-cdev.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

namespace kerf::test {

/// One open of a node and nothing but system calls, passed on as a test makes them.
class PlainClient {
 public:
  explicit PlainClient(const std::string& path, bool linked = true)
      : fd_(open(path.c_str(), O_RDWR)) {
    if (linked) static_cast<void>(info());
  }
  ~PlainClient() {
    if (fd_ >= 0) close(fd_);
  }
  PlainClient(const PlainClient&) = delete;
  PlainClient& operator=(const PlainClient&) = delete;

  [[nodiscard]] int fd() const noexcept { return fd_; }

  /// What ioctl() returns, or a negative errno.
  template <class T>
  int call(unsigned long command, T* argument) const {
    const int result = ioctl(fd_, command, argument);
    return result < 0 ? -errno : result;
  }

  std::uint32_t info(std::uint32_t version = 5) const {
    fw_cdev_event_bus_reset reset{};
    fw_cdev_get_info info{};
    info.version = version;
    info.bus_reset = reinterpret_cast<std::uintptr_t>(&reset);
    info.bus_reset_closure = 77;
    return call(FW_CDEV_IOC_GET_INFO, &info) == 0 ? reset.generation : 0;
  }

  int request(std::uint32_t tcode, std::uint64_t offset, std::uint32_t length,
              const void* data = nullptr, std::uint64_t closure = 0,
              std::int64_t generation = -1) const {
    fw_cdev_send_request request{};
    request.tcode = tcode;
    request.length = length;
    request.offset = offset;
    request.closure = closure;
    request.data = reinterpret_cast<std::uintptr_t>(data);
    request.generation = generation < 0 ? info() : static_cast<std::uint32_t>(generation);
    return call(FW_CDEV_IOC_SEND_REQUEST, &request);
  }
  int write_byte(std::uint64_t offset, std::uint8_t value) const {
    return request(TCODE_WRITE_BLOCK_REQUEST, offset, 1, &value);
  }

  int allocate(std::uint64_t channels, std::uint32_t bandwidth, std::uint32_t* handle = nullptr,
               std::uint64_t closure = 0) const {
    fw_cdev_allocate_iso_resource request{};
    request.closure = closure;
    request.channels = channels;
    request.bandwidth = bandwidth;
    const int result = call(FW_CDEV_IOC_ALLOCATE_ISO_RESOURCE, &request);
    if (handle) *handle = request.handle;
    return result;
  }

  int create(std::uint32_t type, std::uint32_t channel, std::uint32_t header_size = 52,
             std::uint32_t speed = 0) const {
    fw_cdev_create_iso_context request{};
    request.type = type;
    request.header_size = header_size;
    request.channel = channel;
    request.speed = speed;
    request.closure = 99;
    return call(FW_CDEV_IOC_CREATE_ISO_CONTEXT, &request);
  }
  /// Entries as quadlets in the order of memory.
  int queue(std::span<const std::uint32_t> quadlets, fw_cdev_queue_iso* after = nullptr) const {
    fw_cdev_queue_iso request{};
    request.packets = reinterpret_cast<std::uintptr_t>(quadlets.data());
    request.size = static_cast<std::uint32_t>(quadlets.size_bytes());
    request.data = 0xDEAD;  // ignored without a mapped buffer
    const int result = call(FW_CDEV_IOC_QUEUE_ISO, &request);
    if (after) *after = request;
    return result;
  }
  int queue(std::initializer_list<std::uint32_t> quadlets) const {
    const std::vector<std::uint32_t> copy(quadlets);
    return queue(std::span<const std::uint32_t>(copy));
  }
  int start(std::uint32_t tags = 15, std::int32_t cycle = -1, std::uint32_t sync = 0) const {
    fw_cdev_start_iso request{cycle, sync, tags, 0};
    return call(FW_CDEV_IOC_START_ISO, &request);
  }
  int stop() const {
    fw_cdev_stop_iso request{0};
    return call(FW_CDEV_IOC_STOP_ISO, &request);
  }
  int flush() const {
    fw_cdev_flush_iso request{0};
    return call(FW_CDEV_IOC_FLUSH_ISO, &request);
  }

  [[nodiscard]] short ready(int milliseconds = 0) const {
    pollfd watched{fd_, POLLIN, 0};
    return poll(&watched, 1, milliseconds) > 0 ? watched.revents : short{0};
  }

  /// One event; empty when none comes within the time.
  struct Event {
    std::vector<std::uint8_t> bytes;

    [[nodiscard]] std::size_t size() const noexcept { return bytes.size(); }
    [[nodiscard]] std::uint32_t type() const { return as<fw_cdev_event_common>().type; }
    template <class T>
    [[nodiscard]] T as() const {
      T value{};
      std::memcpy(&value, bytes.data(), std::min(sizeof value, bytes.size()));
      return value;
    }
    /// Bytes of an ISO_INTERRUPT's headers, or of a RESPONSE's data.
    [[nodiscard]] std::span<const std::uint8_t> data() const {
      return std::span(bytes).subspan(20);
    }
  };
  [[nodiscard]] Event event(int milliseconds = 1000, std::size_t room = 8192) const {
    Event event;
    if ((ready(milliseconds) & POLLIN) == 0) return event;
    event.bytes.resize(room);
    const ssize_t size = read(fd_, event.bytes.data(), room);
    event.bytes.resize(size < 0 ? 0 : static_cast<std::size_t>(size));
    return event;
  }

 private:
  int fd_;
};

/// An entry of a received stream: room for `packets` of 52 bytes.
constexpr std::uint32_t room_for(std::uint32_t packets, bool interrupts = false) noexcept {
  return FW_CDEV_ISO_HEADER_LENGTH(52U * packets) | (interrupts ? FW_CDEV_ISO_INTERRUPT : 0U);
}

}  // namespace kerf::test
