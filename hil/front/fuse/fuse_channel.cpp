// SPDX-License-Identifier: Apache-2.0
#include "hil/front/fuse/fuse_channel.hpp"

#include <algorithm>
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
#include "shared/posix/error_text.hpp"
#include "shared/posix/monotonic_clock.hpp"

namespace kerf {
namespace {

std::string reason() {
  return std::generic_category().message(errno);
}

constexpr std::size_t kPageBytes = 4096;

void* pointer(std::uint64_t address) noexcept {
  // An address of another process: never followed here, only handed to the kernel.
  return reinterpret_cast<void*>(address);  // NOLINT(performance-no-int-to-ptr)
}

}  // namespace

FuseChannel::FuseChannel(std::string folder) : folder_(std::move(folder)) {
  struct stat file {};
  if (stat(folder_.c_str(), &file) != 0 && errno == ENOTCONN) {
    umount2(folder_.c_str(), MNT_DETACH);  // left by an emulator that was killed
  }
  if (stat(folder_.c_str(), &file) != 0 || !S_ISDIR(file.st_mode)) {
    throw HilError("--mount: " + folder_ + " is no folder; make one");
  }
  fd_ = ::open("/dev/fuse", O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (fd_ < 0) {
    const int error = errno;
    throw HilError("--front fuse: /dev/fuse cannot be opened (" + reason() + "); " +
                   remedy_for(error, "run as root, or use --front socket"));
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
  // writev() only reads, but takes an iovec, whose pointer is not const.
  const std::array<iovec, 3> parts{{{&header, sizeof header},
                                    {const_cast<std::uint8_t*>(head.data()), head.size()},
                                    {const_cast<std::uint8_t*>(rest.data()), rest.size()}}};
  // ENOENT: the client was killed meanwhile.
  static_cast<void>(writev(fd_, parts.data(), static_cast<int>(parts.size())));
}

std::size_t read_caller(pid_t thread, std::uint64_t address, std::span<std::uint8_t> out) noexcept {
  const iovec here{out.data(), out.size()};
  const iovec there{pointer(address), out.size()};
  if (process_vm_readv(thread, &here, 1, &there, 1, 0) == static_cast<ssize_t>(out.size())) {
    return out.size();
  }
  // The kernel promises whole elements only: page by page, to find the end of the memory.
  std::size_t done = 0;
  while (done < out.size()) {
    const std::size_t to_page_end = kPageBytes - (address + done) % kPageBytes;
    const std::size_t size = std::min(to_page_end, out.size() - done);
    const iovec part{&out[done], size};
    const iovec from{pointer(address + done), size};
    if (process_vm_readv(thread, &part, 1, &from, 1, 0) != static_cast<ssize_t>(size)) break;
    done += size;
  }
  return done;
}

bool write_caller(pid_t thread, std::uint64_t address,
                  std::span<const std::uint8_t> bytes) noexcept {
  // The system call takes both ends as iovec, whose pointer is not const.
  const iovec here{const_cast<std::uint8_t*>(bytes.data()), bytes.size()};
  const iovec there{pointer(address), bytes.size()};
  return process_vm_writev(thread, &here, 1, &there, 1, 0) == static_cast<ssize_t>(bytes.size());
}

}  // namespace kerf
