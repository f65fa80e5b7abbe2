// SPDX-License-Identifier: Apache-2.0

#include "visualizer/bench/picture_bench.hpp"

#include <array>
#include <cstdio>
#include <numbers>
#include <random>

#include <glm/gtc/matrix_access.hpp>
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
#include "visualizer/cast/cast_kernels.hpp"
#include "visualizer/gl/context.hpp"
#include "visualizer/redraw/redraw_tiles.hpp"
#include "visualizer/render/iso_renderer.hpp"
#include "visualizer/render/renderer.hpp"
#include "visualizer/scene/frame_report.hpp"

namespace kerf {

namespace {

constexpr int kSide = 80;  // no gradient looks from the ball beyond it
constexpr double kRadius = 28.0;
constexpr double kNoise = 0.015;        // of full density; standard deviation
constexpr double kLeastFacing = 0.342;  // sine of 20 degrees
constexpr double kRim = 5.0;            // voxels of a hollow that belong to its rim
constexpr PictureSize kSize{256, 256};

/// A volume with voxels of 1 x 1 x `thick` mm around the origin, and the eye.
struct BallStage {
  SceneView scene;
  View view;
  glm::dvec3 towards{};  ///< the eye, of length 1

  explicit BallStage(int thick = 1) {
    VolumeView& volume = scene.volumes.emplace_back();
    volume.bricks = BrickGrid::of({kSide, kSide, kSide / thick});
    const glm::dvec3 edges_mm(1.0, 1.0, thick);
    const glm::dvec3 first_mm = -0.5 * (glm::dvec3(kSide, kSide, kSide) - edges_mm);
    volume.world_from_voxel = glm::scale(glm::translate(glm::dmat4(1.0), first_mm), edges_mm);
    OrbitCamera camera;
    camera.frame(scene.corners(), 1.0);
    view = camera.view(1.0, 2.0 * kSide);
    towards = glm::normalize(glm::dvec3(glm::row(view.eye_from_world, 2)));
  }

