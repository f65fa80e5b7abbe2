// SPDX-License-Identifier: Apache-2.0
#include "controller/device/port/firewire_file.hpp"

#include <cerrno>

#include <fcntl.h>
#include <linux/firewire-cdev.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

namespace kerf {
namespace {

/// Below 5 the kernel drops what overflows an event; above 5 answers change their form.
constexpr std::uint32_t kInterfaceVersion = 5;

}  // namespace

FirewireFile::~FirewireFile() {
  if (fd_ >= 0) close(fd_);
}

int FirewireFile::open(const std::string& path) noexcept {
  const int fresh = ::open(path.c_str(), O_RDWR | O_CLOEXEC);
  if (fresh < 0) return errno;
  gone_ = false;
  if (fd_ < 0) {
    fd_ = fresh;
    return 0;
  }
  const int error = dup3(fresh, fd_, O_CLOEXEC) < 0 ? errno : 0;
  close(fresh);
  return error;
}

std::optional<std::uint32_t> FirewireFile::link() noexcept {
  fw_cdev_event_bus_reset state{};
  fw_cdev_get_info info{};
  info.version = kInterfaceVersion;
  info.bus_reset = reinterpret_cast<std::uintptr_t>(&state);
  if (call(FW_CDEV_IOC_GET_INFO, &info) < 0) return std::nullopt;
  return state.generation;
}

int FirewireFile::call(unsigned long command, void* argument) noexcept {
  int result = -1;
  while ((result = ioctl(fd_, command, argument)) < 0 && errno == EINTR) {
  }
  if (result >= 0) return result;
  const int error = errno;
  note(error);
  return -error;
}

bool FirewireFile::ready(int milliseconds) noexcept {
  pollfd watched{fd_, POLLIN, 0};
  int found = -1;
  while ((found = poll(&watched, 1, milliseconds)) < 0 && errno == EINTR) {
  }
  if (found <= 0) return false;
  if ((watched.revents & POLLIN) != 0) return true;
  if ((watched.revents & (POLLERR | POLLHUP)) != 0) gone_ = true;
  return false;
}

std::span<const std::uint8_t> FirewireFile::read(std::span<std::uint8_t> buffer) noexcept {
  const ssize_t size = ::read(fd_, buffer.data(), buffer.size());
  if (size >= 0) return buffer.first(static_cast<std::size_t>(size));
  note(errno);
  return {};
}

void FirewireFile::note(int error) noexcept {
  if (error == ENODEV || error == ENOTCONN) gone_ = true;
}

}  // namespace kerf
