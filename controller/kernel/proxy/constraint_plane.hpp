// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "shared/numeric/numbers.hpp"
#include "shared/numeric/vec.hpp"

namespace kerf {

/// Where the swept contact is solved: axes and origin of the world; one unit is the edge of the
/// finest voxel of all solid volumes (docs/theory.md 1.2). docs/contact.md calls it a voxel.
struct ContactSpace;

template <class S>
using ContactVec = Vec<S, ContactSpace>;

/// Most planes that hold the tool at one place: a face, a crease, a corner.
inline constexpr std::size_t kMaxPlanes = 3;

/// A contact allows the centre, now at q, to be at any x with `dot(normal, x - q) >= depth`
/// (docs/theory.md 4.3).
template <class N>
struct ConstraintPlane {
  ContactVec<typename N::Unit> normal{};  ///< out of the solid, length 1
  typename N::Real depth{};               ///< units; above 0: the tool is in too deep
  ContactVec<typename N::Real> arm{};     ///< from the tool's centre to the contact, units
  bool behind = false;                    ///< met by what is behind the head (tool_query.hpp)

  friend constexpr bool operator==(const ConstraintPlane&,
                                   const ConstraintPlane&) noexcept = default;
};

/// What one collision query finds: `count` planes, the deepest first.
template <class N>
struct Contacts {
  typename N::Real depth{-1};  ///< the largest of the planes' depths; -1 where nothing is near
  std::int32_t count = 0;
  std::array<ConstraintPlane<N>, kMaxPlanes> plane{};
  bool buried = false;  ///< full density all round, or not looked at: no normal, no plane

  friend constexpr bool operator==(const Contacts&, const Contacts&) noexcept = default;
};

/// Adds a plane where it belongs by its depth. Of more than kMaxPlanes the deepest stay.
template <class N>
constexpr void insert(Contacts<N>& felt, const ConstraintPlane<N>& plane) noexcept {
  auto slot = static_cast<std::size_t>(felt.count);
  if (slot < kMaxPlanes) {
    ++felt.count;
  } else if (felt.plane[--slot].depth >= plane.depth) {
    return;
  }
  for (; slot > 0 && felt.plane[slot - 1].depth < plane.depth; --slot) {
    felt.plane[slot] = felt.plane[slot - 1];
  }
  felt.plane[slot] = plane;
}

}  // namespace kerf
