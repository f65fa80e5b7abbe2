// SPDX-License-Identifier: Apache-2.0
#include "visualizer/picture/seen_bodies.hpp"

#include <cstddef>
#include <limits>
#include <string>

#include "visualizer/picture/image_files.hpp"

namespace kerf {

namespace {

SceneView scene_for(const Picture& picture, AovChoice choice) {
  SceneView scene = picture.shown_scene();
  scene.normals = choice.normal;
  return scene;
}

}  // namespace

SeenBodies::SeenBodies(const Session& session, const Picture& picture, PictureSize size,
                       AovChoice choice)
    : choice_(choice),
      painter_(picture.settings().renderer, scene_for(picture, choice), session.contents()),
      target_(size, GL_RGBA32F) {}

void SeenBodies::update(const Session& session) {
  for (std::size_t v = 0; v < session.scene().volumes.size(); ++v) {
    painter_.update(v, session.snapshot(v));
  }
  painter_.forget_changes();  // each picture is drawn whole
}

SeenBodies::Seen SeenBodies::draw(const Session& session, const Picture& picture) {
  const PictureSize size = target_.size();
  const View view = picture.middle_view(size);
  const Hands hands = hands_of(session);
  target_.bind();
  glClearColor(0.0F, 0.0F, 0.0F, 0.0F);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  painter_.hold(hands);
  painter_.draw_volumes(ScenePainter::Layer::opaque, view, target_);
  for (const auto& hand : hands) {
    if (hand) painter_.draw_tool(*hand, view, target_);
  }
  painter_.draw_volumes(ScenePainter::Layer::translucent, view, target_);
  Seen seen;
  seen.depth = target_.read_depth();
  if (choice_.normal) seen.normal = target_.read_floats();
  glDisable(GL_SCISSOR_TEST);
  // World axes are the columns of the turn that takes them to the eye.
  const glm::dmat3 world_from_eye = glm::transpose(glm::dmat3(view.eye_from_world));
  for (std::size_t i = 0; i < seen.depth.size(); ++i) {
    float& depth = seen.depth[i];
    const bool any = depth < 1.0F;
    if (choice_.normal) {
      float* const n = &seen.normal[3 * i];
      const glm::dvec3 normal = world_from_eye * glm::dvec3(n[0], n[1], n[2]);
      const double length = glm::length(normal);
      for (int axis = 0; axis < 3; ++axis) {
        n[axis] = any && length > 0.0 ? static_cast<float>(normal[axis] / length) : 0.0F;
      }
    }
    // The inverse of the paper's equation (1).
    const double f = view.far_mm, near = view.near_mm;
    const double along = 2.0 * static_cast<double>(depth) - 1.0;
    depth = any ? static_cast<float>(2.0 * f * near / (f + near - along * (f - near)))
                : std::numeric_limits<float>::infinity();
  }
  if (!choice_.depth) seen.depth.clear();
  return seen;
}

void write_seen(const SeenBodies::Seen& seen, PictureSize size,
                const std::filesystem::path& picture) {
  const std::string stem = (picture.parent_path() / picture.stem()).string();
  if (!seen.depth.empty()) write_npy(stem + "-depth.npy", size, 1, seen.depth);
  if (!seen.normal.empty()) write_npy(stem + "-normal.npy", size, 3, seen.normal);
}

}  // namespace kerf
