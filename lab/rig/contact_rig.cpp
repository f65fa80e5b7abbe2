// SPDX-License-Identifier: Apache-2.0
#include "lab/rig/contact_rig.hpp"

namespace kerf {

template <class N>
ContactRig<N>::ContactRig(const SampledTool& tool, const KernelSet& kernels)
    : kernels_(kernels),
      tool_(tool.samples, tool.round, tool.close, tool.deficit),
      points_(tool_.point_shell()) {}

template <class N>
void ContactRig<N>::add(const VoxelGrid& grid, std::span<const Density> density,
                        const ContactFrame<N>& frame, Density iso) {
  fields_.emplace_back(grid, density, iso);
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

}  // namespace kerf
