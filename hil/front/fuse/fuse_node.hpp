// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include <sys/types.h>

namespace kerf {

using FuseOpen = std::uint64_t;     ///< names one open of a node, never used twice
using FuseRequest = std::uint64_t;  ///< names a call of a client until it is answered

/// The answer to a call: an errno, or bytes and a result of 0 and above.
struct FuseReply {
  int error = 0;            ///< 0 or a positive errno; the rest is ignored then
  std::int32_t result = 0;  ///< of ioctl()
  std::span<const std::uint8_t> bytes{};

  static FuseReply fail(int error) noexcept { return {.error = error}; }
};

/// One ioctl() of a client as it came: nothing in it can be trusted.
struct FuseIoctl {
  FuseRequest request = 0;
  pid_t thread = 0;            ///< of the caller, whose memory pointers point into
  std::uint32_t command = 0;   ///< the whole number: direction, size, type, nr (linux/ioctl.h)
  std::uint64_t argument = 0;  ///< as passed: a user address, or a plain number
  std::span<const std::uint8_t> input{};  ///< bytes that `command` says go in
  std::size_t output_bytes = 0;           ///< room that `command` says comes back
};

/// The way for a node to answer calls that it left open, and to wake clients that sleep in poll().
class FuseReplies {
 public:
  virtual ~FuseReplies() = default;
  virtual void answer(FuseRequest request, const FuseReply& answer) noexcept = 0;
  virtual void wake_pollers(FuseOpen open) noexcept = 0;
};

/// A device node as its clients see it: the file operations of one character device.
///
/// `FuseMount` calls, on one thread. A call that returns nothing is parked: the client sleeps until
/// the node answers through `FuseReplies`, at the latest when it is `interrupted`. Bytes of an
/// answer stay valid until the next call.
class FuseNode {
 public:
  virtual ~FuseNode() = default;

  /// Before the first call.
  void attach(FuseReplies& replies) noexcept { replies_ = &replies; }
  /// If false, the name is not there and cannot be opened.
  [[nodiscard]] virtual bool present() const noexcept = 0;

  /// Returns true if lseek() works; else it fails with ESPIPE, as on most devices.
  [[nodiscard]] virtual bool seekable() const noexcept { return false; }

  virtual void open(FuseOpen open) = 0;
  virtual void release(FuseOpen open) = 0;
  /// `offset` grows from read to read if the node is seekable, else it is 0.
  virtual std::optional<FuseReply> read(FuseOpen open, FuseRequest request, std::uint64_t offset,
                                        std::size_t size) = 0;
  virtual std::optional<FuseReply> write(FuseOpen /*open*/, FuseRequest /*request*/,
                                         std::span<const std::uint8_t> /*bytes*/) {
    return FuseReply::fail(EINVAL);  // the kernel's own node has no write()
  }
  virtual std::optional<FuseReply> ioctl(FuseOpen open, const FuseIoctl& call) = 0;
  /// POLLIN and others that hold now. `sleeps`: the caller waits for a change.
  virtual std::uint32_t poll(FuseOpen open, bool sleeps) = 0;
  /// A signal met the client of a parked call: answer it now, with EINTR.
  virtual void interrupted(FuseRequest /*request*/) {}

  /// The time at which `wake` is due without a call, CLOCK_MONOTONIC ns; INT64_MAX for never.
  [[nodiscard]] virtual std::int64_t next_wake_ns() const noexcept = 0;
  virtual void wake() = 0;

 protected:
  FuseReplies* replies_ = nullptr;
};

}  // namespace kerf
