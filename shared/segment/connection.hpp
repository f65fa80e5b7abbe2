// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "shared/segment/command.hpp"
#include "shared/segment/reader.hpp"
#include "shared/segment/writer.hpp"

namespace kerf {

/// First message of the server, with the memfd beside it. The rest of the talk is `Command` up and
/// `Reply` down, one message each.
struct SegmentHello {
  std::uint64_t magic = 0;
  std::uint32_t layout_major = 0;
  std::uint32_t layout_minor = 0;
  std::uint64_t abi_hash = 0;
  std::uint64_t session_id = 0;
};
static_assert(sizeof(SegmentHello) == 32);

/// A file descriptor, closed with its owner.
class OwnedFd {
 public:
  OwnedFd() = default;
  explicit OwnedFd(int fd) noexcept : fd_(fd) {}
  OwnedFd(OwnedFd&& other) noexcept;
  OwnedFd& operator=(OwnedFd&& other) noexcept;
  ~OwnedFd();
  [[nodiscard]] int get() const noexcept { return fd_; }
  [[nodiscard]] int release() noexcept;

 private:
  int fd_ = -1;
};

/// A lock that dies with its holder, even by SIGKILL: `NAME.lock` beside the socket.
class NameLock {
 public:
  /// Throws `SegmentError` where a live process holds the name.
  explicit NameLock(std::string_view name);
  ~NameLock();
  NameLock(const NameLock&) = delete;
  NameLock& operator=(const NameLock&) = delete;

 private:
  std::string path_;
  OwnedFd file_;
};

/// `$XDG_RUNTIME_DIR/kerf`, else `/tmp/kerf-$UID`: made with mode 0700 where it is missing. Throws
/// `SegmentError` where it belongs to somebody else, is a link or is open to others.
[[nodiscard]] std::string segment_folder();

/// Path of the socket of controller `name`: 1..64 of letters, digits, '.', '_', '-', and no leading
/// dot. Throws `SegmentError` for another name.
[[nodiscard]] std::string segment_socket(std::string_view name);

/// Hands the segment of one controller to readers, and their commands to its servo.
///
/// Owns a thread of normal priority that serves a SOCK_SEQPACKET socket: peers of this user (or
/// root) get HELLO and the memfd, read-only; their commands are checked and queued. At most
/// `kMaxPeers` at a time. The writer outlives the server.
class SegmentServer {
 public:
  static constexpr std::size_t kMaxPeers = 32;

  /// Throws `SegmentError` where another live controller has the name; the socket of a dead one is
  /// replaced.
  SegmentServer(std::string_view name, const SegmentWriter& writer, CommandLimits limits = {});

  /// For the segment `memfd` of another writer: `answer` decides what becomes of a command, whose
  /// content is unchecked. The server's thread calls it; while it waits, at most 2 s, no other
  /// reader is served. It does not throw.
  using Answer = std::function<Reply(const Command&)>;
  SegmentServer(std::string_view name, int memfd, std::uint64_t session_id, Answer answer);
  ~SegmentServer();
  SegmentServer(const SegmentServer&) = delete;
  SegmentServer& operator=(const SegmentServer&) = delete;

  /// Servo thread. Wait-free, no system call; take at most one per tick.
  [[nodiscard]] std::optional<Command> take_command() noexcept;

  [[nodiscard]] const std::string& socket_path() const noexcept;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// A reader's end of the socket. One thread.
class SegmentConnection {
 public:
  SegmentConnection(int socket, SegmentReader reader) noexcept;  ///< takes `socket` over
  SegmentConnection(SegmentConnection&& other) noexcept;
  SegmentConnection& operator=(SegmentConnection&& other) noexcept;
  ~SegmentConnection();

  [[nodiscard]] const SegmentReader& reader() const noexcept { return reader_; }

  /// False once the controller has gone; the segment stays readable. Never waits.
  [[nodiscard]] bool alive() const noexcept;

  /// Waits at most 2 s for the answer of the server's thread (not of the servo). Throws
  /// `SegmentError` where the controller has gone or does not answer.
  Reply send(const Command& command);

 private:
  int socket_ = -1;
  SegmentReader reader_;
};

/// Connects to controller `name` and maps its segment. Throws `SegmentError` where there is none.
[[nodiscard]] SegmentConnection connect_segment(std::string_view name);

}  // namespace kerf
