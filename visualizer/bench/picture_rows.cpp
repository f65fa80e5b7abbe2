// SPDX-License-Identifier: Apache-2.0
#include "visualizer/bench/picture_rows.hpp"

#include <array>

#include "visualizer/bench/bench_tooth.hpp"
#include "visualizer/frame_report.hpp"
#include "visualizer/renderer.hpp"
#include "visualizer/stale_volume.hpp"
#include "visualizer/stop_signal.hpp"

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
  Stage(std::string_view renderer, const BenchTooth& tooth, PictureSize size)
      : tooth_(tooth),
        renderer_(make_renderer(renderer, tooth_.scene(), std::array{tooth_.content()})),
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

}  // namespace

std::vector<PictureRow> measure_pictures(
    PictureSize size,
    const std::function<void(const std::string& next, int done, int all)>& progress) {
  const std::vector<std::string_view> kinds = renderer_kinds();
  constexpr std::size_t kTeeth = 2 * kVolumes.size();
  const int all = static_cast<int>(kTeeth * kinds.size() * kChanges.size());
  std::vector<PictureRow> rows;
  for (const VoxelGrid& volume : kVolumes) {
    for (const bool cropped : {false, true}) {
      const BenchTooth tooth(volume, cropped);
      for (const std::string_view kind : kinds) {
        for (const Change& change : kChanges) {
          if (stop_requested()) return rows;
          PictureRow row{.renderer = std::string(kind),
                         .volume = volume,
                         .tool = change.tool,
                         .modifying = change.tool > 0,
                         .cropped = cropped,
                         .partial = change.partial};
          progress(row.renderer, static_cast<int>(rows.size()), all);
          Stage(kind, tooth, size).measure(change, row);  // each cuts a whole tooth
          rows.push_back(row);
        }
      }
    }
  }
  return rows;
}

}  // namespace kerf
