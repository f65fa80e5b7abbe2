// SPDX-License-Identifier: Apache-2.0

#include "shared/segment/connection.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <unistd.h>

#include "shared/posix/error_text.hpp"
#include "shared/posix/sockets.hpp"
#include "shared/segment/layout.hpp"
#include "shared/segment/server.hpp"

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

namespace {

bool is_name(std::string_view name) {
  constexpr std::size_t kMaxName = 64;
  const bool plain = std::all_of(name.begin(), name.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
           c == '_' || c == '-';
  });
  return plain && !name.empty() && name.size() <= kMaxName && name.front() != '.';
}

/// Connects `fd` to the socket at `path`; returns 0, or the error.
int connect_to(int fd, const std::string& path) {
  if (path.size() >= sizeof(sockaddr_un::sun_path)) return ENAMETOOLONG;
  const sockaddr_un address = unix_address(path);
  return connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 ? 0 : errno;
}

/// The remedy if no controller has the name; lists those that run, such as a demo's.
std::string way_to_a_controller() {
  constexpr std::size_t kMost = 8;
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(segment_folder(), error)) {
    const std::filesystem::path& path = entry.path();
    if (path.extension() != ".sock" || !is_name(path.stem().native())) continue;
    // A socket of another type: connect() always fails, with EPROTOTYPE if a controller listens,
    // which does not notice.
    const OwnedFd asking(socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
    if (connect_to(asking.get(), path.native()) == EPROTOTYPE)
      names.push_back(path.stem().string());
  }
  std::string way = "start kerf-controller with this name first";
  if (names.empty()) return way;
  std::ranges::sort(names);
  way += ", or take a name that runs: ";
  for (std::size_t i = 0; i < std::min(names.size(), kMost); ++i) way += (i ? ", " : "") + names[i];
  return names.size() > kMost ? way + ", ..." : way;
}

}  // namespace

std::string segment_socket(std::string_view name) {
  if (!is_name(name)) {
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
                         remedy_for(errno, "remove what is there, or make the folder writable"));
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

namespace {

constexpr timeval kAnswerTimeout{2, 0};  // the server's thread is never busy for long

/// The result of a call on a socket with a timeout, made again if a signal interrupts it: Linux
/// does not restart such a call, not even after a program was only stopped and continued
/// (signal(7)).
template <class Call>
[[nodiscard]] ssize_t uninterrupted(const Call& call) {
  ssize_t result = 0;
  do {
    result = call();
  } while (result < 0 && errno == EINTR);
  return result;
}

/// Receives the hello and the descriptor passed with it.
[[nodiscard]] OwnedFd receive_segment(int socket, const std::string& path) {
  SegmentHello hello;
  iovec part{&hello, sizeof hello};
  alignas(cmsghdr) char control[CMSG_SPACE(sizeof(int))] = {};
  msghdr header{};
  header.msg_iov = &part;
  header.msg_iovlen = 1;
  header.msg_control = control;
  header.msg_controllen = sizeof control;
  const ssize_t length = uninterrupted([&] { return recvmsg(socket, &header, MSG_CMSG_CLOEXEC); });
  OwnedFd segment;
  const cmsghdr* const rights = CMSG_FIRSTHDR(&header);
  if (length > 0 && rights != nullptr && rights->cmsg_level == SOL_SOCKET &&
      rights->cmsg_type == SCM_RIGHTS && rights->cmsg_len == CMSG_LEN(sizeof(int))) {
    int fd = -1;
    std::memcpy(&fd, CMSG_DATA(rights), sizeof fd);
    segment = OwnedFd(fd);
  }
  if (length == 0) {
    throw SegmentError(path + ": the controller refused; close another reader (at most " +
                       std::to_string(SegmentServer::kMaxPeers) + ")");
  }
  if (length != static_cast<ssize_t>(sizeof hello) || hello.magic != kSegmentMagic ||
      segment.get() < 0) {
    throw SegmentError(path + ": no greeting of a kerf-controller; is it of this version?");
  }
  require_same_layout(hello.layout_major, hello.layout_minor, hello.abi_hash);
  return segment;
}

/// For the present `errno`.
[[nodiscard]] SegmentError no_answer() {
  return SegmentError(std::string("command: no answer of the controller: ") +
                      system_message(errno) + "; is it still running?");
}

}  // namespace

SegmentConnection::SegmentConnection(int socket, SegmentReader reader) noexcept
    : socket_(socket), reader_(std::move(reader)) {}

SegmentConnection::SegmentConnection(SegmentConnection&& other) noexcept
    : socket_(std::exchange(other.socket_, -1)),
      awaited_(other.awaited_),
      reader_(std::move(other.reader_)) {}

SegmentConnection& SegmentConnection::operator=(SegmentConnection&& other) noexcept {
  std::swap(socket_, other.socket_);
  std::swap(awaited_, other.awaited_);
  std::swap(reader_, other.reader_);
  return *this;
}

SegmentConnection::~SegmentConnection() {
  if (socket_ >= 0) close(socket_);
}

bool SegmentConnection::alive() const noexcept {
  pollfd polled{socket_, POLLIN, 0};
  if (poll(&polled, 1, 0) < 0) return errno == EINTR;
  if ((polled.revents & (POLLHUP | POLLERR | POLLNVAL)) != 0) return false;
  return true;
}

Reply SegmentConnection::send(const SegmentCommand& command) {
  while (awaited_ > 0) receive();
  if (uninterrupted([&] { return ::send(socket_, &command, sizeof command, MSG_NOSIGNAL); }) !=
      static_cast<ssize_t>(sizeof command)) {
    throw no_answer();
  }
  ++awaited_;
  return receive();
}

Reply SegmentConnection::receive() {
  Reply reply;
  if (uninterrupted([&] { return recv(socket_, &reply, sizeof reply, 0); }) !=
      static_cast<ssize_t>(sizeof reply)) {
    throw no_answer();
  }
  --awaited_;
  return reply;
}

SegmentConnection connect_segment(std::string_view name) {
  const std::string path = segment_socket(name);
  OwnedFd link(socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0));
  if (link.get() < 0) {
    throw SegmentError("--name " + std::string(name) + ": " + system_message(errno) + "; " +
                       remedy_for(errno, "end other programs"));
  }
  if (const int error = connect_to(link.get(), path); error != 0) {
    throw SegmentAbsent("--name " + std::string(name) + ": " + system_message(error) + " (" + path +
                        "); " + way_to_a_controller());
  }
  setsockopt(link.get(), SOL_SOCKET, SO_RCVTIMEO, &kAnswerTimeout, sizeof kAnswerTimeout);
  setsockopt(link.get(), SOL_SOCKET, SO_SNDTIMEO, &kAnswerTimeout, sizeof kAnswerTimeout);
  SegmentReader reader = SegmentReader::map(receive_segment(link.get(), path).get());
  return {link.release(), std::move(reader)};
}

}  // namespace kerf
