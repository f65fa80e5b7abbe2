// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>

#include "hil/device/emulator.hpp"
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

  /// Ends the server; what it has seen may be read from then on.
  void stop() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
  }
  [[nodiscard]] const std::string& folder() const noexcept { return folder_.path(); }
  [[nodiscard]] std::string path() const { return folder_.path() + '/' + name_; }
  [[nodiscard]] const Node& node() const noexcept { return node_; }
  [[nodiscard]] const FuseMount& mount() const noexcept { return mount_; }

 private:
  std::string name_;
  TempFolder folder_;
  Node node_;
  FuseMount mount_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

/// A device on FireWire.
class MountedDevice : public ServedNode<FirewireNode> {
 public:
  MountedDevice(const FirewireSettings& settings, PacketDevice& device,
                std::function<void()> prepare = {})
      : ServedNode("fw1", std::move(prepare), settings, device) {}
};

/// The emulated Omni in this way.
class MountedNode {
 public:
  explicit MountedNode(const FirewireSettings& settings = {}, const OmniParams& params = {},
                       const std::optional<HandScript>& hand = {})
      : emulator_(params, hand), device_(settings, emulator_) {}

  void stop() { device_.stop(); }
  [[nodiscard]] const std::string& folder() const noexcept { return device_.folder(); }
  [[nodiscard]] std::string path() const { return device_.path(); }
  [[nodiscard]] const FirewireNode& node() const noexcept { return device_.node(); }
  [[nodiscard]] const FuseMount& mount() const noexcept { return device_.mount(); }
  [[nodiscard]] const Emulator& emulator() const noexcept { return emulator_; }

 private:
  Emulator emulator_;
  MountedDevice device_;
};

}  // namespace kerf::test
