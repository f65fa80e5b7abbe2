// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "shared/volume/changed_bricks.hpp"
#include "visualizer/gl/target.hpp"
#include "visualizer/redraw/redraw_tiles.hpp"
#include "visualizer/scene/camera.hpp"
#include "visualizer/scene/scene_view.hpp"

namespace kerf {

/// Draws the volumes of one session. Every renderer writes colour and true depth (the paper's
/// equation (1)), so several volumes, the tool and other meshes hide one another as they should.
///
/// Lives and is called on the thread whose GL context is current.
class Renderer {
 public:
  explicit Renderer(std::size_t volumes) : changed_(volumes) {}
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;
  virtual ~Renderer() = default;

  /// Follows the changes of a volume; `density` is all of it. Keeps them until `forget_changes`.
  void update(std::size_t volume, std::span<const Density> density, const ChangedBricks& changed) {
    changed_[volume].add(changed);
    upload(volume, density, changed);
  }
  /// Marks the tiles of the last picture whose pixels may be different now: those whose rays meet
  /// changed cells.
  virtual void mark_redraw(std::size_t volume, const KeptPicture& kept, RedrawTiles& tiles) const;
  virtual void forget_changes();
  /// Moves a volume; its voxels keep their edges.
  virtual void set_transform(std::size_t volume, const glm::dmat4& world_from_voxel) = 0;
  /// The materials have other opacities, and are else what they were. Renderers of iso-surfaces
  /// show none. `contents` is all of the volumes.
  virtual void set_opacities(std::span<const MaterialView> /*materials*/,
                             std::span<const VolumeContent> /*contents*/) {}
  /// Views have a clip plane from now on, or none any more. Renderers that hold no voxels cut no
  /// faces without this call; what they hold for that costs memory, and each update a little.
  /// `contents` is all of the volumes. Throws VisualizerError if the driver cannot hold them.
  virtual void set_cut_open(bool /*open*/, std::span<const VolumeContent> /*contents*/) {}
  /// While camera or objects move, a renderer may draw more coarsely; at rest it is exact.
  virtual void set_moving(bool /*moving*/) {}
  /// It does draw more coarsely then.
  [[nodiscard]] virtual bool coarse_while_moving() const noexcept { return false; }
  /// Draws over what is in `target`, under its depth test, within its part. Opaque things come
  /// first: some renderers look through.
  virtual void draw(const View& view, const RenderTarget& target) = 0;
  /// A ray whose footprint holds no changed voxel of a volume keeps its colour.
  [[nodiscard]] RayFootprint footprint(const VolumeView& volume) const;
  /// Lets what lies behind a surface shine through, so that it must be drawn before.
  [[nodiscard]] virtual bool translucent() const noexcept { return false; }

 private:
  virtual void upload(std::size_t volume, std::span<const Density> density,
                      const ChangedBricks& changed) = 0;
  /// By which the surfaces of a volume are shaded pixel by pixel; null if none are.
  [[nodiscard]] virtual const GradientRows* surface_gradient(std::size_t /*volume*/) const {
    return nullptr;
  }

  std::vector<ChangedBricks> changed_;  ///< by volume
};

/// The shader of lights for what is made of `scene`: `SceneView::normals` takes their place.
[[nodiscard]] constexpr std::string_view light_of(const SceneView& scene) noexcept {
  return scene.normals ? "plain_normals.frag" : "lighting.frag";
}

/// `kind` as on the command line; throws VisualizerError for an unknown one and names the known.
[[nodiscard]] std::unique_ptr<Renderer> make_renderer(std::string_view kind, const SceneView& scene,
                                                      std::span<const VolumeContent> contents);

/// All that `make_renderer` knows.
[[nodiscard]] std::vector<std::string_view> renderer_kinds();

/// `Renderer::translucent` of a kind. Throws as `make_renderer` does; needs no GL context.
[[nodiscard]] bool is_translucent(std::string_view kind);

// A choice as on the command line: one renderer for all volumes of a scene, or one for each in the
// scene's order, with commas between. Of those that look into volumes a choice has one kind at
// most: only what one renderer draws mixes where it intersects.

/// Throws VisualizerError for a choice that no scene can have.
void check_renderers(const std::string& choice);

/// The renderer of each volume; throws also for another number of volumes.
[[nodiscard]] std::vector<std::string> renderer_of_each(const std::string& choice,
                                                        std::size_t volumes);

/// `choice` with another renderer for one of `volumes` volumes. If the new renderer is translucent,
/// it replaces every translucent one.
[[nodiscard]] std::string with_renderer(const std::string& choice, std::size_t volumes,
                                        std::size_t volume, const std::string& kind);

/// `choice` with the renderer after that of the first volume for all.
[[nodiscard]] std::string next_renderer(const std::string& choice);
/// `choice` with the next renderer for one of `volumes` volumes.
[[nodiscard]] std::string next_renderer(const std::string& choice, std::size_t volumes,
                                        std::size_t volume);

}  // namespace kerf
