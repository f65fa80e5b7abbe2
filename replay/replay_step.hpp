// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "controller/plan/compile.hpp"
#include "shared/numeric/fnv1a.hpp"
#include "shared/segment/layout.hpp"

// One tick of a recorded run, stepped again.

namespace kerf {

/// Gives the servo the commands and the report of a recorded tick, in the loop's order; returns its
/// output.
[[nodiscard]] ServoOutput give(CompiledScene& servo, const TickRecord& recorded) noexcept;

/// Computes the ticks of a recording again, one after the other.
class ReplayStep {
 public:
  /// `volume_chain`: that of the ticks which `servo` has stepped.
  explicit ReplayStep(CompiledScene& servo, std::uint64_t volume_chain = kFnv1aBasis)
      : servo_(servo), volume_chain_(volume_chain) {}

  /// Gives the servo what it was given in `recorded`; returns the record of the tick. Times are
  /// those of `recorded`.
  [[nodiscard]] TickRecord operator()(const TickRecord& recorded) noexcept;

 private:
  CompiledScene& servo_;
  std::uint64_t volume_chain_;
};

}  // namespace kerf
