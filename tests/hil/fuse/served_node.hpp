// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <functional>
#include <string>
#include <thread>
#include <utility>

#include "hil/front/fuse/fuse_mount.hpp"
#include "tests/support/temporary_folder.hpp"

namespace kerf::test {

/// A node in a folder of its own, served by a thread while this lives.
template <class Node>
class ServedNode {
 public:
  /// `prepare` runs first on the server's thread; the rest makes the node.
  template <class... Arguments>
  ServedNode(const char* name, std::function<void()> prepare, Arguments&&... arguments)
      : name_(name), node_(std::forward<Arguments>(arguments)...), mount_(folder_.path()) {
    mount_.add(name_, node_);
    thread_ = std::thread([this, prepare = std::move(prepare)] {
      if (prepare) prepare();
      mount_.serve([this] { return !stop_; });
    });
  }
  ~ServedNode() { stop(); }
  ServedNode(const ServedNode&) = delete;
  ServedNode& operator=(const ServedNode&) = delete;

  /// Ends the server; its counts may be read from then on.
  void stop() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
  }
  [[nodiscard]] std::string folder() const { return folder_.path(); }
  [[nodiscard]] std::string path() const { return folder_ / name_; }
  [[nodiscard]] const Node& node() const noexcept { return node_; }
  [[nodiscard]] const FuseMount& mount() const noexcept { return mount_; }

 private:
  std::string name_;
  TemporaryFolder folder_;
  Node node_;
  FuseMount mount_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace kerf::test
