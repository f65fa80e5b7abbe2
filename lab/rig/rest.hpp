// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "lab/rig/guided_tool.hpp"

namespace kerf::extremes {

/// F9 of docs/validation.md: where a tool comes to rest. In 20 ticks a hand presses it from `off`
/// units above `at`, along `up`, to one unit below.
template <class N>
[[nodiscard]] Point rest_of(const SampledTool& tool, const Body& body, Point at, Point up,
                            const ToolTurn<N>& turn = {}, double off = 1.5, Density iso = kIso) {
  GuidedTool<N> guided(tool, body, at + off * up, 0, iso);
  constexpr int kTicks = 20;
  for (int i = 0; i <= kTicks; ++i) guided.tick(at + (off - (off + 1) * i / kTicks) * up, turn);
  return guided.proxy();
}

}  // namespace kerf::extremes
