// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "controller/volume/file/volume_image.hpp"
#include "visualizer/scene/scene_view.hpp"

namespace kerf::test {

/// A tooth, crown up, with its materials.
struct Tooth {
  VolumeImage image;
  SceneView scene;
  bool labelled;

  Tooth(VolumeImage of, double iso, bool with_labels);
  [[nodiscard]] VolumeContent content() const;
  /// Opens the crown down to the pulp; returns the bricks that may have changed.
  ChangedBricks drill();
};

/// The made tooth, 32 x 32 x 20 mm with the air around it.
[[nodiscard]] Tooth phantom(VoxelGrid grid, bool labelled);

/// The CT tooth below $KERF_DATA; none, with a message, where it is not there.
[[nodiscard]] std::optional<Tooth> ct_tooth();

}  // namespace kerf::test
