// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>

#include "visualizer/view/gradient.hpp"

namespace kerf {

/// Cuts the volumes open, square to an axis of the world or to any direction: what lies beyond is
/// not drawn.
struct ClipPlane {
  static constexpr int kFree = 3;  ///< `axis` of any direction
  bool on = false;
  int axis = 2;                                  ///< 0 x, 1 y, 2 z: towards the first view
  double at = 0.5;                               ///< 0..1 of the way through the box of all volumes
  std::array<double, 3> towards{0.0, 0.0, 1.0};  ///< of kFree; length 1
  friend bool operator==(const ClipPlane&, const ClipPlane&) noexcept = default;
};

/// Two eyes side by side; lengths in mm.
struct Stereo {
  bool on = false;
  std::optional<double> eyes_mm{};         ///< none: `kEyesPerConvergence` of the next
  std::optional<double> convergence_mm{};  ///< none: as far as what the camera turns about
  friend bool operator==(const Stereo&, const Stereo&) noexcept = default;
};

/// Opacity over one voxel edge, 0..1, by the name of the material.
using Opacities = std::map<std::string, double>;

/// How the volumes are shown: what a user may change while they are looked at.
struct Look {
  std::string renderer = "iso";  ///< of all volumes, or of each: renderer_choice.hpp
  std::optional<double> iso{};   ///< of all volumes, 0..1 of full density; none: each its own
  Opacities opacities{};         ///< of the others: their own
  Gradient gradient = Gradient::corners;
  ClipPlane clip{};
  Stereo stereo{};
  bool voxel_tool = false;    ///< the tool is a volume, not a mesh
  bool colour_blind = false;  ///< materials in colours that any colour vision tells apart
  friend bool operator==(const Look&, const Look&) noexcept = default;
};

}  // namespace kerf
