// SPDX-License-Identifier: Apache-2.0

#include "shared/segment/server.hpp"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <sched.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include "shared/posix/error_text.hpp"
#include "shared/posix/sockets.hpp"
#include "shared/posix/stop_signals.hpp"
#include "shared/posix/threads.hpp"
#include "shared/segment/connection.hpp"
#include "shared/segment/layout_table.hpp"

namespace kerf {
namespace {

/// The socket at `path`, NAME.sock, to which readers connect; the destructor removes the path.
/// Until it listens, it is NAME.new: a reader that finds NAME.sock is not refused in between.
class Listener {
 public:
  explicit Listener(std::string path) : path_(std::move(path)) {
    const std::string unborn = std::filesystem::path(path_).replace_extension(".new");
    const sockaddr_un address = unix_address(unborn);
    unlink(unborn.c_str());  // left by a dead controller: we hold the name lock
    fd_ = OwnedFd(socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    constexpr mode_t kOwnerAlone = S_IRUSR | S_IWUSR;  // bind() creates the file with these rights
    if (fd_.get() < 0 || fchmod(fd_.get(), kOwnerAlone) != 0 ||
        bind(fd_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
        listen(fd_.get(), SOMAXCONN) != 0) {
      fail(unborn, unborn);
    }
    if (rename(unborn.c_str(), path_.c_str()) != 0) fail(path_, unborn);
  }
  ~Listener() { unlink(path_.c_str()); }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  [[nodiscard]] int get() const noexcept { return fd_.get(); }

 private:
  [[noreturn]] static void fail(const std::string& place, const std::string& unborn) {
    const int error = errno;
    unlink(unborn.c_str());
    throw SegmentError(place + ": " + system_message(error) + "; " +
                       remedy_for(error, "remove what is there, or make the folder writable"));
  }

  std::string path_;
  OwnedFd fd_;
};

/// Opens the memfd again, read-only: readers cannot map it writable.
[[nodiscard]] OwnedFd reopen_read_only(int memfd) {
  const std::string path = "/proc/self/fd/" + std::to_string(memfd);
  OwnedFd fd(open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (fd.get() < 0) {
    throw SegmentError(path + ": " + system_message(errno) + "; " +
                       remedy_for(errno, "mount /proc"));
  }
  return fd;
}

/// An event that ends the server's thread.
[[nodiscard]] OwnedFd make_event() {
  OwnedFd fd(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  if (fd.get() < 0) {
    throw SegmentError("eventfd: " + system_message(errno) + "; " +
                       remedy_for(errno, "end other programs"));
  }
  return fd;
}

[[nodiscard]] bool send_hello(int peer, const SegmentHello& hello, int segment) noexcept {
  SegmentHello message = hello;
  iovec part{&message, sizeof message};
  alignas(cmsghdr) char control[CMSG_SPACE(sizeof(int))] = {};
  msghdr header{};
  header.msg_iov = &part;
  header.msg_iovlen = 1;
  header.msg_control = control;
  header.msg_controllen = sizeof control;
  cmsghdr* const rights = CMSG_FIRSTHDR(&header);
  rights->cmsg_level = SOL_SOCKET;
  rights->cmsg_type = SCM_RIGHTS;
  rights->cmsg_len = CMSG_LEN(sizeof(int));
  std::memcpy(CMSG_DATA(rights), &segment, sizeof segment);
  return sendmsg(peer, &header, MSG_NOSIGNAL | MSG_DONTWAIT) == sizeof message;
}

}  // namespace

struct SegmentServer::State {
  State(std::string_view name, int memfd, std::uint64_t session_id, CommandLimits command_limits,
        Answer others_answer)
      : path(segment_socket(name)),
        lock(name),
        listener(path),
        segment(reopen_read_only(memfd)),
        stop(make_event()),
        hello{kSegmentMagic, kLayoutMajor, kLayoutMinor, kAbiHash, session_id},
        limits(command_limits),
        others(std::move(others_answer)) {
    polled.reserve(2 + kMaxPeers);  // here, because the thread could not report a failure
    peers.reserve(kMaxPeers);
    thread = std::thread([this] { serve(); });
  }

  ~State() {
    eventfd_write(stop.get(), 1);
    thread.join();
  }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  void serve() noexcept {
    block_signals();
    const sched_param normal{};
    pthread_setschedparam(pthread_self(), SCHED_OTHER, &normal);
    for (;;) {
      polled.assign({{stop.get(), POLLIN, 0}, {listener.get(), POLLIN, 0}});
      for (const OwnedFd& peer : peers) polled.push_back({peer.get(), POLLIN, 0});
      if (poll(polled.data(), polled.size(), -1) < 0) continue;
      if (polled[0].revents != 0) return;
      std::size_t kept = 0;
      for (std::size_t i = 0; i < peers.size(); ++i) {
        const bool stays = polled[i + 2].revents == 0 || answer(peers[i].get());
        if (stays) std::swap(peers[kept++], peers[i]);
      }
      peers.resize(kept);
      if (polled[1].revents != 0) admit();
    }
  }

  void admit() {
    OwnedFd peer(accept4(listener.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
    if (peer.get() < 0 && (errno == EMFILE || errno == ENFILE)) {
      usleep(10'000);  // the client stays in the backlog: do not spin until a descriptor is free
    }
    if (peer.get() < 0 || peers.size() >= kMaxPeers || other_user_at(peer.get())) return;
    if (send_hello(peer.get(), hello, segment.get())) peers.push_back(std::move(peer));
  }

  /// Replies to one message of a peer; returns false if the peer has gone or does not read the
  /// reply.
  bool answer(int peer) noexcept {
    SegmentCommand command;
    const ssize_t length = recv(peer, &command, sizeof command, MSG_DONTWAIT | MSG_TRUNC);
    if (length < 0) return errno == EAGAIN || errno == EINTR;
    if (length == 0) return false;
    Reply reply;
    if (others && length == static_cast<ssize_t>(sizeof command)) {
      reply = others(command);
    } else if (length == static_cast<ssize_t>(sizeof command) && is_valid(command, limits)) {
      command.index = accepted + 1;
      const bool queued = commands.push(command);
      if (queued) reply.index = ++accepted;
      reply.status = queued ? ReplyStatus::accepted : ReplyStatus::busy;
    }
    return send(peer, &reply, sizeof reply, MSG_NOSIGNAL | MSG_DONTWAIT) == sizeof reply;
  }

  SpscQueue<SegmentCommand, kCommandSlots> commands;  // first: it is aligned to cache lines
  std::string path;
  NameLock lock;
  Listener listener;
  OwnedFd segment;
  OwnedFd stop;
  SegmentHello hello;
  CommandLimits limits;
  Answer others;  // if set, it gets the commands instead of the queue
  std::vector<pollfd> polled;
  std::vector<OwnedFd> peers;
  std::uint32_t accepted = 0;
  std::thread thread;  // last: everything it uses is ready before it starts
};

SegmentServer::SegmentServer(std::string_view name, const SegmentWriter& writer,
                             CommandLimits limits)
    : state_(std::make_unique<State>(name, writer.fd(), writer.session_id(), limits, Answer{})) {}
SegmentServer::SegmentServer(std::string_view name, int memfd, std::uint64_t session_id,
                             Answer answer)
    : state_(std::make_unique<State>(name, memfd, session_id, CommandLimits{}, std::move(answer))) {
}
SegmentServer::~SegmentServer() = default;

std::optional<SegmentCommand> SegmentServer::take_command() noexcept {
  return state_->commands.take();
}

}  // namespace kerf
