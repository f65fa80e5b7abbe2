// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <mutex>
#include <string>
#include <thread>

#include "lab/bridge/milled_volume.hpp"
#include "shared/numeric/histogram.hpp"
#include "shared/segment/reader.hpp"

namespace kerf::two_machines {

/// A reader of the far segment that looks every 2 ms for the newest state that is one tick's. Its
/// age is counted from when the near segment had that tick: both are in this process, so no clock
/// has to be trusted.
class FarViewer {
 public:
  /// Looks for the segment `name` until it is there.
  FarViewer(std::string name, const MilledVolume& source);
  ~FarViewer();
  FarViewer(const FarViewer&) = delete;
  FarViewer& operator=(const FarViewer&) = delete;

  /// Waits for a consistent state of the source; false: there was none by then.
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
