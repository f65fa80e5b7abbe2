// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "controller/servo/aligned_step.hpp"
#include "controller/servo/gather_step.hpp"
#include "controller/servo/splat_step.hpp"
#include "controller/servo/volume_tick.hpp"

namespace kerf {

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
