// SPDX-License-Identifier: Apache-2.0
#include "tests/rig/contact_rig.hpp"

namespace kerf::extremes {

template <class N>
ContactRig<N>::ContactRig(const SampledTool& tool, const KernelSet& kernels)
    : kernels_(kernels),
      tool_(tool.samples, tool.round, tool.close, tool.deficit),
      points_(tool_.point_shell()) {}

template <class N>
ContactRig<N>::ContactRig(const SampledTool& tool, const Body& body, Density iso)
    : ContactRig(tool) {
  add(body, plain_frame<N>(), iso);
}

template <class N>
void ContactRig<N>::add(const Body& body, const ContactFrame<N>& frame, Density iso) {
  fields_.emplace_back(body.grid, body.density, iso);
  memories_.emplace_back().hold(points_);
  volumes_.push_back({fields_.back().field(), frame, memories_.back().places()});
  query_.emplace(kernels_, points_, volumes_);
  query_->orient({});
}

template <class N>
ProxyContact<N> ContactRig<N>::follow(const ProxyPlan<N>& plan, ProxyState<N>& state,
                                      const ProxyPose<N>& goal) {
  return kerf::follow(plan, state, *query_, goal);
}

template class ContactRig<FixedNumbers>;
template class ContactRig<DoubleNumbers>;

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
