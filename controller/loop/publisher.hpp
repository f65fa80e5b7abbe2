// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "controller/load/loaded_scene.hpp"
#include "controller/servo/servo.hpp"
#include "controller/tick/tick_record.hpp"
#include "shared/numeric/fnv1a.hpp"
#include "shared/segment/layout.hpp"
#include "shared/segment/segment.hpp"
#include "shared/segment/writer.hpp"

namespace kerf {

/// Times and losses of a tick, which the loop knows and the servo step must not.
struct TickTiming {
  std::int64_t start_ns = 0;      ///< as TickSource has it
  std::int64_t heartbeat_ns = 0;  ///< CLOCK_MONOTONIC, in lock-step too
  std::int64_t late_ns = 0;
  std::int64_t compute_ns = 0;  ///< 0 in lock-step
  std::uint64_t missed_deadlines = 0;
  std::array<std::uint64_t, kMaxArms> lost_packets{};
  std::array<std::uint64_t, kMaxArms> refused_packets{};
};

/// The segment of this scene. Points into the scene: call it before `take`.
[[nodiscard]] SegmentSpec segment_spec(const LoadedScene& scene, const std::string& json,
                                       std::uint64_t hash);

/// Publishes each tick to the readers of the segment, after the device has its command.
///
/// Servo thread only; wait-free, no system call, no allocation.
class Publisher {
 public:
  Publisher(SegmentWriter& segment, const AnyServo& servo) noexcept
      : segment_(segment), servo_(servo) {}

  /// `reports` and `outputs` by arm.
  void publish(Tick tick, std::span<const DeviceReport> reports, const TickCommands& commands,
               std::span<const ServoOutput> outputs, const TickTiming& timing) noexcept;
  /// The record of an arm that was published last.
  [[nodiscard]] const TickRecord& record(std::size_t arm) const noexcept { return records_[arm]; }

 private:
  SegmentWriter& segment_;
  const AnyServo& servo_;
  std::array<TickRecord, kMaxArms> records_{};
  bool held_ = false;                         ///< as published
  std::uint64_t removal_hash_ = kFnv1aBasis;  ///< chain over the changed boxes
};

}  // namespace kerf
