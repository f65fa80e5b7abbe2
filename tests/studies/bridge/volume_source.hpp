// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "shared/numeric/statistics.hpp"
#include "shared/segment/reader.hpp"
#include "shared/segment/server.hpp"
#include "shared/segment/writer.hpp"

/// A milled volume without a controller, and a reader of its copy on the far machine.
namespace kerf::two_machines {

/// Changes of the volume: `slow` 24 bricks 60 times a second, one of them new, as under a tool that
/// moves slowly; `sweep` 180 new ones, a fast sweep through 2000 bricks.
enum class Load { slow, sweep };

/// A controller's segment without a controller: a noisy ball of 32 x 32 bricks a layer that is
/// milled at 60 Hz, with a tick record every millisecond. The load of a bridge, the same in every
/// run.
class MilledVolume {
 public:
  /// `layers` of 1024 bricks. The segment has the name from here on.
  MilledVolume(const std::string& name, Load load, std::int32_t layers);
  ~MilledVolume();
  MilledVolume(const MilledVolume&) = delete;
  MilledVolume& operator=(const MilledVolume&) = delete;

  /// CLOCK_MONOTONIC time at which tick `tick` was published, to a millisecond.
  [[nodiscard]] std::int64_t time_of(Tick tick) const noexcept {
    return start_ns_ + static_cast<std::int64_t>(tick) * kTickNs;
  }

  /// Stops cutting; readers that have caught up then have the volume of `density_hash()`.
  void hold_still();
  void go_on();
  [[nodiscard]] std::uint64_t density_hash() const;
  [[nodiscard]] std::uint64_t session_id() const noexcept { return writer_.session_id(); }

  /// Times of publishing one tick, since the last call.
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
  std::uint64_t head_ = 0;  // position of the tool on its path through the bricks
  std::atomic<bool> stop_{false}, still_{false}, is_still_{false}, take_times_{false};
  Histogram times_, taken_times_;
  std::thread servo_;
};

/// A reader of the far segment that polls every 2 ms for the newest state of one tick. The age of
/// that state is the time since the near segment had its tick; both are in this process, so one
/// clock serves.
class FarViewer {
 public:
  /// Waits for the segment `name` until it is there.
  FarViewer(std::string name, const MilledVolume& source);
  ~FarViewer();
  FarViewer(const FarViewer&) = delete;
  FarViewer& operator=(const FarViewer&) = delete;

  /// Waits for a consistent state of the source; returns false if there was none by then.
  [[nodiscard]] bool joins_within(std::chrono::milliseconds patience) const;
  /// Waits until the volume has this content, and no reader could take another for consistent.
  [[nodiscard]] bool equals_within(std::uint64_t density_hash,
                                   std::chrono::milliseconds patience) const;

  /// Ages from now on; `take_ages` ends the count.
  void begin_ages();
  [[nodiscard]] Histogram take_ages();

 private:
  void run();

  std::string name_;
  const MilledVolume& source_;
  mutable std::mutex mutex_;  // all below
  VolumeSnapshot snapshot_;
  Tick newest_ = 0;
  bool seen_ = false, counts_ = false;
  Histogram ages_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace kerf::two_machines
