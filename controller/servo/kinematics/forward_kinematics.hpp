// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "shared/numeric/vec.hpp"

namespace kerf {

/// Takes a force in N at the tip to the joint torques in N mm that make it: J^T, one row per joint,
/// entries in mm.
template <class N>
using JacobianTransposed = Transform<typename N::Real, JointSpace, DeviceSpace>;

/// What forward kinematics give: the tip in device mm (x right, y up, z to the user) and J^T there.
template <class N>
struct ForwardKinematics {
  DeviceVec<typename N::Real> tip_mm;
  JacobianTransposed<N> jacobian_t_mm;
};

}  // namespace kerf
