// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "hil/front/fuse/fuse_channel.hpp"
#include "hil/front/fuse/fuse_node.hpp"
#include "shared/numeric/statistics.hpp"

namespace kerf {

/// A folder whose files are device nodes: open, read, write, ioctl and poll reach a `FuseNode`.
///
/// One thread, which must never touch its own folder. A nonsensical call gets an
/// errno.
class FuseMount final : public FuseReplies {
 public:
  /// Throws `HilError` if /dev/fuse or the right to mount is missing, or `folder` is no folder.
  explicit FuseMount(std::string folder) : channel_(std::move(folder)) {}

  /// Before `serve`. The node outlives the mount. `file` is the number of this name for the node.
  void add(std::string name, FuseNode& node, int file = 0);

  /// Serves while `goes_on`, which is called between requests and at least every 100 ms, or until
  /// another process unmounts.
  void serve(const std::function<bool()>& goes_on);

  void answer(FuseRequest request, const FuseReply& answer) noexcept override;
  void wake_pollers(FileHandle open) noexcept override;

  /// Lateness of the calls of `FuseNode::wake`.
  [[nodiscard]] const Histogram& lateness() const noexcept { return lateness_; }
  [[nodiscard]] std::uint64_t requests() const noexcept { return requests_; }

 private:
  struct Named {
    std::string name;
    FuseNode* node;
    int file;
  };
  enum class Kind : std::uint8_t { read, write, ioctl };
  struct Parked {
    Kind kind;
    FuseNode* node;
  };

  bool wait(const std::function<bool()>& goes_on);
  void serve_one();
  void dispatch(const FuseMessage& request);
  void look_up(const FuseMessage& request) noexcept;
  void list(const FuseMessage& request);
  void open(const FuseMessage& request);
  void release(const FuseMessage& request);
  void read(const FuseMessage& request);
  void write(const FuseMessage& request);
  void ioctl(const FuseMessage& request);
  void poll(const FuseMessage& request);
  void interrupt(const FuseMessage& request);

  /// Answers now, or keeps the request until `answer`.
  void reply_or_defer(const FuseMessage& request, Kind kind, FuseNode& node,
                      const std::optional<FuseReply>& answer);
  void respond(FuseRequest id, Kind kind, const FuseReply& answer) noexcept;
  [[nodiscard]] FuseNode* node_of(FileHandle open) const noexcept;

  FuseChannel channel_;
  std::vector<Named> nodes_;
  FileHandle last_open_ = 0;
  std::map<FileHandle, FuseNode*> opens_;
  std::map<FileHandle, std::uint64_t>
      pollers_;  ///< the kernel's name of an open that sleeps in poll()
  std::map<FuseRequest, Parked> parked_;
  std::uint64_t requests_ = 0;
  Histogram lateness_;
};

}  // namespace kerf
