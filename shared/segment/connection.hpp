// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "shared/segment/command.hpp"
#include "shared/segment/reader.hpp"

// The path of a controller's socket, the reader's end of the connection, and what the server needs
// of both.

namespace kerf {

/// `$XDG_RUNTIME_DIR/kerf`, else `/tmp/kerf-$UID`; created with mode 0700 if it is missing.
/// Throws `SegmentError` if it belongs to another user, is a link or is open to others.
[[nodiscard]] std::string segment_folder();

/// Path of the socket of controller `name`, which is 1 to 64 letters, digits, '.', '_' or '-' and
/// does not start with a dot. Throws `SegmentError` for any other name.
[[nodiscard]] std::string segment_socket(std::string_view name);

/// The connection of a reader to a controller. One thread.
class SegmentConnection {
 public:
  SegmentConnection(int socket, SegmentReader reader) noexcept;  ///< takes ownership of `socket`
  SegmentConnection(SegmentConnection&& other) noexcept;
  SegmentConnection& operator=(SegmentConnection&& other) noexcept;
  ~SegmentConnection();

  [[nodiscard]] const SegmentReader& reader() const noexcept { return reader_; }

  /// False once the controller has gone; the segment stays readable. Never waits.
  [[nodiscard]] bool alive() const noexcept;

  /// Waits at most 2 s for the reply of the server's thread (not of the servo). Throws
  /// `SegmentError` if the controller has gone or does not reply. After that, the next call waits
  /// for the late reply first, again at most 2 s, and throws without sending if none comes.
  Reply send(const SegmentCommand& command);

 private:
  /// Receives the oldest reply that has not come.
  Reply receive();

  int socket_ = -1;
  int awaited_ = 0;  ///< replies that have not come: each command has one, in order
  SegmentReader reader_;
};

/// Connects to controller `name` and maps its segment. Throws `SegmentAbsent` if no such controller
/// runs (the message names those that do), `SegmentError` on any other failure.
[[nodiscard]] SegmentConnection connect_segment(std::string_view name);

/// First message of the server, which passes the memfd with it. Then the client sends
/// `SegmentCommand`s, and the server replies to each with one `Reply`.
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

/// Lock on a controller's name: the file `NAME.lock` beside the socket. The kernel releases it when
/// the process ends, even by SIGKILL.
class NameLock {
 public:
  /// Throws `SegmentError` if a live process holds the name.
  explicit NameLock(std::string_view name);
  ~NameLock();
  NameLock(const NameLock&) = delete;
  NameLock& operator=(const NameLock&) = delete;

 private:
  std::string path_;
  OwnedFd file_;
};

}  // namespace kerf
