// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "controller/kernel/splat.hpp"
#include "controller/servo/volume_tick.hpp"

namespace kerf {

/// Step of the method `splat`. Fixed point alone. Servo thread; no heap.
struct SplatStep {
  using N = FixedNumbers;

  /// Both of the paper's forces from the same sums, then the removal. Only where overlap cuts.
  [[nodiscard]] static VolumeForces<N> feel_and_cut(const VolumeTick<N>& at) noexcept {
    const ToolInVolume<N>& in_volume = at.in_volume();
    const SplatTick tick = begin(at);
    const SplatTick::Felt felt = tick.press(in_volume.overlap_ratio);
    VolumeForces<N> forces;
    if (!at.plan.contact.swept) {
      forces.contact_n = force_of_sum<N>(in_volume.contact, felt.contact);
    }
    forces.modification_n = force_of_sum<N>(in_volume.modification, felt.modification);
    forces.removed = tick.cut(at.plan.removal_rate, at.memory().carry);
    return forces;
  }

  /// What `weigh` finds in the tool's overlap, for a cut by force.
  template <class Weigh>
  [[nodiscard]] static auto cover(const VolumeTick<N>& at, Weigh&& weigh) noexcept {
    const SplatTick tick = begin(at);
    tick.cover(at.in_volume().overlap_ratio);
    return weigh(tick.overlap());
  }

 private:
  /// The sums of the samples' weights.
  static SplatTick begin(const VolumeTick<N>& at) noexcept {
    const SplatTick tick(*at.plan.kernels, at.tool().samples, *at.plan.taps, at.state.scratch,
                         at.grid(), at.memory().density, at.pose);
    tick.copy();
    tick.splat();
    return tick;
  }
};

}  // namespace kerf
