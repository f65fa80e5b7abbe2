// SPDX-License-Identifier: Apache-2.0

#include "visualizer/bench/picture_bench.hpp"

#include <array>
#include <cstdio>
#include <numbers>
#include <random>

#include <glm/gtc/matrix_transform.hpp>
#include <unistd.h>

#include "shared/numeric/statistics.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/posix/program.hpp"
#include "shared/posix/report_tool.hpp"
#include "shared/posix/stop_signals.hpp"
#include "shared/text/json.hpp"
#include "visualizer/app/run.hpp"
#include "visualizer/bench/bench_tooth.hpp"
#include "visualizer/gl/context.hpp"
#include "visualizer/redraw/changed_cells.hpp"
#include "visualizer/render/iso_renderer.hpp"
#include "visualizer/render/renderer.hpp"
#include "visualizer/scene/frame_report.hpp"

namespace kerf {

namespace {

constexpr int kSide = 64;
constexpr double kRadius = 28.0;
constexpr double kNoise = 0.015;        // of full density; standard deviation
constexpr double kLeastFacing = 0.342;  // sine of 20 degrees
constexpr PictureSize kSize{256, 256};

/// Voxels of 1 mm with the ball in their middle.
std::vector<Density> ball(double noise) {
  std::mt19937 random(1);
  std::vector<Density> density;
  for (int i = 0; i < kSide * kSide * kSide; ++i) {
    const glm::dvec3 at(i % kSide, i / kSide % kSide, i / kSide / kSide);
    const double distance = glm::length(at - 0.5 * (kSide - 1)) - kRadius;
    // A sum of twelve has the variance 1 and, unlike the library's, the same bits everywhere.
    double normal = 0.0;
    for (int k = 0; k < 12 && noise > 0.0; ++k) {
      normal += static_cast<double>(random()) * 0x1p-32 - 0.5;
    }
    const double fraction = std::clamp(0.5 - 0.5 * distance, 0.0, 1.0) + noise * normal;
    density.push_back(
        static_cast<Density>(std::lround(std::clamp(fraction, 0.0, 1.0) * kDensityMax)));
  }
  return density;
}

double angle_deg(GradientFilter gradient, const std::vector<Density>& density) {
  SceneView scene;
  scene.gradient = gradient;
  VolumeView& volume = scene.volumes.emplace_back();
  volume.bricks = BrickGrid::of({kSide, kSide, kSide});
  volume.world_from_voxel = glm::translate(glm::dmat4(1.0), glm::dvec3(-0.5 * (kSide - 1)));
  const VolumeContent content{density, {}};
  IsoRenderer renderer(scene, {&content, 1}, {.light = "normals.frag"});
  OrbitCamera camera;
  camera.frame(scene.corners(), 1.0);
  const View view = camera.view(1.0, 2.0 * kSide);
  const RenderTarget target(kSize);
  target.bind();
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  renderer.draw(view, target);
  const std::vector<std::uint8_t> rgb = target.read_rgb();

  const glm::dvec3 centre(view.eye_from_world * glm::dvec4(0.0, 0.0, 0.0, 1.0));
  double sum = 0.0;
  int pixels = 0;
  for (int y = 0; y < kSize.height; ++y) {
    for (int x = 0; x < kSize.width; ++x) {
      const glm::dvec2 ndc((2.0 * x + 1.0) / kSize.width - 1.0,
                           1.0 - (2.0 * y + 1.0) / kSize.height);
      const glm::dvec3 ray = glm::normalize(glm::dvec3(ndc * view.tan_half_height, -1.0));
      const double middle = glm::dot(ray, centre);
      const double inside = kRadius * kRadius - glm::dot(centre, centre) + middle * middle;
      if (inside < 0.0) continue;
      const glm::dvec3 normal = ((middle - std::sqrt(inside)) * ray - centre) / kRadius;
      if (-glm::dot(normal, ray) < kLeastFacing) continue;
      const glm::dvec3 seen = shown_normal(&rgb[3 * static_cast<std::size_t>(y * kSize.width + x)]);
      const double angle = 2.0 * std::asin(0.5 * std::min(glm::length(seen - normal), 2.0));
      sum += angle * angle;
      ++pixels;
    }
  }
  return std::sqrt(sum / pixels) * 180.0 / std::numbers::pi;
}

}  // namespace

std::vector<GradientRow> measure_gradients() {
  const std::vector<Density> clean = ball(0.0), noisy = ball(kNoise);
  std::vector<GradientRow> rows;
  for (std::size_t i = 0; i < kGradientNames.size(); ++i) {
    const auto gradient = static_cast<GradientFilter>(i);
    rows.push_back({gradient, angle_deg(gradient, clean), angle_deg(gradient, noisy)});
  }
  return rows;
}

namespace {

constexpr auto kBenchVolumes = std::to_array<VoxelGrid>({{128, 128, 80}, {256, 256, 161}});
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
  static SceneView scene_of(const BenchTooth& tooth, GradientFilter gradient) {
    SceneView scene = tooth.scene();
    scene.gradient = gradient;
    return scene;
  }

