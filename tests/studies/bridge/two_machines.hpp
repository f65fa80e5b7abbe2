// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <memory>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "lab/run/child_process.hpp"

/// Two emulated machines: network namespaces, an impaired link between them, and a bridge over it.
namespace kerf::two_machines {

/// The behaviour of a link, the same for each direction.
struct LinkSettings {
  double loss = 0;         ///< fraction of packets, at random
  double delay_ms = 0;     ///< of each direction
  double mbit = 0;         ///< 10^6 bit/s; 0: no bound
  std::uint64_t seed = 1;  ///< the same losses for the same packets
};

/// One direction of a link, in its caller's time. It loses packets, sends the others one after
/// another at its rate from a queue of 100 ms, which drops the excess, and then delays them.
class Link {
 public:
  using Packet = std::vector<std::byte>;
  static constexpr std::int64_t kQueueNs = 100'000'000;

  Link(const LinkSettings& settings, std::uint64_t direction)
      : settings_(settings), random_(settings.seed * 2 + direction) {}

  /// Takes a packet; returns false if it is lost.
  bool offer(std::int64_t now_ns, Packet packet) {
    const bool lucky = uniform_(random_) >= settings_.loss;
    const std::int64_t start_ns = std::max(now_ns, line_free_ns_);
    if (!lucky || start_ns - now_ns > kQueueNs) return false;
    const double bits = 8.0 * static_cast<double>(packet.size());
    line_free_ns_ =
        start_ns +
        (settings_.mbit > 0 ? static_cast<std::int64_t>(bits * 1e3 / settings_.mbit) : 0);
    const auto delay_ns = static_cast<std::int64_t>(settings_.delay_ms * 1e6);
    queue_.push_back({line_free_ns_ + delay_ns, std::move(packet)});
    return true;
  }

  /// The time at which the next packet arrives; empty if none is in flight.
  [[nodiscard]] std::optional<std::int64_t> next_ns() const {
    if (queue_.empty()) return std::nullopt;
    return queue_.front().due_ns;
  }

  /// The next packet that has arrived by `now_ns`.
  [[nodiscard]] std::optional<Packet> take(std::int64_t now_ns) {
    if (queue_.empty() || queue_.front().due_ns > now_ns) return std::nullopt;
    Packet out = std::move(queue_.front().packet);
    queue_.pop_front();
    return out;
  }

 private:
  struct Queued {
    std::int64_t due_ns;
    Packet packet;
  };
  LinkSettings settings_;
  std::mt19937_64 random_;
  std::uniform_real_distribution<double> uniform_;
  std::deque<Queued> queue_;
  std::int64_t line_free_ns_ = 0;
};

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

/// Exit code if this machine forbids network namespaces, as ctest knows it.
inline constexpr int kSkipped = 77;

/// Two separate networks, like those of two machines, and a link between them. The link forwards
/// packets, so TCP sees losses, delays and rates as on a real one. Everything else (processor,
/// memory, files, clocks) is this machine's. The destructor removes it.
class TwoNetworks {
 public:
  static constexpr const char* kNearAddress = "10.77.0.1";
  static constexpr const char* kFarAddress = "10.77.0.2";
  enum class Side { near, far };

  /// Construct it before the process has a second thread. Throws `NoNamespaces`.
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
    File device;   // packets that the kernel routes there come out here
  };
  [[nodiscard]] Machine make(const char* address) const;
  void relay();

  LinkSettings settings_;
  File home_;  // network of this process
  Machine near_, far_;
  File stop_;
  std::atomic<bool> cut_{false};
  std::atomic<std::uint64_t> bytes_to_far_{0};
  std::thread relay_;
};

/// Gets the right to make namespaces, if this user has it only in a user namespace of its own. Call
/// it once, before the first `TwoNetworks` and a second thread. Throws `NoNamespaces`.
void enter_user_namespace();

/// Sleeps; throws `HilError` if a signal asks for the end, so that all that was started ends.
void pause(std::chrono::nanoseconds time);

/// A folder of this process alone, with the sockets of segments in it; goes with its owner.
class WorkFolder {
 public:
  WorkFolder();
  [[nodiscard]] const std::filesystem::path& path() const { return folder_.path(); }

 private:
  sweep::PrivateFolder folder_;
};

/// What the bridges of a measurement need: a certificate, made with openssl, and a token.
struct BridgeFiles {
  explicit BridgeFiles(std::filesystem::path folder);  ///< throws `HilError`
  std::filesystem::path folder, program, certificate, key, token_file;
  std::string token;
};

/// A `kerf-bridge serve` on the near machine and any number of `join` on the far one.
class BridgePair {
 public:
  static constexpr const char* kNearName = "near";

  /// Serves the segment `kNearName`, which may come later.
  BridgePair(const TwoNetworks& networks, const BridgeFiles& files, bool dedicated_link);

  void start_serve();
  /// Throws `HilError` with its last line if it has ended by itself.
  void require_serve();
  /// Kills it if it lives, as by SIGKILL.
  void kill_serve();
  [[nodiscard]] sweep::Child& serve() { return *serve_; }
  /// A viewer that makes the segment `name`; goes with its owner.
  [[nodiscard]] std::unique_ptr<sweep::Child> join(const std::string& name) const;

 private:
  const TwoNetworks& networks_;
  const BridgeFiles& files_;
  bool dedicated_link_;
  std::unique_ptr<sweep::Child> serve_;
};

/// Cost of a process: seconds of processor time so far, and MiB of private memory (without the
/// mapped segment).
struct ProcessCost {
  double cpu_s = 0;
  double own_mib = 0;
};
[[nodiscard]] ProcessCost cost_of(const sweep::Child& process);

}  // namespace kerf::two_machines
