// SPDX-License-Identifier: Apache-2.0
#include "controller/kernel/splat.hpp"
#include "controller/servo/method_step.hpp"

namespace kerf {
namespace {

/// The sums of the samples' weights.
SplatTick begin(const VolumeTick<FixedNumbers>& at) noexcept {
  const SplatTick tick(*at.plan.kernels, at.tool().samples, *at.plan.taps, at.state.scratch,
                       at.grid(), at.memory().density, at.pose);
  tick.copy();
  tick.splat();
  return tick;
}

}  // namespace

/// Both of the paper's forces from the same sums, then the removal. Only where overlap cuts.
template <class N>
VolumeForces<N> SplatStep<N>::feel_and_cut(const VolumeTick<N>& at) noexcept {
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

template <class N>
Covered<N> SplatStep<N>::cover(const VolumeTick<N>& at, const CoverList<N>& list) noexcept {
  const SplatTick tick = begin(at);
  tick.cover(at.in_volume().overlap_ratio);
  return list(tick.overlap());
}

template struct SplatStep<FixedNumbers>;

}  // namespace kerf
