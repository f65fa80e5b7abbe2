// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

#include "controller/kernel/aligned.hpp"
#include "controller/kernel/contact.hpp"
#include "controller/kernel/gather.hpp"
#include "controller/kernel/gradient.hpp"
#include "controller/kernel/milling.hpp"
#include "controller/kernel/overlap.hpp"
#include "controller/kernel/splat.hpp"
#include "controller/kernel/tool_pose.hpp"
#include "controller/servo/servo_plan.hpp"
#include "controller/servo/servo_state.hpp"

namespace kerf {

/// The active tool in volume `v` of the plan, in one tick: what the step of a method is given.
template <class N>
struct VolumeTick {
  const ServoPlan<N>& plan;
  ServoState<N>& state;
  std::size_t v;
  ToolPose<N> pose;

  [[nodiscard]] const ToolPlan<N>& tool() const noexcept { return plan.tools[state.active_tool]; }
  [[nodiscard]] const ToolInVolume<N>& in_volume() const noexcept { return tool().in_volume[v]; }
  [[nodiscard]] const VoxelGrid& grid() const noexcept { return plan.volumes[v].grid; }
  [[nodiscard]] VolumeState<N>& memory() const noexcept { return state.volumes[v]; }
};

/// What one volume does to the tool, at the device port and along the gradient, so that the hand
/// feels its negative; and what the tool cut of it.
template <class N>
struct VolumeForces {
  DeviceVec<typename N::Real> contact_n, modification_n;
  Removed removed;
};

/// Step of the method `gather`. Fixed point gathers only where nothing is cut. Servo thread; no
/// heap.
template <class N>
struct GatherStep {
  /// Contact, where the paper's force is felt; then the modification force, the removal and the
  /// gradients that it changed.
  [[nodiscard]] static VolumeForces<N> feel_and_cut(const VolumeTick<N>& at) noexcept {
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

  /// What `weigh` finds in the tool's overlap, for a cut by force.
  template <class Weigh>
  [[nodiscard]] static auto cover(const VolumeTick<N>& at, Weigh&& weigh) noexcept {
    if constexpr (N::kIsFixed) {
      return weigh(BoxOverlap{});
    } else {
      static_cast<void>(overlap_of(at));
      return weigh(at.state.overlap);
    }
  }

 private:
  static VoxelBox overlap_of(const VolumeTick<N>& at) noexcept {
    return overlap<N>(at.grid(), at.tool().offsets, at.pose, at.in_volume().overlap_ratio,
                      at.state.overlap);
  }

  static void cut(const VolumeTick<N>& at, std::span<const Gradient<N>> gradient,
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
};

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

/// Calls `work` with the step of a method. The servo's only list of them: whatever it does with a
/// method it does through here.
template <class N, class Work>
decltype(auto) by_method(Method method, Work&& work) noexcept {
  switch (method) {
    case Method::aligned:
      if constexpr (N::kIsFixed) return work(AlignedStep{});
      break;
    case Method::splat:
      if constexpr (N::kIsFixed) return work(SplatStep{});
      break;
    case Method::surface:  // has no step: nothing is cut, and the swept proxy is felt before
    case Method::gather:
      break;
  }
  return work(GatherStep<N>{});
}

}  // namespace kerf
