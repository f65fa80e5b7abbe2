// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "lab/bridge/two_networks.hpp"

namespace kerf::two_machines {

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

/// Of a process: seconds of processor time so far, and MiB that it has for itself alone (not what
/// it maps of a segment).
struct ProcessCost {
  double cpu_s = 0;
  double own_mib = 0;
};
[[nodiscard]] ProcessCost cost_of(const sweep::Child& process);

}  // namespace kerf::two_machines
