// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "shared/posix/failure.hpp"
#include "shared/segment/hand_over.hpp"
#include "shared/segment/hand_over_wire.hpp"

namespace kerf {

OwnedFd::OwnedFd(OwnedFd&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
OwnedFd& OwnedFd::operator=(OwnedFd&& other) noexcept {
  std::swap(fd_, other.fd_);
  return *this;
}
OwnedFd::~OwnedFd() {
  if (fd_ >= 0) close(fd_);
}
int OwnedFd::release() noexcept {
  return std::exchange(fd_, -1);
}

std::string segment_folder() {
  const char* const runtime =
      std::getenv("XDG_RUNTIME_DIR");  // NOLINT(concurrency-mt-unsafe): start
  const std::string folder = runtime != nullptr && runtime[0] == '/'
                                 ? std::string(runtime) + "/kerf"
                                 : "/tmp/kerf-" + std::to_string(geteuid());
  if (mkdir(folder.c_str(), 0700) != 0 && errno != EEXIST) {
    throw SegmentError(folder + ": " + system_message(errno) +
                       "; set XDG_RUNTIME_DIR to a folder of yours");
  }
  struct stat status {};
  if (lstat(folder.c_str(), &status) != 0 || !S_ISDIR(status.st_mode) ||
      status.st_uid != geteuid() || (status.st_mode & 0077) != 0) {
    throw SegmentError(folder + ": not a folder of yours alone; remove it or chmod 700");
  }
  return folder;
}

std::string segment_socket(std::string_view name) {
  constexpr std::size_t kMaxName = 64;
  const bool plain = std::all_of(name.begin(), name.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
           c == '_' || c == '-';
  });
  if (name.empty() || name.size() > kMaxName || name.front() == '.' || !plain) {
    throw SegmentError("--name: '" + std::string(name) +
                       "'; use 1 to 64 letters, digits, '.', '_' or '-', not starting with '.'");
  }
  std::string path = segment_folder() + "/" + std::string(name) + ".sock";
  if (path.size() >= sizeof(sockaddr_un::sun_path)) {
    throw SegmentError(path + ": too long for a socket; use a shorter --name or XDG_RUNTIME_DIR");
  }
  return path;
}

NameLock::NameLock(std::string_view name)
    : path_(segment_folder() + "/" + std::string(name) + ".lock") {
  for (;;) {
    file_ = OwnedFd(open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600));
    if (file_.get() < 0) {
      throw SegmentError(path_ + ": " + system_message(errno) + "; " +
                         way_out_of(errno, "make the folder writable"));
    }
    if (flock(file_.get(), LOCK_EX | LOCK_NB) != 0) {
      std::array<char, 24> holder{};
      const ssize_t length = pread(file_.get(), holder.data(), holder.size() - 1, 0);
      throw SegmentError("--name " + std::string(name) + ": in use by process " +
                         (length > 0 ? holder.data() : "?") + "; stop it or choose another name");
    }
    // The last holder may have unlinked the file between our open and our lock.
    struct stat ours {};
    struct stat named {};
    if (fstat(file_.get(), &ours) == 0 && stat(path_.c_str(), &named) == 0 &&
        ours.st_ino == named.st_ino && ours.st_dev == named.st_dev) {
      break;
    }
  }
  const std::string pid = std::to_string(getpid());
  if (ftruncate(file_.get(), 0) != 0 ||
      pwrite(file_.get(), pid.data(), pid.size(), 0) != static_cast<ssize_t>(pid.size())) {
    throw SegmentError(path_ + ": " + system_message(errno) + "; free disk space");
  }
}

NameLock::~NameLock() {
  unlink(path_.c_str());
}

}  // namespace kerf
