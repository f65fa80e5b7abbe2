// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "controller/servo/servo.hpp"
#include "shared/numeric/fnv1a.hpp"
#include "shared/segment/layout.hpp"
#include "shared/segment/writer.hpp"

namespace kerf {

/// Times and losses of a tick, which the loop knows and the servo step must not.
struct TickTiming {
  std::int64_t start_ns = 0;      ///< as TickSource has it
  std::int64_t heartbeat_ns = 0;  ///< CLOCK_MONOTONIC, in lock-step too
  std::int64_t late_ns = 0;
  std::int64_t compute_ns = 0;  ///< 0 in lock-step
  std::uint64_t missed_deadlines = 0;
  std::uint64_t lost_packets = 0;
  std::uint64_t refused_packets = 0;
};

/// Publishes each tick to the readers of the segment, after the device has its command.
///
/// Servo thread only; wait-free, no system call, no allocation.
class Publisher {
 public:
  Publisher(SegmentWriter& segment, const Servo& servo) noexcept
      : segment_(segment), servo_(servo) {}

  void publish(Tick tick, const DeviceReport& report, const ServoOutput& output,
               std::uint32_t last_command, const TickTiming& timing) noexcept;

 private:
  void publish_volumes(const ServoOutput& output, TickRecord& record) noexcept;

  SegmentWriter& segment_;
  const Servo& servo_;
  bool held_ = false;                         ///< as published
  std::uint64_t removal_hash_ = kFnv1aBasis;  ///< chain over the changed boxes
};

}  // namespace kerf
