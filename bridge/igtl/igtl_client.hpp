// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

#include "bridge/igtl/igtl_messages.hpp"
#include "shared/volume/voxel_grid.hpp"

namespace kerf::bridge {

/// One client: its socket, what waits for it, and what it does not have yet. Never blocks.
///
/// At most one image waits, and as many messages of other kinds as the caller adds while none of
/// those waits, so its memory is bounded by the largest volume.
class IgtlClient {
 public:
  enum class Kind : std::uint8_t { image, pose };

  /// Takes over `socket`, which does not block.
  explicit IgtlClient(int socket) noexcept : socket_(socket) {}
  ~IgtlClient();
  IgtlClient(const IgtlClient&) = delete;
  IgtlClient& operator=(const IgtlClient&) = delete;

  [[nodiscard]] int socket() const noexcept { return socket_; }
  [[nodiscard]] bool waits() const noexcept { return !queue_.empty(); }
  /// A message of this kind waits, or is being sent.
  [[nodiscard]] bool waits(Kind kind) const noexcept;
  void add(IgtlBytes message, Kind kind);

  /// Sends what the socket takes, and throws away what came. False where the client has gone, or
  /// has taken nothing for `patience` while something waited.
  [[nodiscard]] bool serve(std::chrono::milliseconds patience);

  std::vector<VoxelBox> lacks;     ///< by volume; the caller's
  std::vector<bool> lacks_labels;  ///< by volume; the caller's

 private:
  struct Waiting {
    IgtlBytes message;
    Kind kind;
  };
  using Clock = std::chrono::steady_clock;

  [[nodiscard]] bool throw_away() const;
  [[nodiscard]] bool send_some();

  int socket_;
  std::deque<Waiting> queue_;
  std::size_t sent_ = 0;  ///< of the first message
  Clock::time_point last_progress_ = Clock::now();
};

}  // namespace kerf::bridge