  /// `fraction(at)` of full density at each voxel, 0..1.
  template <class Fraction>
  [[nodiscard]] std::vector<Density> filled(const Fraction& fraction) const {
    const VolumeView& volume = scene.volumes.front();
    std::vector<Density> density;
    for_each_voxel(volume.bricks.grid.box(), [&](int x, int y, int z) {
      const glm::dvec3 at(volume.world_from_voxel * glm::dvec4(x, y, z, 1.0));
      const double value = std::clamp(fraction(at), 0.0, 1.0);
      density.push_back(static_cast<Density>(std::lround(value * kDensityMax)));
    });
    return density;
  }
};

/// A border is antialiased over two voxels.
double antialiased(double distance) {
  return std::clamp(0.5 - 0.5 * distance, 0.0, 1.0);
}

std::vector<Density> ball(const BallStage& stage, double noise) {
  std::mt19937 random(1);
  const glm::dvec3 edges_mm = stage.scene.volumes.front().edges_mm();
  return stage.filled([&](const glm::dvec3& at) {
    // A sum of twelve has the variance 1 and, unlike the library's, the same bits everywhere.
    double normal = 0.0;
    for (int k = 0; k < 12 && noise > 0.0; ++k) {
      normal += static_cast<double>(random()) * 0x1p-32 - 0.5;
    }
    // Two voxels along the normal.
    const double voxels = glm::length(glm::normalize(at) * edges_mm);
    return antialiased((glm::length(at) - kRadius) / voxels) + noise * normal;
  });
}

/// Half a ball milled out of a block. A tool that stays takes voxels of overlap c down to exp(-k
/// c): those that it covers by more than a little are empty, all others full (docs/forces.md 7.5).
std::vector<Density> hollow(const BallStage& stage) {
  constexpr double kDwell = 30.0;
  return stage.filled([&](const glm::dvec3& at) {
    const double overlap = std::clamp(0.5 - (glm::length(at) - kRadius), 0.0, 1.0);
    return std::min(antialiased(glm::dot(at, stage.towards)), std::exp(-kDwell * overlap));
  });
}

/// Degrees between the shader's normal and that of the ball at the point that a pixel shows.
struct Angles {
  double rms = 0.0, p99 = 0.0;
};

Angles angles_of(BallStage stage, GradientFilter gradient, const std::vector<Density>& density,
                 bool is_hollow) {
  stage.scene.gradient = gradient;
  const View& view = stage.view;
  const VolumeContent content{density, {}};
  IsoRenderer renderer(stage.scene, {&content, 1}, {.light = "normals.frag"});
  const RenderTarget target(kSize);
  target.bind();
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  renderer.draw(view, target);
  const std::vector<std::uint8_t> rgb = target.read_rgb();
  const std::vector<float> depth = target.read_depth();
  const glm::dvec3 centre(view.eye_from_world * glm::dvec4(0.0, 0.0, 0.0, 1.0));
  const double span_mm = view.far_mm - view.near_mm;
  double sum = 0.0;
  std::vector<double> angles;
  for (std::size_t i = 0; i < depth.size(); ++i) {
    if (depth[i] >= 1.0F) continue;
    const glm::dvec2 pixel(i % kSize.width, i / kSize.width);
    const glm::dvec2 ndc = (2.0 * pixel + 1.0) / glm::dvec2(kSize.width, kSize.height) - 1.0;
    const glm::dvec3 ray(ndc.x * view.tan_half_height, -ndc.y * view.tan_half_height, -1.0);
    // Equation (1) of the paper, for t.
    const double eye_mm =
        view.far_mm * view.near_mm / (view.far_mm - static_cast<double>(depth[i]) * span_mm);
    const glm::dvec3 from_centre = eye_mm * ray - centre;
    // Around the hollow lie the block's own faces.
    const bool beside = std::abs(glm::length(from_centre) - kRadius) > 2.0;
    if (is_hollow && (beside || from_centre.z > -kRim)) continue;
    const glm::dvec3 normal = glm::normalize(from_centre) * (is_hollow ? -1.0 : 1.0);
    if (-glm::dot(normal, glm::normalize(ray)) < kLeastFacing) continue;
    const double off = glm::length(shown_normal(&rgb[3 * i]) - normal);
    angles.push_back(2.0 * std::asin(0.5 * std::min(off, 2.0)) * 180.0 / std::numbers::pi);
    sum += angles.back() * angles.back();
  }
  const double rms = std::sqrt(sum / static_cast<double>(angles.size()));
  return {rms, percentile(angles, 0.99)};
}

}  // namespace

std::vector<GradientRow> measure_gradients() {
  const BallStage stage;
  const std::vector<Density> clean = ball(stage, 0.0), noisy = ball(stage, kNoise);
  const std::vector<Density> milled = hollow(stage);
  const BallStage of_2(2), of_5(5), of_10(10);
  const std::vector<Density> thick_2 = ball(of_2, 0.0), thick_5 = ball(of_5, 0.0),
                             thick_10 = ball(of_10, 0.0);
  std::vector<GradientRow> rows;
  for (std::size_t i = 0; i < kGradientNames.size(); ++i) {
    const auto gradient = static_cast<GradientFilter>(i);
    const Angles of_ball = angles_of(stage, gradient, clean, false);
    const Angles of_hollow = angles_of(stage, gradient, milled, true);
    rows.push_back({gradient, of_ball.rms, angles_of(stage, gradient, noisy, false).rms,
                    of_ball.p99, of_hollow.rms, of_hollow.p99,
                    angles_of(of_2, gradient, thick_2, false).p99,
                    angles_of(of_5, gradient, thick_5, false).p99,
                    angles_of(of_10, gradient, thick_10, false).p99});
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
      renderer_->mark_redraw(0, {tooth_.view(), view_, target_}, tiles);
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
  for (const GradientFilter gradient :
       {GradientFilter::central, GradientFilter::corners, GradientFilter::farid5}) {
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
                         {"noisy_angle_deg", row.noisy_angle_deg},
                         {"p99_deg", row.p99_deg},
                         {"milled_angle_deg", row.milled_angle_deg},
                         {"milled_p99_deg", row.milled_p99_deg},
                         {"thick_2_p99_deg", row.thick_2_p99_deg},
                         {"thick_5_p99_deg", row.thick_5_p99_deg},
                         {"thick_10_p99_deg", row.thick_10_p99_deg}});
  }
  const Json report{{"day", today()},
                    {"gl_renderer", figures.gl_renderer},
                    {"processor", processor_name()},
                    {"cores", figures.cores},
                    {"cast_set", cast_kernels()[0]->name},
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
  if (options.page) {
    write_page_part(*options.page, "pictures", make_report({"pictures", "page"}, report));
  }
  std::printf("%s\n%s", figures.gl_renderer.c_str(),
              make_report({"pictures", "tables"}, report).c_str());
  return 0;
}

}  // namespace kerf
