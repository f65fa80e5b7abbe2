// SPDX-License-Identifier: Apache-2.0

#include "visualizer/render/renderer.hpp"

#include <algorithm>
#include <array>
#include <string_view>

#include "shared/text/text.hpp"
#include "visualizer/render/cast_renderer.hpp"
#include "visualizer/render/iso_renderer.hpp"
#include "visualizer/render/surface_renderer.hpp"
#include "visualizer/render/translucent_renderers.hpp"
#include "visualizer/scene/visualizer_error.hpp"

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

// A density is interpolated between two voxels (1 edge), and so are gradients. A sample within
// takes its material from 1.5 edges up the gradient (translucent_sample.frag).
constexpr int kAlongSurface = 3;

}  // namespace

void Renderer::mark_redraw(std::size_t volume, const KeptPicture& kept, RedrawTiles& tiles) const {
  std::vector<VoxelBox> boxes;
  changed_[volume].for_each_box(kept.volume.bricks,
                                [&](const VoxelBox& box) { boxes.push_back(box); });
  mark_rays(boxes, footprint(kept.volume), !translucent(), surface_gradient(volume), kept, tiles);
}

void Renderer::forget_changes() {
  for (ChangedBricks& volume : changed_) volume.clear();
}

RayFootprint Renderer::footprint(const VolumeView& volume) const {
  const VoxelIndex reach = GradientPlan(GradientFilter::adaptive, volume.edges_mm()).reach();
  const std::int32_t widest[3] = {reach.x, reach.y, reach.z};  // of all filters
  RayFootprint made;
  for (int axis = 0; axis < 3; ++axis) {
    const int gradients = 2 * (widest[axis] + 1) + 1;
    made.along[axis] = translucent() ? gradients : kAlongSurface;
    made.at_end[axis] = translucent() ? 0 : gradients;
  }
  return made;
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

namespace {

std::vector<std::string> kinds_in(const std::string& choice) {
  std::vector<std::string> kinds;
  for (std::size_t from = 0; from <= choice.size();) {
    const std::size_t comma = std::min(choice.find(',', from), choice.size());
    kinds.push_back(choice.substr(from, comma - from));
    from = comma + 1;
  }
  return kinds;
}

std::string kind_after(const std::string& kind) {
  const std::vector<std::string_view> known = renderer_kinds();
  const auto found = std::find(known.begin(), known.end(), kind);
  return std::string(known[static_cast<std::size_t>(found - known.begin() + 1) % known.size()]);
}

}  // namespace

void check_renderers(const std::string& choice) {
  const std::vector<std::string> kinds = kinds_in(choice);
  const std::string* translucent = nullptr;
  for (const std::string& kind : kinds) {
    if (!is_translucent(kind)) continue;
    if (translucent == nullptr) translucent = &kind;
    if (kind == *translucent) continue;
    throw VisualizerError("--renderer: " + choice + ": " + *translucent + " and " + kind +
                          " do not mix where volumes intersect; take one of them for both");
  }
}

std::vector<std::string> renderer_of_each(const std::string& choice, std::size_t volumes) {
  check_renderers(choice);
  std::vector<std::string> kinds = kinds_in(choice);
  if (kinds.size() == 1) kinds.resize(volumes, kinds.front());
  if (kinds.size() == volumes) return kinds;
  throw VisualizerError("--renderer: " + choice + " is for " + std::to_string(kinds.size()) +
                        " volumes, and the scene has " + std::to_string(volumes) +
                        "; name one for all or one for each");
}

std::string with_renderer(const std::string& choice, std::size_t volumes, std::size_t volume,
                          const std::string& kind) {
  std::vector<std::string> kinds = renderer_of_each(choice, volumes);
  kinds[volume] = kind;
  std::string text;
  bool alike = true;
  for (std::string& one : kinds) {
    if (is_translucent(kind) && is_translucent(one)) one = kind;
    alike = alike && one == kinds.front();
    text += (text.empty() ? "" : ",") + one;
  }
  return alike ? kinds.front() : text;
}

std::string next_renderer(const std::string& choice) {
  return kind_after(kinds_in(choice).front());
}

std::string next_renderer(const std::string& choice, std::size_t volumes, std::size_t volume) {
  return with_renderer(choice, volumes, volume,
                       kind_after(renderer_of_each(choice, volumes)[volume]));
}

}  // namespace kerf
