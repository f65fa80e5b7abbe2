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

/// Least determinant of planes that are solved for together: 1 - c^2 of two, c the product of their
/// normals. Below it they nearly lie on one line, or three in one plane.
inline constexpr double kLeastDeterminant = 1e-3;

/// Planes of two volumes that say the same, as of a face that both share: their normals lie within
/// 1.8 degrees, so that no loads of the two can be told apart, and the deeper one alone holds the
/// tool. Two would take a place of three and, as they cannot be solved for together, let the third
/// be left out.
template <class N>
[[nodiscard]] constexpr bool are_one_face(ContactVec<typename N::Unit> a,
                                          ContactVec<typename N::Unit> b) noexcept {
  using Unit = typename N::Unit;
  const Unit cosine = dot(a, b);
  return cosine > Unit(0) && Unit(1) - cosine * cosine < Unit(kLeastDeterminant);
}

/// What one collision query finds: `count` planes, the deepest first.
template <class N>
struct Contacts {
  typename N::Real depth{-1};  ///< the largest of the planes' depths; -1 where nothing is near
  std::int32_t count = 0;
  std::array<ConstraintPlane<N>, kMaxPlanes> plane{};
  bool buried = false;  ///< full density all round, or not looked at: no normal, no plane

  friend constexpr bool operator==(const Contacts&, const Contacts&) noexcept = default;
};

/// Adds a plane where it belongs by its depth. Of planes of one face, of the head or behind it, and
/// of more than kMaxPlanes, the deepest stay.
template <class N>
constexpr void insert(Contacts<N>& felt, const ConstraintPlane<N>& plane) noexcept {
  const auto count = static_cast<std::size_t>(felt.count);
  const auto says_the_same = [&](const ConstraintPlane<N>& other) {
    return other.behind == plane.behind && are_one_face<N>(other.normal, plane.normal);
  };
  std::size_t slot = 0;  // that the plane takes, in place of one that says the same or is shallow
  while (slot < count && !says_the_same(felt.plane[slot])) ++slot;
  if (slot == kMaxPlanes) --slot;
  if (slot < count && felt.plane[slot].depth >= plane.depth) return;
  if (slot == count) ++felt.count;
  for (; slot > 0 && felt.plane[slot - 1].depth < plane.depth; --slot) {
    felt.plane[slot] = felt.plane[slot - 1];
  }
  felt.plane[slot] = plane;
}

}  // namespace kerf
