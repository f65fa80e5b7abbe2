// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <span>

#include <sys/types.h>

namespace kerf {

using FileHandle = std::uint64_t;   ///< names one open of a node, never used twice
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
  std::span<const std::uint8_t> input{};  ///< as many bytes as `command` passes in
  std::size_t output_bytes = 0;           ///< room for the bytes that `command` returns
};

/// The way for a node to answer calls that it left open, and to wake clients that sleep in poll().
class FuseReplies {
 public:
  virtual ~FuseReplies() = default;
  virtual void answer(FuseRequest request, const FuseReply& answer) noexcept = 0;
  virtual void wake_pollers(FileHandle open) noexcept = 0;
};

/// A device node as its clients see it: the file operations of one character device, or of several
/// that are nodes of one bus: `file` is the number that `FuseMount::add` was given with the name.
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
  [[nodiscard]] virtual bool present(int file) const noexcept = 0;

  /// Returns true if lseek() works; else it fails with ESPIPE, as on most devices.
  [[nodiscard]] virtual bool seekable() const noexcept { return false; }

  virtual void open(FileHandle open, int file) = 0;
  virtual void release(FileHandle open) = 0;
  /// `offset` grows from read to read if the node is seekable, else it is 0.
  virtual std::optional<FuseReply> read(FileHandle open, FuseRequest request, std::uint64_t offset,
                                        std::size_t size) = 0;
  virtual std::optional<FuseReply> write(FileHandle /*open*/, FuseRequest /*request*/,
                                         std::span<const std::uint8_t> /*bytes*/) {
    return FuseReply::fail(EINVAL);  // the kernel's own node has no write()
  }
  virtual std::optional<FuseReply> ioctl(FileHandle open, const FuseIoctl& call) = 0;
  /// POLLIN and others that hold now. `sleeps`: the caller waits for a change.
  virtual std::uint32_t poll(FileHandle open, bool sleeps) = 0;
  /// A signal met the client of a parked call: answer it now, with EINTR.
  virtual void interrupted(FuseRequest /*request*/) {}

  /// The time at which `wake` is due without a call, CLOCK_MONOTONIC ns; INT64_MAX for never.
  [[nodiscard]] virtual std::int64_t next_wake_ns() const noexcept = 0;
  virtual void wake() = 0;

 protected:
  FuseReplies* replies_ = nullptr;
};

/// What each open of a node keeps.
struct OpenFile {
  struct ParkedRead {
    FuseRequest request;
    std::size_t size;
  };
  std::deque<ParkedRead> parked;  ///< reads that sleep until there is something
  bool announced = false;         ///< pollers know that it is ready
};

/// A node that keeps an `Open`, derived from `OpenFile`, for each of its opens.
template <class Open>
class OpenFilesNode : public FuseNode {
 public:
  /// A client has used the device, and the node is open no more.
  [[nodiscard]] bool left() const noexcept { return used_ && opens_.empty(); }
  /// The node is open.
  [[nodiscard]] bool in_use() const noexcept { return !opens_.empty(); }
  void release(FileHandle open) override { opens_.erase(open); }
  void interrupted(FuseRequest request) override {
    for (auto& [id, open] : opens_) {
      const auto is_it = [request](const auto& parked) { return parked.request == request; };
      if (std::erase_if(open.parked, is_it) == 0) continue;
      return replies_->answer(request, FuseReply::fail(EINTR));
    }
  }

 protected:
  /// Answers the sleeping reads of an open with `take(size)` while it is `ready()`, then wakes its
  /// pollers, once until `announced` is reset.
  template <class Ready, class Take>
  void deliver_to(FileHandle id, Open& open, Ready ready, Take take) {
    while (!open.parked.empty() && ready()) {
      const OpenFile::ParkedRead parked = open.parked.front();
      open.parked.pop_front();
      replies_->answer(parked.request, take(parked.size));
    }
    if (open.announced || !ready()) return;
    open.announced = true;
    replies_->wake_pollers(id);
  }

  std::map<FileHandle, Open> opens_;
  bool used_ = false;
};

}  // namespace kerf
