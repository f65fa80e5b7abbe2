// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "lab/bridge/link.hpp"
#include "lab/sweep/child.hpp"

namespace kerf::two_machines {

/// This machine forbids network namespaces or TUN devices: one line with the reason.
struct NoNamespaces : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A file descriptor of the system, closed with its owner.
class File {
 public:
  explicit File(int fd = -1) noexcept : fd_(fd) {}
  File(File&& other) noexcept;
  File& operator=(File&& other) noexcept;
  ~File();
  [[nodiscard]] int get() const noexcept { return fd_; }

 private:
  int fd_;
};

/// Exit code where this machine forbids networks of one's own, as ctest knows it.
inline constexpr int kSkipped = 77;

/// Two networks of their own, as two machines have them, and a link between. The link forwards
/// packets, so TCP sees losses, delays and rates as from a real one. Everything else (processor,
/// memory, files, clocks) is this machine's. Goes with its owner.
class TwoNetworks {
 public:
  static constexpr const char* kNearAddress = "10.77.0.1";
  static constexpr const char* kFarAddress = "10.77.0.2";
  enum class Side { near, far };

  /// To be made before the process has a second thread. Throws `NoNamespaces`.
  explicit TwoNetworks(const LinkSettings& settings);
  ~TwoNetworks();
  TwoNetworks(const TwoNetworks&) = delete;
  TwoNetworks& operator=(const TwoNetworks&) = delete;

  /// Starts a program on one of the machines.
  [[nodiscard]] std::unique_ptr<sweep::Child> start(Side side,
                                                    const std::vector<std::string>& arguments,
                                                    const std::filesystem::path& output) const;

  /// Pulls the cable, and puts it back.
  void set_cut(bool cut) noexcept { cut_ = cut; }
  /// `ip link set link0 up` or `down` on one of the machines: down, it has no way to the other.
  void set_interface(Side side, bool up) const;
  /// Payload and headers that came out at the far end so far.
  [[nodiscard]] std::uint64_t bytes_to_far() const noexcept { return bytes_to_far_; }

 private:
  struct Machine {
    File network;  // its namespace
    File device;   // what the kernel routes there comes out here
  };
  [[nodiscard]] Machine make(const char* address) const;
  void relay();

  LinkSettings settings_;
  File home_;  // where this process belongs
  Machine near_, far_;
  File stop_;
  std::atomic<bool> cut_{false};
  std::atomic<std::uint64_t> bytes_to_far_{0};
  std::thread relay_;
};

/// Once, before the first `TwoNetworks` and a second thread: the right to make namespaces, where
/// this user has it only in a user namespace of its own. Throws `NoNamespaces`.
void enter_user_namespace();

}  // namespace kerf::two_machines