  Stopwatch frame(const Change& change) {
    ChangedBricks cut;
    if (change.tool > 0) cut = tooth_.cut(change.tool);
    Stopwatch watch;
    if (!cut.empty()) renderer_->update(0, tooth_.density(), cut);
    target_.restrict_to(target_.all());
    if (change.partial) {
      RedrawTiles tiles(target_.size());
      renderer_->mark_redraw(0, {tooth_.view(), tooth_.density(), view_, target_}, tiles);
      target_.restrict_to(tiles.rects());
    }
    renderer_->forget_changes();
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
  for (const VoxelGrid& volume : kBenchVolumes) {
    for (const bool cropped : {false, true}) {
      for (const std::string_view kind : renderer_kinds()) {
        rows.push_back({.renderer = std::string(kind), .volume = volume, .cropped = cropped});
      }
    }
  }
  for (const GradientFilter gradient : {GradientFilter::central, GradientFilter::farid5}) {
    rows.push_back({.renderer = "iso", .gradient = gradient, .volume = kBenchVolumes.back()});
  }
  return rows;
}

/// 256x256x161.
std::string grid_name(const VoxelGrid& grid) {
  return std::to_string(grid.nx) + "x" + std::to_string(grid.ny) + "x" + std::to_string(grid.nz);
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

std::string picture_report(const PictureFigures& figures) {
  Json rows = Json::List{};
  for (const PictureRow& row : figures.rows) {
    rows.push_back({{"renderer", row.renderer},
                    {"gradient", name_of(row.gradient)},
                    {"volume", grid_name(row.volume)},
                    {"tool", row.tool},
                    {"modifying", row.tool > 0},
                    {"cropped", row.cropped},
                    {"partial", row.partial},
                    {"fps", row.fps()},
                    {"cpu_ms", row.cpu_ms},
                    {"wall_ms_p50", row.wall_ms_p50},
                    {"wall_ms_p99", row.wall_ms_p99}});
  }
  Json gradients = Json::List{};
  for (const GradientRow& row : figures.gradients) {
    gradients.push_back({{"gradient", name_of(row.gradient)},
                         {"angle_deg", row.angle_deg},
                         {"noisy_angle_deg", row.noisy_angle_deg}});
  }
  const Json report{{"day", today()},
                    {"gl_renderer", figures.gl_renderer},
                    {"processor", processor_name()},
                    {"cores", figures.cores},
                    {"width", figures.size.width},
                    {"height", figures.size.height},
                    {"rows", std::move(rows)},
                    {"gradients", std::move(gradients)}};
  return report.document();
}

int run_bench(const VisualizerOptions& options) {
  // A wrong name costs nothing; a run that is stopped leaves nothing behind.
  check_files(options);
  PictureFigures figures;
  figures.size = options.size;
  figures.cores = place_process(options.cpus).size();
  const auto context = make_headless_context();
  figures.gl_renderer = query_gl_driver().renderer;
  const bool terminal = isatty(STDERR_FILENO) == 1;
  const auto progress = [&](const std::string& next, int done, int all) {
    if (terminal) std::fprintf(stderr, "\r\033[K%3d of %d: %s", done, all, next.c_str());
  };
  figures.gradients = measure_gradients();
  figures.rows = measure_pictures(options.size, progress);
  if (terminal) std::fputs("\r\033[K", stderr);
  if (stop_requested()) {
    std::fputs("kerf-visualizer: --bench: stopped; no figures are written\n", stderr);
    return 1;
  }
  const std::string report = picture_report(figures);
  if (options.report) write_new_file(*options.report, report);
  if (options.page) write_new_file(*options.page, make_report({"pictures", "page"}, report));
  if (options.summary) {
    write_page_part(*options.summary, "pictures", make_report({"pictures", "summary"}, report));
  }
  std::printf("%s\n%s", figures.gl_renderer.c_str(),
              make_report({"pictures", "tables"}, report).c_str());
  return 0;
}

}  // namespace kerf
