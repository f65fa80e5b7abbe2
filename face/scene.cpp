// SPDX-License-Identifier: Apache-2.0
#include "kerf/scene.hpp"

#include <algorithm>
#include <memory>
#include <utility>

#include "controller/load/load_scene.hpp"
#include "controller/loop/publisher.hpp"
#include "controller/plan/compile.hpp"
#include "controller/run/scene_check.hpp"
#include "controller/scene/scene_file.hpp"
#include "face/emulated_hand.hpp"
#include "face/loaded.hpp"
#include "shared/numeric/fnv1a.hpp"

namespace kerf {
namespace {

SceneOverrides overrides_of(const Settings& settings) {
  SceneOverrides overrides;
  for (const std::string& setting : settings) {
    overrides.settings.push_back(parse_setting(setting));
  }
  return overrides;
}

/// The motors that a scene without a scale of their torques gets; none if it has them.
void take_emulated_motors(const SceneSpec& written, SceneOverrides& overrides) {
  if (!written.device.torque_scale) {
    overrides.torque_scale = torque_scale_in_text(written.device.personality);
  }
  if (written.second && !written.second->device.torque_scale) {
    overrides.second_torque_scale = torque_scale_in_text(written.second->device.personality);
  }
}

Scene scene_of(LoadedScene scene, SceneSource source) {
  auto loaded = std::make_shared<Scene::Loaded>();
  loaded->json = canonical_json(scene);
  loaded->config_hash = fnv1a(loaded->json);
  loaded->scene = std::move(scene);
  loaded->source = std::move(source);
  return Scene(std::move(loaded));
}

Scene scene_of(SceneSource source) {
  take_emulated_motors(
      parse_scene(source.text, source.path, scene_keys(), source.overrides.settings),
      source.overrides);
  LoadedScene scene = load_scene(source);
  return scene_of(std::move(scene), std::move(source));
}

/// What says how a file is read says nothing of memory.
void refuse_keys_of_files(const SceneSpec& written) {
  const VolumeSpec& first = written.volumes.front();
  const char* const key = first.window                ? "window"
                          : first.spacing_mm          ? "spacing_mm"
                          : first.override_spacing_mm ? "override_spacing_mm"
                          : is_phantom(first)         ? "file = \"phantom\""
                                                      : nullptr;
  if (key == nullptr) return;
  throw Error("volume 1: " + std::string(key) +
              " is of files, and these voxels come from memory; leave it out");
}

VolumeImage image_of(const Voxels& voxels) {
  VolumeImage image;
  const auto& [nx, ny, nz] = voxels.size;
  check_grid("voxels", nx, ny, nz);
  check_spacing("voxels", voxels.spacing_mm, "Voxels::spacing_mm");
  image.grid = {nx, ny, nz};
  if (voxels.density.size() != image.grid.voxel_count()) {
    throw Error("voxels: " + std::to_string(voxels.density.size()) + " densities, and " +
                std::to_string(nx) + " x " + std::to_string(ny) + " x " + std::to_string(nz) +
                " voxels; give one for each");
  }
  image.spacing_mm = voxels.spacing_mm;
  image.density.assign(voxels.density.begin(), voxels.density.end());
  return image;
}

template <class Items>
std::vector<std::string> names_of(const Items& items) {
  std::vector<std::string> names;
  for (const auto& item : items) names.push_back(item.name);
  return names;
}

}  // namespace

Scene Scene::load(const std::filesystem::path& file, const Settings& settings) {
  return or_error([&] { return scene_of(read_source(file, overrides_of(settings))); });
}

Scene Scene::parse(std::string_view text, const std::filesystem::path& folder,
                   const Settings& settings) {
  return or_error([&] {
    return scene_of(SceneSource{std::filesystem::absolute(folder / "scene.toml"), std::string(text),
                                overrides_of(settings)});
  });
}

Scene Scene::of_voxels(const Voxels& first, std::string_view text, const Settings& settings) {
  return or_error([&] {
    SceneSource source{std::filesystem::absolute("scene.toml"), std::string(text),
                       overrides_of(settings)};
    const SceneSpec written =
        parse_scene(source.text, source.path, scene_keys(), source.overrides.settings);
    refuse_keys_of_files(written);
    take_emulated_motors(written, source.overrides);
    LoadedScene scene = load_scene(source.path, source.text, image_of(first), source.overrides);
    return scene_of(std::move(scene), std::move(source));
  });
}

std::size_t Scene::arms() const noexcept {
  return arms_of(loaded_->scene);
}

int Scene::rate_hz() const noexcept {
  return loaded_->scene.servo.rate_hz;
}

std::vector<std::string> Scene::volumes() const {
  return names_of(loaded_->scene.volumes);
}

std::vector<std::string> Scene::tools() const {
  return names_of(loaded_->scene.tools);
}

std::string Scene::over_budget() const {
  return or_error(
      [&] { return budget_error(loaded_->scene, plan_scene(loaded_->scene)->costs()); });
}

std::string Scene::explain() const {
  return or_error([&] {
    LoadedScene scene = loaded_->scene;
    const SegmentPlan segment =
        plan_segment(segment_spec(scene, loaded_->json, loaded_->config_hash));
    const auto servo = compile(scene);
    return explanation_text(kerf::explain(scene, *servo, segment));
  });
}

std::string Scene::json() const {
  return loaded_->json;
}

}  // namespace kerf
