// SPDX-License-Identifier: Apache-2.0
#include "standin/claim.hpp"

#include <fcntl.h>
#include <unistd.h>

namespace kerf::standin {
namespace {

[[nodiscard]] struct flock whole_file(short type) noexcept {
  struct flock lock {};
  lock.l_type = type;
  lock.l_whence = SEEK_SET;
  return lock;
}

[[nodiscard]] int open_lock(const std::string& path) noexcept {
  return open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
}

}  // namespace

bool Claim::take() noexcept {
  if (fd_ >= 0) return true;
  fd_ = open_lock(path_);
  taker_ = getpid();
  struct flock lock = whole_file(F_WRLCK);
  // A lock of the open file, not of the process: another copy of the library here asks, too.
  if (fd_ < 0 || fcntl(fd_, F_OFD_SETLK, &lock) == 0) return true;
  give_back();
  return false;
}

void Claim::give_back() noexcept {
  if (fd_ < 0) return;
  if (taker_ == getpid()) {  // or a child by `fork`, which has the open file too, would keep it
    struct flock none = whole_file(F_UNLCK);
    fcntl(fd_, F_OFD_SETLK, &none);
  }
  close(fd_);
  fd_ = -1;
}

bool Claim::is_with_another() const noexcept {
  if (fd_ >= 0) return false;
  const int fd = open_lock(path_);
  if (fd < 0) return false;
  struct flock lock = whole_file(F_WRLCK);
  const bool is_held = fcntl(fd, F_OFD_GETLK, &lock) == 0 && lock.l_type != F_UNLCK;
  close(fd);
  return is_held;
}

}  // namespace kerf::standin
