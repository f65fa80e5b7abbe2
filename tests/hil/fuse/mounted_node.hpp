// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>

#include "hil/emulator.hpp"
#include "hil/front/firewire/firewire_node.hpp"
#include "hil/front/fuse/fuse_mount.hpp"

namespace kerf::test {

/// A folder of its own, removed at the end.
class TempFolder {
 public:
  TempFolder() : path_((std::filesystem::temp_directory_path() / "kerf-fuse-XXXXXX").string()) {
    if (!mkdtemp(path_.data())) throw std::runtime_error(path_ + " cannot be made");
  }
  ~TempFolder() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }
  TempFolder(const TempFolder&) = delete;
  TempFolder& operator=(const TempFolder&) = delete;
  [[nodiscard]] const std::string& path() const noexcept { return path_; }

 private:
  std::string path_;
};

/// The node `fw1` of an emulated Omni, served by a thread while this lives.
class MountedNode {
 public:
  explicit MountedNode(const FirewireSettings& settings = {}, const OmniParams& params = {},
                       const std::optional<HandScript>& hand = {})
      : emulator_(params, hand), node_(settings, emulator_), mount_(folder_.path()) {
    mount_.add("fw1", node_);
    thread_ = std::thread([this] { mount_.serve([this] { return !stop_; }); });
  }
  ~MountedNode() { stop(); }

  /// Ends the server; what it has seen may be read from then on.
  void stop() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
  }
  [[nodiscard]] const std::string& folder() const noexcept { return folder_.path(); }
  [[nodiscard]] std::string path() const { return folder_.path() + "/fw1"; }
  [[nodiscard]] const FirewireNode& node() const noexcept { return node_; }
  [[nodiscard]] const Emulator& emulator() const noexcept { return emulator_; }
  [[nodiscard]] const FuseMount& mount() const noexcept { return mount_; }

 private:
  TempFolder folder_;
  Emulator emulator_;
  FirewireNode node_;
  FuseMount mount_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace kerf::test
