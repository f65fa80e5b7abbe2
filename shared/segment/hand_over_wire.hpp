// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace kerf {

/// First message of the server, with the memfd beside it. The rest of the talk is `Command` up and
/// `Reply` down, one message each.
struct Hello {
  std::uint64_t magic = 0;
  std::uint32_t layout_major = 0;
  std::uint32_t layout_minor = 0;
  std::uint64_t abi_hash = 0;
  std::uint64_t session_id = 0;
};
static_assert(sizeof(Hello) == 32);

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

}  // namespace kerf
