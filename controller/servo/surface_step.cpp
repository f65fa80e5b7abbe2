// SPDX-License-Identifier: Apache-2.0
#include "controller/servo/method_step.hpp"

namespace kerf {

template <class N>
VolumeForces<N> SurfaceStep<N>::feel_and_cut(const VolumeTick<N>& /*at*/) noexcept {
  return {};
}

template <class N>
Covered<N> SurfaceStep<N>::cover(const VolumeTick<N>& /*at*/,
                                 const CoverList<N>& /*list*/) noexcept {
  return {};
}

template struct SurfaceStep<FixedNumbers>;
template struct SurfaceStep<FloatNumbers>;
template struct SurfaceStep<DoubleNumbers>;

}  // namespace kerf
