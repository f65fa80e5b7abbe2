// SPDX-License-Identifier: Apache-2.0
// Depth and normals of a headless run against a ball by its formula.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "shared/posix/atomic_file.hpp"
#include "shared/segment/server.hpp"
#include "tests/support/temporary_folder.hpp"
#include "visualizer/app/options.hpp"
#include "visualizer/app/run.hpp"
#include "visualizer/gl/context.hpp"
#include "visualizer/picture/image_files.hpp"
#include "visualizer/render/renderer.hpp"
#include "visualizer/scene/visualizer_error.hpp"

namespace kerf::aov_test {

namespace fs = std::filesystem;

namespace {

constexpr VoxelGrid kGrid{40, 40, 40};
constexpr double kEdgeMm = 0.5, kRadiusMm = 7.0;
const glm::dvec3 kBallMm(3.0, -2.0, 5.0);
const glm::dvec3 kToolMm = kBallMm + glm::dvec3(0.0, 8.5, 0.0);
constexpr const char* kScene = R"({
  "volumes": [{"name": "ball", "solid": true}],
  "tools": [{"name": "peak", "profile": [[-1, 0], [0, 1], [1, 0]]}],
  "materials": [{"name": "none", "iso": 0, "colour": [0, 0, 0]},
                {"name": "bone", "iso": 0.3, "colour": [0.8, 0.7, 0.5]}]})";

/// A ball whose border is antialiased over two voxels, in a volume that is turned by a third of a
/// turn about (1, 1, 1): x, y, z of its voxels are y, z, x of the world.
class Ball {
 public:
  Ball()
      : density_(kGrid.voxel_count()),
        writer_(SegmentWriter::create(spec())),
        server_("test", writer_) {
    writer_.set_lifecycle(Lifecycle::run);
    writer_.begin_tick(1);
    TickRecord record{};
    record.tick = 1;
    record.start_ns = 1;
    record.flags = kFlagStarted;
    for (int i = 0; i < 3; ++i) record.position_mm[i] = static_cast<float>(kToolMm[i]);
    record.orientation[3] = 1.0F;
    writer_.publish_state(record);
    writer_.end_tick(record.start_ns);
    writer_.set_lifecycle(Lifecycle::clean_end);
  }

 private:
  SegmentSpec spec() {
    constexpr double kMiddle = 19.5;
    for (int z = 0; z < kGrid.nz; ++z) {
      for (int y = 0; y < kGrid.ny; ++y) {
        for (int x = 0; x < kGrid.nx; ++x) {
          const double r = std::hypot(x - kMiddle, y - kMiddle, z - kMiddle);
          const double full = std::clamp(0.5 + 0.5 * (kRadiusMm / kEdgeMm - r), 0.0, 1.0);
          density_[kGrid.index(x, y, z)] = static_cast<Density>(std::lround(full * kDensityMax));
        }
      }
    }
    SegmentVolumeSpec volume;
    volume.grid = kGrid;
    volume.density = density_;
    volume.iso = 32768;
    for (std::size_t i = 0; i < 3; ++i) {
      volume.spacing_mm[i] = kEdgeMm;
      volume.origin_mm[i] = kBallMm[static_cast<int>(i)] - kMiddle * kEdgeMm;
      volume.orientation[i] = 0.5;
    }
    volume.orientation[3] = 0.5;
    SegmentSpec spec;
    spec.volumes = {volume};
    spec.scene_json = kScene;
    return spec;
  }

  std::vector<Density> density_;
  SegmentWriter writer_;
  SegmentServer server_;
};

/// The floats of a file of NumPy, whose header has this shape.
std::vector<float> floats_in(const fs::path& file, const std::string& shape) {
  const std::string bytes = test::text_of(file);
  REQUIRE(bytes.size() > 10);
  CHECK(bytes.substr(0, 8) == std::string("\x93NUMPY\x01\x00", 8));
  const std::size_t head =
      static_cast<unsigned char>(bytes[8]) + 256U * static_cast<unsigned char>(bytes[9]);
  CHECK((10 + head) % 64 == 0);
  CHECK(bytes.substr(10, head).starts_with(
      "{'descr': '<f4', 'fortran_order': False, 'shape': " + shape + ", }"));
  std::vector<float> values((bytes.size() - 10 - head) / sizeof(float));
  std::memcpy(values.data(), bytes.data() + 10 + head, values.size() * sizeof(float));
  return values;
}

/// Where the ray of a pixel first meets the ball: how far along the view, and the normal there.
struct Hit {
  double depth_mm;
  glm::dvec3 normal;
  double facing;  ///< cosine between the normal and the ray back
};
std::optional<Hit> hit_of(const CameraPose& pose, PictureSize size, int x, int y) {
  const double tangent = std::tan(14.0 / 180.0 * 3.14159265358979);
  const glm::dvec3 forward = glm::normalize(pose.target_mm - pose.eye_mm);
  const glm::dvec3 right = glm::normalize(glm::cross(forward, pose.up));
  const glm::dvec3 up = glm::cross(right, forward);
  const double across = tangent * size.width / size.height;
  const glm::dvec3 ray = forward + right * (across * (2.0 * (x + 0.5) / size.width - 1.0)) +
                         up * (tangent * (1.0 - 2.0 * (y + 0.5) / size.height));
  const glm::dvec3 from = pose.eye_mm - kBallMm;
  const double a = glm::dot(ray, ray), b = glm::dot(ray, from);
  const double c = glm::dot(from, from) - kRadiusMm * kRadiusMm;
  if (b * b - a * c < 0.0) return std::nullopt;
  const double t = (-b - std::sqrt(b * b - a * c)) / a;
  const glm::dvec3 normal = (from + t * ray) / kRadiusMm;
  return Hit{t, normal, -glm::dot(normal, glm::normalize(ray))};
}

}  // namespace

