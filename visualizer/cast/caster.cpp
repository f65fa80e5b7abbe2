// SPDX-License-Identifier: Apache-2.0
#include "visualizer/cast/caster.hpp"

#include <algorithm>
#include <string>
#include <system_error>

#include "shared/posix/threads.hpp"
#include "visualizer/scene/visualizer_error.hpp"

namespace kerf {

namespace {

constexpr std::int32_t kTile = 16;  // pixels: coherent rays, and enough pieces to share out

}  // namespace

void CastPicture::resize(std::int32_t to_width, std::int32_t to_height) {
  width = to_width;
  height = to_height;
  const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  rgba.assign(pixels, 0);
  depth.assign(pixels, 1.0F);
}

Caster::Caster(const SceneView& scene, std::span<const CastContent> contents,
               const Options& options)
    : options_(options) {
  if (scene.volumes.size() > kMaxCastVolumes) {
    throw VisualizerError("scene: " + std::to_string(scene.volumes.size()) +
                          " volumes, and the ray caster takes " + std::to_string(kMaxCastVolumes) +
                          "; use --renderer iso");
  }
  volumes_.reserve(scene.volumes.size());
  for (std::size_t i = 0; i < scene.volumes.size(); ++i) {
    volumes_.emplace_back(scene.volumes[i], contents[i], options.mode, scene.gradient);
  }
}

void Caster::update(std::size_t volume, std::span<const Density> density,
                    const ChangedBricks& changed) {
  volumes_[volume].update_bricks(density, changed);
}

std::vector<BoxCorners> Caster::bodies() const {
  std::vector<BoxCorners> bodies;
  for (const CastVolume& volume : volumes_) {
    if (const auto body = volume.body()) bodies.push_back(*body);
  }
  return bodies;
}

void Caster::set_materials(const Palette& materials) {
  for (CastVolume& volume : volumes_) volume.set_materials(materials);
}

void Caster::draw(const View& view, std::span<const PixelRect> parts, CastPicture& picture,
                  std::span<const float> end_depth, std::span<float> normals) {
  const PixelRect bounds = united(parts);
  CastJob job;
  double shortest_mm = view.far_mm;
  for (CastVolume& volume : volumes_) {
    shortest_mm = std::min(shortest_mm, volume.edge_mm());
    job.volumes[job.volume_count++] = volume.job(view, picture.width, picture.height, bounds);
  }
  job.eye = cast_eye(view, picture.width, picture.height);
  job.pixels = {picture.rgba.data(), picture.depth.data(),
                normals.empty() ? nullptr : normals.data(),
                end_depth.empty() ? nullptr : end_depth.data()};
  job.step_mm = options_.step_vox * static_cast<float>(shortest_mm);
  put(job.key_light, glm::normalize(glm::dvec3(-0.45, 0.75, 0.70)));  // lighting.frag
  put(job.fill_light, glm::normalize(glm::dvec3(0.80, 0.05, 0.45)));
  put(job.up, glm::dvec3(view.eye_from_world * glm::dvec4(0, 1, 0, 0)));
  const auto cast =
      options_.mode == CastMode::iso ? options_.kernels->iso : options_.kernels->blend;
  // Tiles stand where they stand in the whole picture, so that blocks of pixels stay whole.
  const auto first = [](std::int32_t at) { return at / kTile * kTile; };
  tiles_.clear();
  for (const PixelRect& part : parts) {
    for (std::int32_t y = first(part.y0); y < part.y1; y += kTile) {
      for (std::int32_t x = first(part.x0); x < part.x1; x += kTile) {
        tiles_.push_back(PixelRect{x, y, x + kTile, y + kTile}.clipped(part));
      }
    }
  }
  pool_.run(static_cast<std::uint32_t>(tiles_.size()),
            [&](std::uint32_t tile) { cast(job, tiles_[tile]); });
}

int TilePool::default_workers() {
  return static_cast<int>(allowed_cores().size()) - 1;
}

TilePool::TilePool(int workers) {
  try {
    for (int i = 0; i < workers; ++i) workers_.emplace_back([this] { wait_for_work(); });
  } catch (const std::system_error&) {
    // No thread is left: those that are there, or the caller alone, do the work.
  }
}

TilePool::~TilePool() {
  round_.fetch_add(1);
  round_.notify_all();
}

void TilePool::run(std::uint32_t count, const std::function<void(std::uint32_t)>& work) {
  work_ = &work;
  count_ = count;
  next_ = 0;
  busy_ = static_cast<std::uint32_t>(workers_.size());
  round_.fetch_add(2);
  round_.notify_all();
  take_pieces();
  for (std::uint32_t busy = busy_; busy != 0; busy = busy_) busy_.wait(busy);
}

void TilePool::wait_for_work() {
  std::uint32_t round = 0;
  while (true) {
    round_.wait(round);
    round = round_;
    if (round % 2 != 0) return;
    take_pieces();
    if (busy_.fetch_sub(1) == 1) busy_.notify_all();
  }
}

void TilePool::take_pieces() {
  for (std::uint32_t i = next_++; i < count_; i = next_++) (*work_)(i);
}

}  // namespace kerf
