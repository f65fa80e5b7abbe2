// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "hil/front/fuse/fuse_node.hpp"
#include "hil/front/lateness.hpp"

namespace kerf {

/// A folder whose files are device nodes: open, read, write, ioctl and poll reach a `FuseNode`.
///
/// Speaks the kernel's protocol on /dev/fuse itself (linux/fuse.h, version 7.31), because a node
/// needs what a file-system library hides: the caller's thread, the raw argument of an ioctl, and
/// answers that come later. One thread, which must never touch its own folder. A client that asks
/// for nonsense gets an errno. The folder is unmounted at the end.
class FuseMount final : public FuseReplies {
 public:
  /// Throws `HilError` when /dev/fuse or the right to mount is missing, or `folder` is no folder.
  explicit FuseMount(std::string folder);
  ~FuseMount() override;
  FuseMount(const FuseMount&) = delete;
  FuseMount& operator=(const FuseMount&) = delete;

  /// Before `serve`. The node outlives the mount.
  void add(std::string name, FuseNode& node);

  /// Serves while `goes_on`, which is asked between requests and at least every 100 ms, or until
  /// somebody else unmounts.
  void serve(const std::function<bool()>& goes_on);

  void answer(FuseRequest request, const FuseAnswer& answer) noexcept override;
  void wake_pollers(FuseOpen open) noexcept override;

  /// How late `FuseNode::wake` was called.
  [[nodiscard]] const Lateness& lateness() const noexcept { return lateness_; }
  [[nodiscard]] std::uint64_t requests() const noexcept { return requests_; }

 private:
  struct Named {
    std::string name;
    FuseNode* node;
  };
  struct Request;
  enum class Kind : std::uint8_t { read, write, ioctl };
  struct Parked {
    Kind kind;
    FuseNode* node;
  };

  bool wait(const std::function<bool()>& goes_on);
  void serve_one();
  void dispatch(const Request& request);
  void look_up(const Request& request) noexcept;
  void list(const Request& request);
  void open(const Request& request);
  void release(const Request& request);
  void read(const Request& request);
  void write(const Request& request);
  void ioctl(const Request& request);
  void poll(const Request& request);
  void interrupt(const Request& request);

  /// Answers now, or keeps the request until `answer`.
  void settle(const Request& request, Kind kind, FuseNode& node,
              const std::optional<FuseAnswer>& answer);
  void respond(FuseRequest id, Kind kind, const FuseAnswer& answer) noexcept;
  void reply(FuseRequest id, int error, std::span<const std::uint8_t> head = {},
             std::span<const std::uint8_t> rest = {}) noexcept;
  template <class Body>
  void reply_with(FuseRequest id, const Body& body,
                  std::span<const std::uint8_t> rest = {}) noexcept;
  [[nodiscard]] FuseNode* node_of(FuseOpen open) const noexcept;

  static constexpr std::size_t kMaxWrite = 32768;

  std::string folder_;
  int fd_ = -1;
  bool gone_ = false;
  std::vector<Named> nodes_;
  FuseOpen last_open_ = 0;
  std::map<FuseOpen, FuseNode*> opens_;
  std::map<FuseOpen, std::uint64_t> pollers_;  ///< who sleeps in poll(), by the kernel's name
  std::map<FuseRequest, Parked> parked_;
  std::uint64_t requests_ = 0;
  Lateness lateness_;
  std::array<std::uint8_t, kMaxWrite + 4096> buffer_{};
};

}  // namespace kerf
