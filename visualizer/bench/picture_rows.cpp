// SPDX-License-Identifier: Apache-2.0
#include "visualizer/bench/picture_rows.hpp"

#include <array>

#include "shared/numeric/percentile.hpp"
#include "shared/posix/stop_signals.hpp"
#include "visualizer/bench/bench_tooth.hpp"
#include "visualizer/compose/stale_volume.hpp"
#include "visualizer/render/renderer.hpp"
#include "visualizer/view/frame_report.hpp"

namespace kerf {

namespace {

constexpr auto kVolumes = std::to_array<VoxelGrid>({{128, 128, 80}, {256, 256, 161}});
constexpr int kMostFrames = 10, kLeastFrames = 3;
constexpr double kEnoughMs = 700.0;  // of one kind of frame, once it has the least

struct Change {
  int tool;
  bool partial;
};
constexpr auto kChanges =
    std::to_array<Change>({{0, false}, {10, false}, {10, true}, {16, false}, {16, true}});

/// One renderer on one tooth, which fills the picture.
class Stage {
 public:
  Stage(const PictureRow& row, const BenchTooth& tooth, PictureSize size)
      : tooth_(tooth),
        renderer_(make_renderer(row.renderer, scene_of(tooth_, row.gradient),
                                std::array{tooth_.content()})),
        target_(size) {
    const BoxCorners box = tooth_.view().corners();
    OrbitCamera camera;
    const double aspect = static_cast<double>(size.width) / size.height;
    camera.frame(tooth_.looked_at(), aspect);
    view_ = camera.view(aspect, glm::length(box.back() - box.front()));
  }

  /// Fills the times in.
  void measure(const Change& change, PictureRow& row) {
    // Shaders, threads and textures are made at their first use; a part changes a whole picture.
    frame({.tool = 0, .partial = false});
    frame(change);
    std::vector<double> cpu_ms, wall_ms;
    const Stopwatch whole;
    for (int i = 0; i < kMostFrames && !stop_requested(); ++i) {
      if (i >= kLeastFrames && whole.wall_ms() > kEnoughMs) break;
      const Stopwatch watch = frame(change);
      cpu_ms.push_back(watch.cpu_ms());
      wall_ms.push_back(watch.wall_ms());
    }
    row.cpu_ms = percentile(cpu_ms, 0.5);
    row.wall_ms_p50 = percentile(wall_ms, 0.5);
    row.wall_ms_p99 = percentile(wall_ms, 0.99);
  }

 private:
  static SceneView scene_of(const BenchTooth& tooth, Gradient gradient) {
    SceneView scene = tooth.scene();
    scene.gradient = gradient;
    return scene;
  }

  Stopwatch frame(const Change& change) {
    BenchCut cut;
    if (change.tool > 0) cut = tooth_.cut(change.tool);
    Stopwatch watch;
    if (!cut.bricks.empty()) renderer_->update(0, tooth_.density(), cut.bricks);
    target_.restrict_to(target_.all());
    if (change.partial) {
      StaleVolume stale;
      stale.add(*renderer_, 0, cut.differs);
      StaleTiles tiles(target_.size());
      stale.mark(tiles, *renderer_, tooth_.view(), tooth_.density(), view_, target_);
      target_.restrict_to(tiles.rects());
    }
    target_.bind();
    target_.for_parts([] { glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT); });
    renderer_->draw(view_, target_);
    glFinish();
    return watch;
  }

  BenchTooth tooth_;
  std::unique_ptr<Renderer> renderer_;
  RenderTarget target_;
  View view_;
};

/// What is measured, without figures: one of each renderer and volume.
std::vector<PictureRow> subjects() {
  std::vector<PictureRow> rows;
  for (const VoxelGrid& volume : kVolumes) {
    for (const bool cropped : {false, true}) {
      for (const std::string_view kind : renderer_kinds()) {
        rows.push_back({.renderer = std::string(kind), .volume = volume, .cropped = cropped});
      }
    }
  }
  for (const Gradient gradient : {Gradient::central, Gradient::farid5}) {
    rows.push_back({.renderer = "iso", .gradient = gradient, .volume = kVolumes.back()});
  }
  return rows;
}

}  // namespace

std::vector<PictureRow> measure_pictures(
    PictureSize size,
    const std::function<void(const std::string& next, int done, int all)>& progress) {
  const std::vector<PictureRow> all_subjects = subjects();
  const int all = static_cast<int>(all_subjects.size() * kChanges.size());
  std::vector<PictureRow> rows;
  for (const PictureRow& subject : all_subjects) {
    const BenchTooth tooth(subject.volume, subject.cropped);
    for (const Change& change : kChanges) {
      if (stop_requested()) return rows;
      PictureRow row = subject;
      row.tool = change.tool;
      row.partial = change.partial;
      progress(row.renderer, static_cast<int>(rows.size()), all);
      Stage(row, tooth, size).measure(change, row);  // each cuts a whole tooth
      rows.push_back(row);
    }
  }
  return rows;
}

}  // namespace kerf
