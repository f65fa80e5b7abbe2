// SPDX-License-Identifier: Apache-2.0
#include <span>

#include "controller/kernel/contact.hpp"
#include "controller/kernel/gather.hpp"
#include "controller/kernel/gradient.hpp"
#include "controller/kernel/overlap.hpp"
#include "controller/servo/method_step.hpp"

namespace kerf {
namespace {

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
  refresh_gradients<N>(at.plan.kernel, at.grid(), memory.density, forces.removed.changed,
                       memory.gradient, *at.state.gradient_scratch);
}

}  // namespace

/// Fixed point gathers only where nothing is cut.
template <class N>
VolumeForces<N> GatherStep<N>::feel_and_cut(const VolumeTick<N>& at) noexcept {
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
    if (at.plan.cutting) cut(at, gradient, forces);
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
template struct GatherStep<FloatNumbers>;
template struct GatherStep<DoubleNumbers>;

}  // namespace kerf
