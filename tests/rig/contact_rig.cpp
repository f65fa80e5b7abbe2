// SPDX-License-Identifier: Apache-2.0
#include "tests/rig/contact_rig.hpp"

namespace kerf::extremes {

template <class N>
GuidedTool<N>::GuidedTool(const SampledTool& tool, const Body& body, Point start, double friction,
                          Density iso)
    : rig_(tool, body, iso), pose_{place_of<N>(start), {}}, friction_(friction) {}

template <class N>
Point GuidedTool<N>::tick(Point hand, const Orientation<N>& orientation) {
  rig_.field().begin_tick();
  swept_ =
      ProxySweep<N, ContactQuery<N>>(rig_.field(), pose_, memory_, friction_, rig_.rotation_step())
          .tick({place_of<N>(hand), orientation});
  most_queries_ = std::max(most_queries_, swept_.queries);
  return proxy() - hand;
}

template class GuidedTool<FixedNumbers>;
template class GuidedTool<DoubleNumbers>;

}  // namespace kerf::extremes
