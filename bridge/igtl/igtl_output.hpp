// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "shared/segment/command.hpp"

namespace kerf::bridge {

/// The settings of the OpenIGTLink server.
struct IgtlOptions {
  std::string host = "127.0.0.1";   ///< address of this machine to listen on
  std::uint16_t port = 18944;       ///< 0: one that is free
  std::string name = kDefaultName;  ///< of the controller
  /// A client that receives nothing for this long is dropped.
  std::chrono::milliseconds patience{5000};
};

/// OpenIGTLink for 3D Slicer, send only. While an object of this class exists, a thread follows a
/// controller's segment and sends to each client
///
/// * each volume as IMAGE under its name, whole first, then the box of what changed, at most 20 Hz;
/// * its labels, if it has any, as IMAGE "NAME labels" of 8 bits, once: they never change;
/// * the tool's pose as TRANSFORM "Tool" and the force as SENSOR "Force" in newtons, at 60 Hz; of a
///   second arm "Tool 2" and "Force 2", of the same tick.
///
/// All of it is in RAS. kerf's world counts as LPS, the axes in which medical files are loaded, so
/// x and y change their signs. A slow client gets fewer and larger boxes, and does not delay
/// others: at most one image waits for it. Messages of clients are discarded. Controllers may end
/// and start again; then the volumes are sent whole. There is no token and no encryption.
class IgtlOutput {
 public:
  static constexpr std::size_t kMaxClients = 8;  ///< further connections are closed at once

  /// Throws std::runtime_error, one line, if it cannot listen or was built without OpenIGTLink.
  explicit IgtlOutput(const IgtlOptions& options);
  ~IgtlOutput();
  IgtlOutput(const IgtlOutput&) = delete;
  IgtlOutput& operator=(const IgtlOutput&) = delete;

  [[nodiscard]] std::uint16_t port() const noexcept;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace kerf::bridge
