// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "controller/kernel/aligned.hpp"
#include "controller/servo/volume_tick.hpp"

namespace kerf {

/// Step of the method `aligned`. Fixed point alone. Servo thread; no heap.
struct AlignedStep {
  using N = FixedNumbers;

  /// Contact, where the paper's force is felt; then the modification force and the removal.
  [[nodiscard]] static VolumeForces<N> feel_and_cut(const VolumeTick<N>& at) noexcept {
    const AlignedTick tick = begin(at);
    VolumeForces<N> forces;
    if (!at.plan.contact.swept) {
      forces.contact_n = force_of_sum<N>(at.in_volume().contact, tick.contact());
    }
    if (!at.plan.cutting) return forces;
    const AlignedTick::Milled milled = tick.mill(at.plan.removal_rate, at.memory().carry);
    forces.modification_n = force_of_sum<N>(at.in_volume().modification, milled.modification);
    forces.removed = milled.removed;
    return forces;
  }

  /// What `weigh` finds in the tool's overlap, for a cut by force.
  template <class Weigh>
  [[nodiscard]] static auto cover(const VolumeTick<N>& at, Weigh&& weigh) noexcept {
    const AlignedTick tick = begin(at);
    tick.cover();
    return weigh(tick.overlap());
  }

 private:
  static AlignedTick begin(const VolumeTick<N>& at) noexcept {
    return {*at.plan.kernels, *at.in_volume().aligned, at.state.scratch.tick,
            at.grid(),        at.memory().density,     at.pose};
  }
};

}  // namespace kerf
