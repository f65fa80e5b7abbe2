// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string>

#include <linux/fuse.h>
#include <sys/types.h>

/// The kernel's side of a FUSE folder: its messages, and the memory of the process that calls.
namespace kerf {

/// One message of the kernel; the body stays valid until the next one is received.
struct FuseMessage {
  fuse_in_header header{};
  std::span<const std::uint8_t> body;

  [[nodiscard]] std::uint64_t id() const noexcept { return header.unique; }
};

/// `T` from the first bytes of a body; empty if there are too few.
template <class T>
[[nodiscard]] std::optional<T> fuse_body(std::span<const std::uint8_t> bytes) noexcept {
  T value{};
  if (bytes.size() < sizeof value) return std::nullopt;
  std::memcpy(&value, bytes.data(), sizeof value);
  return value;
}

template <class T>
[[nodiscard]] std::span<const std::uint8_t> fuse_bytes(const T& value) noexcept {
  return {reinterpret_cast<const std::uint8_t*>(&value), sizeof value};
}

/// A mounted folder and the messages about it: linux/fuse.h on /dev/fuse itself.
///
/// Not through a file-system library, because one hides things that device nodes need: the caller's
/// thread, the raw argument of an ioctl, and answers that come later. The folder is unmounted at
/// the end; clients that are still inside get ENOTCONN.
class FuseChannel {
 public:
  static constexpr std::size_t kMaxWrite = 32768;  ///< bytes of one write(), announced in INIT

  /// Throws `HilError` when /dev/fuse or the right to mount is missing, or `folder` is no folder.
  explicit FuseChannel(std::string folder);
  ~FuseChannel();
  FuseChannel(const FuseChannel&) = delete;
  FuseChannel& operator=(const FuseChannel&) = delete;

  /// Returns true if a message is there within the time.
  [[nodiscard]] bool wait(std::int64_t ns) const noexcept;
  /// Empty if none is there, or the folder was unmounted: `gone`.
  [[nodiscard]] std::optional<FuseMessage> receive() noexcept;
  [[nodiscard]] bool gone() const noexcept { return gone_; }

  /// `error` is a positive errno; otherwise the answer is `head` and then `rest`.
  void reply(std::uint64_t id, int error, std::span<const std::uint8_t> head = {},
             std::span<const std::uint8_t> rest = {}) noexcept;
  template <class Body>
  void reply_with(std::uint64_t id, const Body& body,
                  std::span<const std::uint8_t> rest = {}) noexcept {
    reply(id, 0, fuse_bytes(body), rest);
  }
  /// An unsolicited message; `code` is one of fuse_notify_code.
  void notify(int code, std::span<const std::uint8_t> body) noexcept { reply(0, -code, body); }

 private:
  std::string folder_;
  int fd_ = -1;
  bool gone_ = false;
  std::array<std::uint8_t, kMaxWrite + 4096> buffer_{};
};

// Memory of the process whose thread called, for pointers inside an ioctl's structure. Needs the
// right to trace that process: the same user, or root. Any address is allowed; a copy ends at an
// address that is not mapped.

/// Copies from `address` on and returns the number of bytes that could be read.
[[nodiscard]] std::size_t read_caller(pid_t thread, std::uint64_t address,
                                      std::span<std::uint8_t> out) noexcept;

/// Returns false if not all bytes could be written.
[[nodiscard]] bool write_caller(pid_t thread, std::uint64_t address,
                                std::span<const std::uint8_t> bytes) noexcept;

}  // namespace kerf
