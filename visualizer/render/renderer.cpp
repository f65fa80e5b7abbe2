// SPDX-License-Identifier: Apache-2.0
#include "visualizer/render/renderer.hpp"

#include <algorithm>
#include <array>

#include "shared/text/words.hpp"
#include "visualizer/error.hpp"
#include "visualizer/render/blend_renderer.hpp"
#include "visualizer/render/cast_renderer.hpp"
#include "visualizer/render/iso_renderer.hpp"
#include "visualizer/render/slices_renderer.hpp"
#include "visualizer/render/surface_renderer.hpp"

namespace kerf {

namespace {

template <class Made>
std::unique_ptr<Renderer> make(const SceneView& scene, std::span<const VolumeContent> contents) {
  return std::make_unique<Made>(scene, contents);
}

using Make = std::unique_ptr<Renderer> (*)(const SceneView&, std::span<const VolumeContent>);

struct Kind {
  std::string_view name;
  Make make;
  bool translucent;
};

template <CastMode mode>
std::unique_ptr<Renderer> make_cast(const SceneView& scene,
                                    std::span<const VolumeContent> contents) {
  return std::make_unique<CastRenderer>(scene, contents, mode);
}

constexpr auto kKinds = std::to_array<Kind>({
    {"iso", make<IsoRenderer>, false},
    {"blend", make<BlendRenderer>, true},
    {"surface", make<SurfaceRenderer>, false},
    {"slices", make<SlicesRenderer>, true},
    {"cast", make_cast<CastMode::iso>, false},
    {"cast-blend", make_cast<CastMode::blend>, true},
});

const Kind& find_kind(std::string_view name) {
  const auto found = std::find_if(kKinds.begin(), kKinds.end(),
                                  [&](const Kind& kind) { return kind.name == name; });
  if (found != kKinds.end()) return *found;
  throw VisualizerError("--renderer: " + std::string(name) + unknown_word(name, renderer_kinds()));
}

// A density is interpolated between two voxels (1 edge), a surface has its gradient from a cube two
// voxels wide (2).
constexpr RayFootprint kSurfaceFootprint{.along = 3, .at_end = 5, .taps_normal = true};
// A sample within takes its material from 1.5 edges up the gradient (matter.frag), or its gradient
// from five voxels along each axis (3).
constexpr RayFootprint kMatterFootprint{.along = 6}, kWideMatterFootprint{.along = 7};

}  // namespace

std::vector<VoxelBox> Renderer::dirty_voxels(std::size_t /*volume*/,
                                             std::span<const VoxelBox> differs) const {
  return {differs.begin(), differs.end()};
}

RayFootprint Renderer::footprint() const noexcept {
  if (!translucent()) return kSurfaceFootprint;
  return takes_gradient() ? kWideMatterFootprint : kMatterFootprint;
}

std::unique_ptr<Renderer> make_renderer(std::string_view kind, const SceneView& scene,
                                        std::span<const VolumeContent> contents) {
  return find_kind(kind).make(scene, contents);
}

std::vector<std::string_view> renderer_kinds() {
  std::vector<std::string_view> names;
  for (const Kind& kind : kKinds) names.push_back(kind.name);
  return names;
}

bool is_translucent(std::string_view kind) {
  return find_kind(kind).translucent;
}

}  // namespace kerf
