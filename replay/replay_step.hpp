// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "controller/plan/compile.hpp"
#include "shared/numeric/fnv1a.hpp"
#include "shared/segment/layout.hpp"

// One tick of a recorded run, stepped again.

namespace kerf {

/// The records of one tick, by arm.
using ArmRecords = std::array<TickRecord, kMaxArms>;

/// The records, reports or outputs of the arms that a servo has.
template <class T>
[[nodiscard]] std::span<T> of_arms(std::array<T, kMaxArms>& all, const AnyServo& servo) noexcept {
  return std::span(all).first(servo.arms());
}
template <class T>
[[nodiscard]] std::span<const T> of_arms(const std::array<T, kMaxArms>& all,
                                         const AnyServo& servo) noexcept {
  return std::span(all).first(servo.arms());
}

/// The reports in the records of a tick, of the servo's devices.
[[nodiscard]] std::array<DeviceReport, kMaxArms> reports_of(const ArmRecords& recorded,
                                                            const AnyServo& servo) noexcept;

/// Gives the servo the commands and the reports of a recorded tick, in the loop's order; returns
/// its outputs.
[[nodiscard]] std::array<ServoOutput, kMaxArms> give(CompiledScene& servo,
                                                     const ArmRecords& recorded) noexcept;

/// Computes the ticks of a recording again, one after the other.
class ReplayStep {
 public:
  /// `volume_chain`: that of the ticks which `servo` has stepped.
  explicit ReplayStep(CompiledScene& servo, std::uint64_t volume_chain = kFnv1aBasis)
      : servo_(servo), volume_chain_(volume_chain) {}

  /// Steps the servo with the inputs in `recorded`; returns the records of the tick. Times are
  /// those of `recorded`.
  [[nodiscard]] ArmRecords operator()(const ArmRecords& recorded) noexcept;

  /// Only makes the records, after a step of the servo by `give`, which returned `outputs`.
  [[nodiscard]] ArmRecords of(const ArmRecords& recorded,
                              const std::array<ServoOutput, kMaxArms>& outputs) noexcept;

 private:
  CompiledScene& servo_;
  std::uint64_t volume_chain_;
};

}  // namespace kerf
