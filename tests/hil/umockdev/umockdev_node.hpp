// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <future>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <umockdev.h>

#include "hil/front/fuse/fuse_node.hpp"

namespace kerf::test {

/// The emulated device node that FUSE serves, where nothing can be mounted: libumockdev-preload
/// brings this process's ioctls on a path to `node`.
///
/// poll() does not come here: to it the path is a plain file, and always ready. So an ioctl that
/// finds nothing waits here for the next frame of the bus, 1 ms, before it returns EAGAIN. Other
/// calls on the same descriptor wait behind it, which suits libusb on one thread; a program that
/// reads on one thread and writes on another would starve the latter.
///
/// Everything runs on the test bed's thread, so this has to end before the bed.
class UmockdevNode final : private FuseReplies {
 public:
  /// `path` is one of the bed's own, as "/dev/bus/usb/001/002". Throws std::runtime_error.
  UmockdevNode(UMockdevTestbed* bed, const std::string& path, FuseNode& node);
  ~UmockdevNode() override;
  UmockdevNode(const UmockdevNode&) = delete;
  UmockdevNode& operator=(const UmockdevNode&) = delete;

 private:
  void begin();
  void take(UMockdevIoctlClient* client);
  void close(UMockdevIoctlClient* client);
  void frame();
  void stop();
  [[nodiscard]] FuseReply ask(UMockdevIoctlClient* client);

  // Nothing parks an ioctl for longer than a frame, and nobody sleeps in poll().
  void answer(FuseRequest /*request*/, const FuseReply& /*answer*/) noexcept override {}
  void wake_pollers(FuseOpen /*open*/) noexcept override {}

  FuseNode& node_;
  UMockdevIoctlBase* base_ = umockdev_ioctl_base_new();
  GSource* frames_ = nullptr;
  std::promise<void> stopped_;
  std::map<UMockdevIoctlClient*, FuseOpen> opens_;
  std::vector<UMockdevIoctlClient*> waiting_;
  FuseOpen last_open_ = 0;
};

}  // namespace kerf::test
