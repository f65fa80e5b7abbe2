// SPDX-License-Identifier: Apache-2.0
// The ray caster on the processor, without any GL: against analytic bodies, and against itself.
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <random>
#include <string_view>

#include <doctest/doctest.h>
#include <glm/gtc/matrix_transform.hpp>

#include "shared/numeric/hidden_set.hpp"
#include "tests/visualizer/gl/gl_fixture.hpp"
#include "tests/visualizer/render/exact_body.hpp"
#include "tests/visualizer/render/renderer_fixture.hpp"
#include "visualizer/cast/caster.hpp"
#include "visualizer/scene/visualizer_error.hpp"

namespace kerf::cast_test {

using namespace kerf::test;

namespace {

constexpr PictureSize kSize{101, 83};  // no multiple of a packet, a block or a tile

/// Whether rays are cast with the instructions of that set, with gathers or without.
bool has_set(std::string_view name) {
  const CastKernels* const* set = cast_kernels();
  while (*set != nullptr && !std::string_view((*set)->name).starts_with(name)) ++set;
  return *set != nullptr;
}

struct Cast {
  CastPicture picture;
  std::vector<float> normals;
};

Cast cast(Caster& caster, const View& view) {
  Cast cast;
  cast.picture.resize(kSize.width, kSize.height);
  cast.normals.resize(3 * cast.picture.depth.size());
  caster.draw(view, cast.picture.whole(), cast.picture, {}, cast.normals);
  return cast;
}

constexpr double kOpacity = 0.1;

/// Translucent, by density and by label.
TransferFunction transfer(std::span<const MaterialView> materials = {}) {
  TransferFunction made{.materials = make_palette(materials), .empty = 0.2, .full = 0.5};
  for (glm::vec4& material : made.materials[0]) material.w = static_cast<float>(kOpacity);
  for (glm::vec4& material : made.materials[1]) material.w = 0.33F;
  return made;
}

Caster caster_of(std::initializer_list<const TestVolume*> volumes,
                 const Caster::Options& options = {}) {
  SceneView scene;
  scene.gradient = GradientFilter::corners;  // the others are wider than the coarsest ramp
  std::vector<CastContent> contents;
  for (const TestVolume* volume : volumes) {
    scene.volumes.push_back(volume->view);
    contents.push_back({volume->density, {}, transfer()});
  }
  return {scene, contents, options};
}

Caster::Options blending(float step_vox = 0.75F) {
  Caster::Options options;
  options.mode = CastMode::blend;
  options.step_vox = step_vox;
  return options;
}

constexpr double kRampMm = 3.0;

struct Errors {
  double depth_mm = 0.0;  ///< root mean square
  double normal = 0.0;
  int hits = 0;
};

Errors errors_at(const Distance& distance, double spacing_mm) {
  const int n = static_cast<int>(std::lround(12.0 / spacing_mm)) + 1;
  const VoxelGrid grid{n, n, n};
  const TestVolume volume(grid, centred(grid, glm::dvec3(spacing_mm)), body(distance, kRampMm));
  Caster caster = caster_of({&volume});
  const View view = look_at({7, 15, 19}, {}, 15, 40);
  const Cast drawn = cast(caster, view);
  Errors errors;
  for (int y = 0; y < kSize.height; ++y) {
    for (int x = 0; x < kSize.width; ++x) {
      const PixelRay ray = pixel_ray(view, kSize, x, y);
      const auto exact = exact_mm(distance, ray);
      if (!exact) continue;
      const glm::dvec3 normal = slope_of(distance, ray.origin_mm + *exact * ray.direction);
      if (-glm::dot(normal, glm::normalize(ray.direction)) < kLeastFacing) continue;
      const auto at = static_cast<std::size_t>((kSize.height - 1 - y) * kSize.width + x);
      REQUIRE(drawn.picture.depth[at] < 1.0F);
      const double off =
          eye_distance_mm(static_cast<double>(drawn.picture.depth[at]), view) - *exact;
      const glm::dvec3 seen(drawn.normals[3 * at], drawn.normals[3 * at + 1],
                            drawn.normals[3 * at + 2]);
      const glm::dvec3 wanted(view.eye_from_world * glm::dvec4(normal, 0.0));
      errors.depth_mm += off * off;
      errors.normal += glm::dot(seen - wanted, seen - wanted);
      ++errors.hits;
    }
  }
  errors.depth_mm = std::sqrt(errors.depth_mm / errors.hits);
  errors.normal = std::sqrt(errors.normal / errors.hits);
  return errors;
}

/// A heap of balls with two labels, and some voxels without one.
struct Heap {
  explicit Heap(unsigned seed) : volume(heap_of_balls(seed)) {
    for (std::size_t i = 0; i < volume.density.size(); ++i) {
      labels.push_back(static_cast<Label>(volume.density[i] == 0 ? 0 : i / 700 % 3));
    }
  }
  TestVolume volume;
  std::vector<Label> labels;
};

const std::array<View, 3> kViews{look_at({14, 9, 20}, {}, 10, 40),
                                 look_at({0.1, 0.2, 0.3}, {5, 2, 1}, 0.05, 30),
                                 look_at({-9, 9, 9}, {}, 5, 15)};

}  // namespace

TEST_CASE("N12: depth and normals of a ball and a torus are of second order in the voxel") {
  for (const Distance& distance : {Distance(ball_distance), Distance(torus_distance)}) {
    const Errors coarse = errors_at(distance, 0.4);
    const Errors middle = errors_at(distance, 0.2);
    const Errors fine = errors_at(distance, 0.1);
    CHECK(coarse.hits > 500);
    for (const double ratio : {coarse.depth_mm / middle.depth_mm, middle.depth_mm / fine.depth_mm,
                               coarse.normal / middle.normal}) {
      CHECK(std::log2(ratio) > 1.8);
      CHECK(std::log2(ratio) < 2.2);
    }
    // On the finest the two parts of a gradient across it are off by their rounding too, at steps
    // of 1/32767, where the gradient is the rise of the density over two edges.
    const double rounding = std::sqrt(2.0 / 12.0) / 32767.0 / (2.0 * 0.1 / kRampMm);
    CHECK(fine.normal < std::hypot(middle.normal / std::exp2(1.8), rounding));
    CHECK(fine.normal > middle.normal / std::exp2(2.2));
    CHECK(fine.depth_mm < 0.02 * 0.1);
  }
}

TEST_CASE("every instruction set gives the bits of one ray at a time") {
  for (const char* name : {"avx512", "avx2"}) {
    const bool here = has_set(name);
    CHECK(!(here && hidden_set(name)));
    if (!here) {
      std::printf("skipped: kernels of %s: not on this processor, or hidden by KERF_HIDE_SETS\n",
                  name);
    }
  }
  const Heap a(7);
  Heap b(8);
  b.volume.view.world_from_voxel =
      glm::rotate(glm::dmat4(1.0), 0.4, glm::dvec3(0, 1, 0)) * b.volume.view.world_from_voxel;
  SceneView scene;
  scene.volumes = {a.volume.view, b.volume.view};
  scene.materials = {
      {"none", 0.0, {}}, {"one", 0.3, {0.8, 0.6, 0.3}}, {"two", 0.7, {0.3, 0.6, 0.8}}};
  const std::array<CastContent, 2> contents{
      {{a.volume.density, a.labels, transfer(scene.materials)},
       {b.volume.density, {}, transfer(scene.materials)}}};
  for (const CastMode mode : {CastMode::iso, CastMode::blend}) {
    Caster::Options options = blending();
    options.mode = mode;
    options.kernels = &kCastScalar;
    Caster plain(scene, contents, options);
    for (const CastKernels* const* set = cast_kernels(); *set != nullptr; ++set) {
      CAPTURE((*set)->name);
      options.kernels = *set;
      Caster caster(scene, contents, options);
      for (const View& view : kViews) {
        const Cast wanted = cast(plain, view);
        const Cast drawn = cast(caster, view);
        CHECK(drawn.picture.rgba == wanted.picture.rgba);
        CHECK(drawn.picture.depth == wanted.picture.depth);
        CHECK(drawn.normals == wanted.normals);
        CHECK(*std::ranges::min_element(wanted.picture.depth) < 1.0F);
      }
    }
  }
}

TEST_CASE("a rectangle has the pixels of the whole picture and touches no other") {
  const Heap heap(9);
  for (const CastMode mode : {CastMode::iso, CastMode::blend}) {
    Caster::Options options = blending();
    options.mode = mode;
    Caster caster = caster_of({&heap.volume}, options);
    const CastPicture whole = cast(caster, kViews[0]).picture;
    std::mt19937 random(3);
    const auto pick = [&](int n) { return std::uniform_int_distribution<int>(0, n)(random); };
    for (int i = 0; i < 30; ++i) {
      PixelRect rect{pick(kSize.width), pick(kSize.height), pick(kSize.width), pick(kSize.height)};
      if (rect.x1 < rect.x0) std::swap(rect.x0, rect.x1);
      if (rect.y1 < rect.y0) std::swap(rect.y0, rect.y1);
      CastPicture part;
      part.resize(kSize.width, kSize.height);
      constexpr std::uint32_t kUntouched = 0x12345678;
      std::ranges::fill(part.rgba, kUntouched);
      caster.draw(kViews[0], rect, part);
      std::size_t wrong = 0;
      for (std::size_t p = 0; p < part.rgba.size(); ++p) {
        const auto x = static_cast<int>(p) % kSize.width;
        const auto y = static_cast<int>(p) / kSize.width;
        const bool in = x >= rect.x0 && x < rect.x1 && y >= rect.y0 && y < rect.y1;
        wrong += part.rgba[p] != (in ? whole.rgba[p] : kUntouched) ? 1 : 0;
        wrong += part.depth[p] != (in ? whole.depth[p] : 1.0F) ? 1 : 0;
      }
      CHECK(wrong == 0);
    }
  }
}

TEST_CASE("the opacity of blend hardly depends on the step") {
  const VoxelGrid grid{40, 40, 40};
  const TestVolume volume(grid, centred(grid, glm::dvec3(kOpacityMm)), ball({}, 2.0, 1.0));
  const View view = look_at({4.5, 7, 8.5}, {}, 7.5, 17.5);
  const auto drawn = [&](float step_vox) {
    Caster caster = caster_of({&volume}, blending(step_vox));
    return cast(caster, view).picture;
  };
  const CastPicture exact = drawn(0.75F / 16);
  const auto worst = [&](const CastPicture& picture) {
    int worst = 0;
    for (std::size_t i = 0; i < picture.rgba.size(); ++i) {
      const auto alpha = [](std::uint32_t rgba) { return static_cast<int>(rgba >> 24); };
      worst = std::max(worst, std::abs(alpha(picture.rgba[i]) - alpha(exact.rgba[i])));
    }
    return worst;
  };
  CHECK(worst(drawn(0.75F)) <= 8);
  CHECK(worst(drawn(0.75F / 4)) <= 2);
}

TEST_CASE(
    "blend gathers all between the near and the far plane, also where they cut through solid") {
  const VoxelGrid grid{40, 40, 40};
  constexpr double kEdgeMm = 0.25;
  constexpr double kEyeMm = 30.0;
  const TestVolume block(grid, centred(grid, glm::dvec3(kEdgeMm)), [](glm::dvec3) { return 1.0; });
  // Beyond the last centres the density falls to nothing over an edge, of which `transfer` shows
  // 0.65.
  constexpr double kHalfMm = 19.5 * kEdgeMm + 0.65 * kEdgeMm;
  constexpr double kSafeMm = 4.5;  // from the axis: no ray passes a side
  for (const auto& [near_mm, far_mm] :
       {std::pair{20.0, 26.7}, {26.7, 28.9}, {29.9, 30.1}, {33.1, 40.0}}) {
    CAPTURE(near_mm);
    const View view = look_at({0, 0, kEyeMm}, {}, near_mm, far_mm);
    Caster caster = caster_of({&block}, blending());
    const Cast drawn = cast(caster, view);
    const double begin_mm = std::max(near_mm, kEyeMm - kHalfMm);
    const double end_mm = std::min(far_mm, kEyeMm + kHalfMm);
    int compared = 0;
    int wrong = 0;
    for (int y = 0; y < kSize.height; ++y) {
      for (int x = 0; x < kSize.width; ++x) {
        const glm::dvec3 along = pixel_ray(view, kSize, x, y).direction;
        if (std::max(std::abs(along.x), std::abs(along.y)) * end_mm > kSafeMm) continue;
        const double lengths = (end_mm - begin_mm) * glm::length(along) / kOpacityMm;
        const double opacity = std::min((1.0 - std::pow(1.0 - kOpacity, lengths)) / 0.98, 1.0);
        const auto at = static_cast<std::size_t>((kSize.height - 1 - y) * kSize.width + x);
        wrong += std::abs((drawn.picture.rgba[at] >> 24) - 255.0 * opacity) > 1.0 ? 1 : 0;
        wrong += std::abs(eye_distance_mm(static_cast<double>(drawn.picture.depth[at]), view) -
                          begin_mm) > 0.15 * kEdgeMm
                     ? 1
                     : 0;
        ++compared;
      }
    }
    CHECK(compared > 1'500);
    CHECK(wrong == 0);
  }
}

TEST_CASE("blend ends its rays at the depth that it is given") {
  const VoxelGrid grid{40, 40, 40};
  const TestVolume volume(grid, centred(grid, glm::dvec3(0.25)), ball({}, 4.0, 0.5));
  const View view = look_at({0, 0, 30}, {}, 15, 45);
  Caster caster = caster_of({&volume}, blending());
  CastPicture picture;
  picture.resize(kSize.width, kSize.height);
  const std::size_t middle = picture.depth.size() / 2;
  const auto opacity_before = [&](double z_mm) {
    const std::vector<float> end(
        picture.depth.size(),
        static_cast<float>(window_depth(30.0 - z_mm, view.near_mm, view.far_mm)));
    caster.draw(view, picture.whole(), picture, end);
    return picture.rgba[middle] >> 24;
  };
  CHECK(opacity_before(4.5) == 0);
  CHECK(opacity_before(3.0) > 0);
  CHECK(opacity_before(3.0) < opacity_before(2.0));
  CHECK(opacity_before(-10.0) >= 245);
}

TEST_CASE("more volumes than the ray caster takes are refused, and the number is named") {
  const VoxelGrid grid{2, 2, 2};
  const TestVolume one(grid, glm::dmat4(1.0), [](glm::dvec3) { return 0.0; });
  CHECK_THROWS_WITH_AS(caster_of({&one, &one, &one, &one, &one, &one, &one, &one, &one}),
                       "scene: 9 volumes, and the ray caster takes 8; use --renderer iso",
                       VisualizerError);
}

TEST_CASE("a pool does each piece once, with any number of workers, again and again") {
  for (const int workers : {0, 1, 3}) {
    TilePool pool(workers);
    for (int round = 0; round < 200; ++round) {
      std::array<std::atomic<int>, 57> done{};
      pool.run(done.size(), [&](std::uint32_t i) { ++done[i]; });
      CHECK(std::ranges::all_of(done, [](const auto& count) { return count == 1; }));
    }
  }
}

}  // namespace kerf::cast_test
