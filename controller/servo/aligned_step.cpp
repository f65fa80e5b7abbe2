// SPDX-License-Identifier: Apache-2.0
#include "controller/kernel/aligned.hpp"
#include "controller/servo/method_step.hpp"

namespace kerf {
namespace {

AlignedTick begin(const VolumeTick<FixedNumbers>& at) noexcept {
  return {*at.plan.kernels, *at.in_volume().aligned, at.state.scratch.tick,
          at.grid(),        at.memory().density,     at.pose};
}

}  // namespace

template <class N>
VolumeForces<N> AlignedStep<N>::feel_and_cut(const VolumeTick<N>& at) noexcept {
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

template <class N>
Covered<N> AlignedStep<N>::cover(const VolumeTick<N>& at, const CoverList<N>& list) noexcept {
  const AlignedTick tick = begin(at);
  tick.cover();
  return list(tick.overlap());
}

template struct AlignedStep<FixedNumbers>;

}  // namespace kerf
