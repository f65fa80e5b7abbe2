// SPDX-License-Identifier: Apache-2.0
#include "hil/front/fuse/fuse_channel.hpp"

#include <cerrno>
#include <ctime>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <poll.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

#include "hil/hil_error.hpp"
#include "shared/posix/failure.hpp"
#include "shared/posix/monotonic_clock.hpp"

namespace kerf {
namespace {

std::string reason() {
  return std::generic_category().message(errno);
}

}  // namespace

FuseChannel::FuseChannel(std::string folder) : folder_(std::move(folder)) {
  struct stat file {};
  if (stat(folder_.c_str(), &file) != 0 && errno == ENOTCONN) {
    umount2(folder_.c_str(), MNT_DETACH);  // what an emulator that was killed has left
  }
  if (stat(folder_.c_str(), &file) != 0 || !S_ISDIR(file.st_mode)) {
    throw HilError("--mount: " + folder_ + " is no folder; make one");
  }
  fd_ = ::open("/dev/fuse", O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (fd_ < 0) {
    const int error = errno;
    throw HilError("--front fuse: /dev/fuse cannot be opened (" + reason() + "); " +
                   way_out_of(error, "run as root, or use --front socket"));
  }
  const std::string options = "fd=" + std::to_string(fd_) +
                              ",rootmode=40000,user_id=" + std::to_string(getuid()) +
                              ",group_id=" + std::to_string(getgid());
  if (mount("kerf-hil", folder_.c_str(), "fuse.kerf", MS_NOSUID | MS_NODEV | MS_NOEXEC,
            options.c_str()) != 0) {
    const std::string why = reason();
    close(fd_);
    throw HilError("--mount: " + folder_ + " cannot be mounted (" + why +
                   "); run as root or under unshare -Urm, or use --front socket");
  }
}

FuseChannel::~FuseChannel() {
  if (!gone_) umount2(folder_.c_str(), MNT_DETACH);
  close(fd_);
}

bool FuseChannel::wait(std::int64_t ns) const noexcept {
  const timespec patience{ns / kNsPerSecond, ns % kNsPerSecond};
  pollfd watched{fd_, POLLIN, 0};
  return ppoll(&watched, 1, &patience, nullptr) > 0;
}

std::optional<FuseMessage> FuseChannel::receive() noexcept {
  const ssize_t size = ::read(fd_, buffer_.data(), buffer_.size());
  if (size < 0) {
    // ENOENT: the client was killed before we saw its request.
    gone_ = errno != EAGAIN && errno != EINTR && errno != ENOENT;
    return std::nullopt;
  }
  const std::span<const std::uint8_t> message(buffer_.data(), static_cast<std::size_t>(size));
  const auto header = fuse_body<fuse_in_header>(message);
  if (!header) return std::nullopt;
  return FuseMessage{*header, message.subspan(sizeof *header)};
}

void FuseChannel::reply(std::uint64_t id, int error, std::span<const std::uint8_t> head,
                        std::span<const std::uint8_t> rest) noexcept {
  fuse_out_header header{};
  header.len = static_cast<std::uint32_t>(sizeof header + head.size() + rest.size());
  header.error = -error;
  header.unique = id;
  // writev() takes what it only reads as iovec, whose pointer is not const.
  const std::array<iovec, 3> parts{{{&header, sizeof header},
                                    {const_cast<std::uint8_t*>(head.data()), head.size()},
                                    {const_cast<std::uint8_t*>(rest.data()), rest.size()}}};
  // ENOENT: the client was killed meanwhile.
  static_cast<void>(writev(fd_, parts.data(), static_cast<int>(parts.size())));
}

}  // namespace kerf
