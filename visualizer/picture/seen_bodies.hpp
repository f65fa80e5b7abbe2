// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "visualizer/compose/picture_layers.hpp"
#include "visualizer/gl/target.hpp"
#include "visualizer/picture/picture.hpp"
#include "visualizer/scene/session.hpp"

namespace kerf {

/// What --aov asks for beside each picture.
struct AovChoice {
  bool depth = false, normal = false;
  [[nodiscard]] bool any() const noexcept { return depth || normal; }
};

/// Where and how the bodies of a picture are seen, pixel by pixel: volumes and tools, without the
/// arrow of the force. It draws them again for itself, at the centres of the picture's pixels,
/// without smoothed edges.
class SeenBodies {
 public:
  /// After the first `poll` of the session; uploads it whole. Throws VisualizerError if the
  /// renderer cannot show it.
  SeenBodies(const Session& session, const Picture& picture, PictureSize size, AovChoice choice);

  /// Takes what changed in the session; call it with `Picture::update`.
  void update(const Session& session);

  /// Rows from the top. `depth`: mm from the eye along the view axis, infinite where nothing is
  /// seen; one float of each pixel. `normal`: of length 1, away from the solid, along the axes of
  /// the scene; 0 where nothing is seen; three floats. What was not asked for is empty.
  struct Seen {
    std::vector<float> depth, normal;
  };
  [[nodiscard]] Seen draw(const Session& session, const Picture& picture);

 private:
  AovChoice choice_;
  ScenePainter painter_;
  RenderTarget target_;
};

/// Writes FRAME-depth.npy and FRAME-normal.npy beside FRAME.png. Throws FileError.
void write_seen(const SeenBodies::Seen& seen, PictureSize size,
                const std::filesystem::path& picture);

}  // namespace kerf
