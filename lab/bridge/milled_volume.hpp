// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "shared/numeric/histogram.hpp"
#include "shared/segment/hand_over.hpp"
#include "shared/segment/writer.hpp"

namespace kerf::two_machines {

/// How much changes: `slow` 24 bricks 60 times a second, one of them new, as under a tool that
/// moves slowly; `sweep` 180 new ones, a fast sweep through 2000 bricks.
enum class Load { slow, sweep };

/// A controller's segment without a controller: a noisy ball of 32 x 32 bricks a layer that is
/// milled at 60 Hz, with a tick record every millisecond. What a bridge has to carry, alike in
/// every run.
class MilledVolume {
 public:
  /// `layers` of 1024 bricks. The segment has the name from here on.
  MilledVolume(const std::string& name, Load load, std::int32_t layers);
  ~MilledVolume();
  MilledVolume(const MilledVolume&) = delete;
  MilledVolume& operator=(const MilledVolume&) = delete;

  /// CLOCK_MONOTONIC when tick `tick` was published, to a millisecond.
  [[nodiscard]] std::int64_t time_of(Tick tick) const noexcept {
    return start_ns_ + static_cast<std::int64_t>(tick) * kTickNs;
  }

  /// Stops cutting; what readers then have is `density_hash()` of `volume`, once they caught up.
  void hold_still();
  void go_on();
  [[nodiscard]] std::uint64_t density_hash() const;
  [[nodiscard]] std::uint64_t session_id() const noexcept { return writer_.session_id(); }

  /// What publishing one tick costs its thread, since the last call.
  [[nodiscard]] Histogram take_publish_times();

 private:
  static constexpr std::int64_t kTickNs = 1'000'000;
  [[nodiscard]] std::vector<Density> paint(double groove) const;
  void mill(Tick tick);
  void run();

  Load load_;
  VoxelGrid grid_;
  BrickGrid bricks_;
  std::vector<Density> solid_, milled_, volume_;
  SegmentWriter writer_;
  SegmentServer server_;
  std::int64_t start_ns_ = 0;
  std::uint64_t head_ = 0;  // where the tool is on its way through the bricks
  std::atomic<bool> stop_{false}, still_{false}, is_still_{false}, take_times_{false};
  Histogram times_, taken_times_;
  std::thread servo_;
};

}  // namespace kerf::two_machines