TEST_CASE("depth and normals of a ball are those of its formula, by each renderer of surfaces") {
  try {
    static_cast<void>(make_headless_context());
  } catch (const VisualizerError&) {
    MESSAGE("skipped: there is no OpenGL 4.5 context here");
    return;
  }
  for (const char* renderer : {"iso", "surface", "cast"}) {
    CAPTURE(renderer);
    const test::RuntimeFolder place;
    const Ball ball;
    VisualizerOptions options;
    options.name = "test";
    options.headless = true;
    options.size = {120, 90};
    options.frames = 1;
    options.out = place / "out";
    options.settings.renderer = renderer;
    options.settings.camera = CameraPose{{20.0, 18.0, 38.0}, kBallMm, {0.3, 1.0, 0.0}};
    options.aov = {.depth = true, .normal = true};
    REQUIRE(run_headless(options) == 0);
    const auto depth = floats_in(options.out / "frame-0001-depth.npy", "(90, 120)");
    const auto normal = floats_in(options.out / "frame-0001-normal.npy", "(90, 120, 3)");
    REQUIRE(depth.size() == 90 * 120);
    REQUIRE(normal.size() == 3 * depth.size());
    int seen = 0, air = 0, tool = 0, elsewhere = 0;
    double worst_mm = 0.0, worst_degrees = 0.0;
    for (int y = 0; y < options.size.height; ++y) {
      for (int x = 0; x < options.size.width; ++x) {
        const auto i = static_cast<std::size_t>(y * options.size.width + x);
        const glm::dvec3 n(normal[3 * i], normal[3 * i + 1], normal[3 * i + 2]);
        if (std::isinf(depth[i])) CHECK(n == glm::dvec3(0.0));
        if (std::isfinite(depth[i])) CHECK(glm::length(n) == doctest::Approx(1.0).epsilon(1e-5));
        const auto hit = hit_of(*options.settings.camera, options.size, x, y);
        if (!hit) {
          // The tool stands above the ball.
          (std::isinf(depth[i]) ? air : tool) += 1;
        } else if (std::isinf(depth[i]) || std::abs(depth[i] - hit->depth_mm) > 1.0) {
          ++elsewhere;  // the border of the ball, and its part behind the shank
        } else if (hit->facing > 0.2) {
          ++seen;
          worst_mm = std::max(worst_mm, std::abs(depth[i] - hit->depth_mm) * hit->facing);
          worst_degrees =
              std::max(worst_degrees, std::acos(std::min(glm::dot(n, hit->normal), 1.0)) * 57.3);
        }
      }
    }
    CAPTURE(worst_mm);
    CAPTURE(worst_degrees);
    CHECK(seen > 1500);
    CHECK(air > 2000);
    CHECK(tool > 20);
    CHECK(elsewhere < 120);
    CHECK(worst_mm < 0.02);
    CHECK(worst_degrees < 2.0);
  }
}

TEST_CASE("depths and normals are of headless pictures, and normals of surfaces") {
  const auto parse = [](std::vector<const char*> words) {
    words.insert(words.begin(), "kerf-visualizer");
    return parse_options(static_cast<int>(words.size()), words.data());
  };
  const auto both = parse({"--headless", "--aov", "depth,normal"});
  CHECK(both->aov.depth);
  CHECK(both->aov.normal);
  CHECK(parse({"--headless", "--aov", "depth", "--renderer", "blend"})->aov.depth);
  CHECK_FALSE(parse({"--headless", "--aov", "depth"})->aov.normal);
  CHECK_FALSE(parse({"--headless"})->aov.any());
  CHECK(parse({"--headless", "--aov", "depth", "--record", "a.y4m"})->frames == 10);
  const auto refused = [&](std::vector<const char*> words, const char* wanted) {
    CHECK_THROWS_WITH_AS(parse(std::move(words)), doctest::Contains(wanted), VisualizerError);
  };
  refused({"--headless", "--aov", "depht"},
          "--aov: depht is unknown; did you mean depth? known: depth, normal");
  refused({"--headless", "--aov", "depth,depth"}, "--aov: depth is there twice; leave one out");
  refused({"--headless", "--aov", "normal", "--renderer", "iso,blend"},
          "--aov: normal: blend shows many depths in one pixel; ");
  refused({"--headless", "--aov", "depth", "--stereo"},
          "--aov: --stereo has two pictures in one; ");
  CHECK_THROWS_AS(parse({"--aov", "depth"}), VisualizerError);
}

}  // namespace kerf::aov_test
