// SPDX-License-Identifier: Apache-2.0

#include "controller/servo/method_step.hpp"

#include <span>

#include "controller/kernel/gradient.hpp"
#include "controller/kernel/overlap.hpp"
#include "controller/kernel/overlap_methods.hpp"

namespace kerf {
namespace {

/// The copy of the volume and its sums in the tool's own lattice.
AlignedTick aligned_tick(const VolumeTick<FixedNumbers>& at) noexcept {
  return {*at.plan.kernels, *at.in_volume().aligned, at.state.scratch.tick,
          at.grid(),        at.memory().density,     at.pose};
}

/// The sums of the samples' weights.
SplatTick splat_tick(const VolumeTick<FixedNumbers>& at) noexcept {
  const SplatTick tick(*at.plan.kernels, at.tool().samples, *at.plan.taps, at.state.scratch,
                       at.grid(), at.memory().density, at.pose);
  tick.copy();
  tick.splat();
  return tick;
}

template <class N>
VoxelBox overlap_of(const VolumeTick<N>& at) noexcept {
  return overlap<N>(at.grid(), at.tool().offsets, at.pose, at.in_volume().overlap_ratio,
                    at.state.overlap);
}

/// The modification force, the removal, and the gradients that it changed.
template <class N>
void cut(const VolumeTick<N>& at, std::span<const Gradient<N>> gradient,
         VolumeForces<N>& forces) noexcept {
  if (overlap_of(at).empty()) return;
  VolumeState<N>& memory = at.memory();
  forces.modification_n =
      force_of_sum<N>(at.in_volume().modification,
                      modification_sum<N>(at.grid(), gradient, memory.density, at.state.overlap));
  forces.removed =
      remove<N>(at.grid(), memory.density, at.state.overlap, at.plan.removal_rate, memory.carry);
  refresh_gradients<N>(at.plan.gradient_kernel, at.grid(), memory.density, forces.removed.changed,
                       memory.gradient, *at.state.gradient_scratch);
}

}  // namespace

template <class N>
VolumeForces<N> AlignedStep<N>::contact_and_cut(const VolumeTick<N>& at) noexcept {
  const AlignedTick tick = aligned_tick(at);
  VolumeForces<N> forces;
  if (!at.plan.contact.swept) {
    forces.contact_n = force_of_sum<N>(at.in_volume().contact, tick.contact());
  }
  if (!at.overlap_cuts()) return forces;
  const AlignedTick::Milled milled = tick.mill(at.plan.removal_rate, at.memory().carry);
  forces.modification_n = force_of_sum<N>(at.in_volume().modification, milled.modification);
  forces.removed = milled.removed;
  return forces;
}

template <class N>
Covered<N> AlignedStep<N>::cover(const VolumeTick<N>& at, const CoverList<N>& list) noexcept {
  const AlignedTick tick = aligned_tick(at);
  tick.cover();
  return list(tick.overlap());
}

template struct AlignedStep<FixedNumbers>;

/// Fixed point gathers only if nothing is cut.
template <class N>
VolumeForces<N> GatherStep<N>::contact_and_cut(const VolumeTick<N>& at) noexcept {
  const std::span<const Gradient<N>> gradient = at.memory().gradient;
  const ToolInVolume<N>& in_volume = at.in_volume();
  VolumeForces<N> forces;
  if constexpr (N::kIsFixed) {
    forces.contact_n = force_of_sum<N>(
        in_volume.contact,
        gathered_contact(*at.plan.kernels, at.tool().samples, at.grid(), gradient, at.pose));
  } else {
    if (!at.plan.contact.swept) {
      forces.contact_n = force_of_sum<N>(
          in_volume.contact, contact_sum<N>(at.grid(), gradient, at.tool().offsets, at.pose));
    }
    if (at.overlap_cuts()) cut(at, gradient, forces);
  }
  return forces;
}

template <class N>
Covered<N> GatherStep<N>::cover(const VolumeTick<N>& at, const CoverList<N>& list) noexcept {
  if constexpr (N::kIsFixed) {
    return list(BoxOverlap{});
  } else {
    static_cast<void>(overlap_of(at));
    return list(at.state.overlap);
  }
}

template struct GatherStep<FixedNumbers>;
template struct GatherStep<DoubleNumbers>;

/// Both of the paper's forces from the same sums, then the removal. Only for scenes that cut by
/// overlap.
template <class N>
VolumeForces<N> SplatStep<N>::contact_and_cut(const VolumeTick<N>& at) noexcept {
  const ToolInVolume<N>& in_volume = at.in_volume();
  const SplatTick tick = splat_tick(at);
  const SplatTick::Felt felt = tick.press(in_volume.overlap_ratio);
  VolumeForces<N> forces;
  if (!at.plan.contact.swept) {
    forces.contact_n = force_of_sum<N>(in_volume.contact, felt.contact);
  }
  if (!at.overlap_cuts()) return forces;
  forces.modification_n = force_of_sum<N>(in_volume.modification, felt.modification);
  forces.removed = tick.cut(at.plan.removal_rate, at.memory().carry);
  return forces;
}

template <class N>
Covered<N> SplatStep<N>::cover(const VolumeTick<N>& at, const CoverList<N>& list) noexcept {
  const SplatTick tick = splat_tick(at);
  tick.cover(at.in_volume().overlap_ratio);
  return list(tick.overlap());
}

template struct SplatStep<FixedNumbers>;

template <class N>
VolumeForces<N> SurfaceStep<N>::contact_and_cut(const VolumeTick<N>& /*at*/) noexcept {
  return {};
}

template <class N>
Covered<N> SurfaceStep<N>::cover(const VolumeTick<N>& /*at*/,
                                 const CoverList<N>& /*list*/) noexcept {
  return {};
}

template struct SurfaceStep<FixedNumbers>;
template struct SurfaceStep<DoubleNumbers>;

}  // namespace kerf
