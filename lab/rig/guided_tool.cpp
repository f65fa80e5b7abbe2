// SPDX-License-Identifier: Apache-2.0
#include "lab/rig/guided_tool.hpp"

namespace kerf::extremes {

template <class N>
GuidedTool<N>::GuidedTool(const SampledTool& tool, const Body& body, Point start, double friction,
                          Density iso)
    : rig_(tool, body, iso), pose_{place_of<N>(start), {}}, friction_(friction) {}

template <class N>
Point GuidedTool<N>::tick(Point hand, const ToolTurn<N>& turn) {
  rig_.field().begin_tick();
  swept_ = ProxySweep<N, ContactQuery<N>>(rig_.field(), pose_, memory_, friction_, rig_.turn_step())
               .tick({place_of<N>(hand), turn});
  most_queries_ = std::max(most_queries_, swept_.queries);
  return proxy() - hand;
}

template class GuidedTool<FixedNumbers>;
template class GuidedTool<DoubleNumbers>;

}  // namespace kerf::extremes
