// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "controller/servo/method_list.hpp"
#include "controller/servo/volume_tick.hpp"

namespace kerf {

/// The steps of the list. Each has a file of its own (as splat_step.cpp), which defines the members
/// and instantiates the class for the numbers that it serves. Servo thread; no heap.
///
/// `feel_and_cut`: contact, where the paper's force is felt; then the modification force and the
/// removal, where overlap cuts. `cover`: what the tool covers, for a cut by force.
#define KERF_STEP(name, Step, serves)                                                    \
  template <class N>                                                                     \
  struct Step {                                                                          \
    [[nodiscard]] static VolumeForces<N> feel_and_cut(const VolumeTick<N>& at) noexcept; \
    [[nodiscard]] static Covered<N> cover(const VolumeTick<N>& at,                       \
                                          const CoverList<N>& list) noexcept;            \
  };
KERF_METHODS(KERF_STEP)
#undef KERF_STEP

/// Calls `work` with the step of a method. The servo's only choice between them: whatever it does
/// with a method it does through here.
template <class N, class Work>
decltype(auto) by_method(Method method, Work&& work) noexcept {
  switch (method) {
#define KERF_CASE(name, Step, serves)             \
  case Method::name:                              \
    if constexpr (serves) return work(Step<N>{}); \
    break;
    KERF_METHODS(KERF_CASE)
#undef KERF_CASE
  }
  return work(GatherStep<N>{});  // serves always
}

}  // namespace kerf
