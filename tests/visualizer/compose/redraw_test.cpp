// SPDX-License-Identifier: Apache-2.0
// Partial redraw: the same pixels as drawing everything, for every renderer.
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "shared/segment/server.hpp"
#include "shared/segment/writer.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/visualizer/gl/gl_fixture.hpp"
#include "visualizer/picture/picture.hpp"
#include "visualizer/render/renderer.hpp"
#include "visualizer/scene/camera.hpp"
#include "visualizer/scene/visualizer_error.hpp"

namespace kerf::redraw_test {

using namespace kerf::test;

namespace {

constexpr const char* kScene = R"({
  "volumes": [{"name": "upper", "solid": true}, {"name": "lower", "solid": true}],
  "tools": [{"name": "ball", "profile": [[-2, 0], [-1.4, 1.4], [0, 2], [1.4, 1.4], [2, 0]]},
            {"name": "pin", "profile": [[0, 0], [0.5, 0.8], [6, 0.8]]}],
  "materials": [{"name": "none", "iso": 0, "colour": [0, 0, 0]},
                {"name": "dentin", "iso": 0.3, "colour": [0.8, 0.7, 0.5]},
                {"name": "enamel", "iso": 0.7, "colour": [0.9, 0.9, 0.85]}]})";

/// A controller in this process with two volumes that stand across each other.
class Controller {
 public:
  explicit Controller(std::size_t arms)
      : arms_(arms), writer_(SegmentWriter::create(spec())), server_("redraw", writer_) {
    writer_.set_lifecycle(Lifecycle::run);
    move({});
  }

  /// Cuts a box of volume `v` to `left` of its density.
  void cut(std::size_t v, const VoxelBox& box, double left) {
    begin();
    const VoxelGrid& grid = writer_grid(v);
    std::vector<Density>& density = density_[v];
    std::uint32_t removed = 0;
    const VoxelBox inside = box.clipped(grid.box());
    for_each_voxel(inside, [&](int x, int y, int z) {
      Density& at = density[grid.index(x, y, z)];
      const auto now = static_cast<Density>(at * left);
      removed += static_cast<std::uint32_t>(at - now);
      at = now;
    });
    if (!inside.empty()) writer_.publish_box(v, density, inside, removed);
    end();
  }
  void move(const Hand& hand, std::size_t arm = 0) {
    hands_[arm] = hand;
    begin();
    end();
  }

 private:
  static constexpr VoxelGrid kUpper{40, 32, 28};
  static constexpr VoxelGrid kLower{24, 48, 30};
  static const VoxelGrid& writer_grid(std::size_t v) { return v == 0 ? kUpper : kLower; }

  SegmentSpec spec() {
    SegmentSpec spec;
    spec.scene_json = kScene;
    spec.arms = arms_;
    for (std::size_t v = 0; v < 2; ++v) {
      const VoxelGrid& grid = writer_grid(v);
      std::vector<Density>& density = density_[v];
      for_each_voxel(grid.box(), [&](int x, int y, int z) {
        // A comb, whose teeth darken each other over gaps of ten voxels.
        const bool gap = y > 6 && x % 16 >= 6;
        const bool border = x < 2 || y < 2 || z < 2 || x > grid.nx - 3 || z > grid.nz - 3;
        density.push_back(gap || border ? Density{0} : Density(y > 20 ? 65535 : 39'000));
      });
      SegmentVolumeSpec& volume = spec.volumes.emplace_back();
      volume.grid = grid;
      volume.spacing_mm = {0.5, 0.5, v == 0 ? 0.5 : 0.7};
      volume.origin_mm = {v == 0 ? -10.0 : -4.0, -8.0, -7.0 + 3.0 * static_cast<double>(v)};
      if (v == 1) volume.orientation = {0.0F, 0.0F, 0.3826834F, 0.9238795F};
      volume.iso = 29'000;
      volume.density = density;
    }
    return spec;
  }
  void begin() { writer_.begin_tick(++now_); }
  void end() {
    for (std::size_t arm = arms_; arm-- > 0;) {
      const Hand& hand = hands_[arm];
      TickRecord record{};
      record.tick = now_;
      record.flags = kFlagStarted;
      for (int i = 0; i < 3; ++i) {
        record.position_mm[i] = hand.tip_mm[i];
        record.commanded_force_n[i] = static_cast<float>(hand.force_n[i]);
      }
      for (int i = 0; i < 4; ++i) record.orientation[i] = static_cast<float>(hand.orientation[i]);
      record.active_tool = hand.tool;
      writer_.publish_state(record, arm);
    }
    writer_.end_tick(0);
  }

  std::size_t arms_;
  std::vector<Density> density_[2];
  SegmentWriter writer_;
  SegmentServer server_;
  std::array<Hand, kMaxArms> hands_;
  Tick now_ = 0;
};

#ifdef KERF_FEWER_CASES
constexpr int kEdits = 40;
#else
constexpr int kEdits = 100;
#endif

/// A run, polled once.
struct Run {
  RuntimeFolder folder;
  Controller controller;
  Session session{"redraw"};
  explicit Run(std::size_t arms = 1) : controller(arms) { session.poll(); }
};

/// Whether `target`, which was drawn in parts, has the pixels of the whole picture.
bool equals_whole(Picture& picture, const Run& run, const RenderTarget& target,
                  const OverlayFigures& figures = {}) {
  const auto seen = target.read_rgb();
  picture.redraw_all();
  CHECK(picture.draw(run.session, figures, target).fraction == 1.0);
  return seen == target.read_rgb();
}

/// Whether two pictures, as `RenderTarget::read_rgb` has them, are the same beside `parts`.
bool same_beside(const std::vector<PixelRect>& parts, PictureSize size,
                 std::vector<std::uint8_t> before, const std::vector<std::uint8_t>& now) {
  for (const PixelRect& part : clipped(parts, {0, 0, size.width, size.height})) {
    for (int y = part.y0; y < part.y1; ++y) {
      const std::ptrdiff_t row = std::ptrdiff_t{size.height - 1 - y} * size.width;
      std::copy(now.begin() + 3 * (row + part.x0), now.begin() + 3 * (row + part.x1),
                before.begin() + 3 * (row + part.x0));
    }
  }
  return before == now;
}

/// Changes volumes, hands, panels and camera at random, and compares each part that was drawn again
/// with drawing everything.
void check_parts(const ViewSettings& settings, PictureSize size, int edits, std::size_t arms = 1) {
  std::mt19937 random(3);
  const auto below = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
  Run run(arms);
  Picture picture(run.session, settings, 4.0 / 3.0);
  const RenderTarget target(size);
  OverlayFigures figures;
  static_cast<void>(picture.draw(run.session, figures, target));
  const auto draw = [&] {
    const std::vector<std::uint8_t> before = target.read_rgb();
    const Redrawn redrawn = picture.draw(run.session, figures, target);
    CHECK(same_beside(redrawn.parts, size, before, target.read_rgb()));
    CHECK(redrawn.any != redrawn.parts.empty());
    return redrawn;
  };
  const bool coarse =
      settings.renderer.find("slices") != std::string::npos;  // while something moves
  double redrawn = 0;
  int parts = 0;
  for (int edit = 0; edit < edits; ++edit) {
    if (edit % 3 != 2) {
      const VoxelIndex at{below(36), below(40), below(26)};
      const int edge = 1 + below(9);
      run.controller.cut(static_cast<std::size_t>(below(2)),
                         {at, {at.x + edge, at.y + edge, at.z + edge}}, 0.25 * below(3));
    }
    if (edit % 4 == 3) {
      Hand hand;
      hand.tip_mm = {below(20) - 10.0, below(16) - 6.0, below(12) - 4.0};
      hand.tool = static_cast<std::uint32_t>(below(2));
      if (below(2) == 0) hand.force_n = {0.1 * below(20), 0.3, -0.2};
      run.controller.move(hand, arms == 1 ? 0 : static_cast<std::size_t>(below(2)));
    }
    if (edit % 10 == 9) picture.camera().orbit(0.05, 0.01);
    figures.force_n = 0.1 * (edit / 2);
    figures.help = edit % 8 == 6;
    figures.hidden = edit % 16 > 11;
    run.session.poll();
    picture.update(run.session);
    const Redrawn part = draw();
    if (edit % 10 == 9 || edit % 4 == 3) {  // comes to rest
      CHECK(draw().any == coarse);
    }
    if (edit % 10 != 9) {
      redrawn += part.fraction;
      ++parts;
    }
    CAPTURE(edit);
    REQUIRE(equals_whole(picture, run, target, figures));
    // At rest nothing is drawn.
    run.session.poll();
    picture.update(run.session);
    CHECK_FALSE(picture.draw(run.session, figures, target).any);
  }
  // One sees into the volume and the tool in it; of the other, what is hidden stays.
  const std::vector<std::string> kinds = renderer_of_each(settings.renderer, 2);
  const bool opaque = std::none_of(kinds.begin(), kinds.end(), is_translucent);
  const bool wide = settings.stereo.on || settings.voxel_tool || arms > 1;
  CHECK(redrawn / parts < (wide ? 0.6 : opaque ? 0.08 : 0.2));
}

}  // namespace

TEST_CASE("after any change the part that is drawn again makes the picture of drawing everything") {
  if (!have_gl()) return;
  for (const std::string_view kind : renderer_kinds()) {
    CAPTURE(std::string(kind));
    // What software GL draws slowly is small: to draw everything is most of the time.
    const bool slow = kind == "blend" || kind == "slices";
    check_parts({.renderer = std::string(kind)}, slow ? PictureSize{96, 72} : PictureSize{160, 120},
                kEdits);
    check_parts({.renderer = std::string(kind),
                 .clip = {.on = true, .axis = 2, .at = 0.6},  // towards the camera
                 .stereo = {.on = true}},
                {161, 80}, kEdits / 10);
  }
}

TEST_CASE("so it does where each volume has a renderer of its own") {
  if (!have_gl()) return;
  for (const char* choice : {"surface,blend", "cast-blend,iso", "slices,cast", "cast,surface"}) {
    CAPTURE(choice);
    check_parts({.renderer = choice}, {96, 72}, kEdits / 4);
    check_parts({.renderer = choice, .voxel_tool = true}, {96, 72}, kEdits / 20);
  }
}

TEST_CASE("slices are fewer around a tool that moves, and all of them once it rests") {
  if (!have_gl()) return;
  for (const bool voxel_tool : {false, true}) {
    Run run;
    Picture picture(run.session, {.renderer = "slices", .voxel_tool = voxel_tool}, 4.0 / 3.0);
    const RenderTarget target({160, 120});
    static_cast<void>(picture.draw(run.session, {}, target));
    std::vector<std::uint8_t> moving;
    for (const double x_mm : {-2.0, 0.0, 2.0}) {
      run.controller.move({.tip_mm = {x_mm, 6.0, 4.0}});
      run.session.poll();
      const double fraction = picture.draw(run.session, {}, target).fraction;
      CHECK(fraction > 0.0);
      CHECK(fraction < 0.5);
      moving = target.read_rgb();
    }
    // A force that changes is no motion.
    run.controller.move({.tip_mm = {2.0, 6.0, 4.0}, .force_n = {0.0, 0.01, 0.0}});
    run.session.poll();
    CHECK(picture.draw(run.session, {}, target).any);
    const auto rest = target.read_rgb();
    CHECK(rest != moving);
    CHECK_FALSE(picture.draw(run.session, {}, target).any);
    CHECK(equals_whole(picture, run, target));
  }
}

TEST_CASE("so it does after more changes than are told apart") {
  if (!have_gl()) return;
  for (const char* kind : {"surface", "cast"}) {
    CAPTURE(std::string(kind));
    std::mt19937 random(3);
    const auto below = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
    Run run;
    Picture picture(run.session, {.renderer = kind}, 4.0 / 3.0);
    const RenderTarget target({96, 72});
    static_cast<void>(picture.draw(run.session, {}, target));
    for (int cut = 0; cut < 400; ++cut) {
      const VoxelIndex at{below(40), below(40), below(28)};
      run.controller.cut(static_cast<std::size_t>(below(2)), {at, {at.x + 9, at.y + 9, at.z + 9}},
                         0.9);
      run.session.poll();
      picture.update(run.session);
    }
    static_cast<void>(picture.draw(run.session, {}, target));
    CHECK(equals_whole(picture, run, target));
  }
}

TEST_CASE("so it does with any gradient") {
  if (!have_gl()) return;
  for (const GradientFilter gradient : {GradientFilter::central, GradientFilter::corners}) {
    for (const std::string_view kind : renderer_kinds()) {
      CAPTURE(std::string(kind));
      check_parts({.renderer = std::string(kind), .gradient = gradient}, {96, 72}, kEdits / 20);
    }
  }
}

TEST_CASE(
    "what exceeds the pixels of a frame is seen coarsely at first, and as finely in the end") {
  if (!have_gl()) return;
  for (const std::string_view kind : renderer_kinds()) {
    CAPTURE(std::string(kind));
    for (const bool voxel_tool : {false, true}) {
      Run run;
      Picture picture(run.session, {.renderer = std::string(kind), .voxel_tool = voxel_tool},
                      4.0 / 3.0);
      const RenderTarget target({64, 48});
      const auto finish = [&] {
        int frames = 0;
        for (; picture.is_late() && frames < 300; ++frames) {
          CHECK(picture.draw(run.session, {}, target).any);
        }
        CHECK_FALSE(picture.is_late());
        return frames;
      };
      const auto is_whole = [&] {
        picture.set_most_pixels(1e9);
        CHECK(equals_whole(picture, run, target));
        picture.set_most_pixels(100.0);
      };
      picture.set_most_pixels(100.0);
      const Redrawn first = picture.draw(run.session, {}, target);
      CHECK(first.fraction == 1.0);
      CHECK(first.pixels < 101.0);
      CHECK(picture.is_late());
      const auto coarse = target.read_rgb();
      CHECK(finish() > 64 * 48 / 200);
      CHECK(target.read_rgb() != coarse);
      is_whole();
      // Camera, cut and hand come while much is left to be done.
      for (int event = 0; event < 6; ++event) {
        picture.camera().orbit(0.1, 0.05);
        for (int frame = 0; frame < 5; ++frame) {
          static_cast<void>(picture.draw(run.session, {}, target));
        }
        CHECK(picture.is_late());
        if (event % 3 == 1) run.controller.cut(0, {{10, 10, 5}, {22, 20, 18}}, 0.2);
        if (event % 3 == 2) run.controller.move({.tip_mm = {event - 3.0, 6.0, 4.0}});
        run.session.poll();
        picture.update(run.session);
        CHECK(picture.draw(run.session, {}, target).any);
        finish();
        // What moved comes to rest.
        while (picture.draw(run.session, {}, target).any) finish();
        is_whole();
      }
    }
  }
}

TEST_CASE("beside a hand that moves on the picture becomes fine, and what is fine stays so") {
  if (!have_gl()) return;
  for (const char* const kind : {"cast", "cast-blend"}) {
    CAPTURE(std::string(kind));
    Run run;
    Picture picture(run.session, {.renderer = kind}, 4.0 / 3.0);
    const PictureSize size{160, 120};
    const RenderTarget target(size);
    const auto step = [&](int frame) {
      run.controller.move({.tip_mm = {frame % 2 - 4.0, 8.0, 4.0}});
      run.session.poll();
      static_cast<void>(picture.draw(run.session, {}, target));
      return target.read_rgb();
    };
    static_cast<void>(step(0));
    const auto whole = step(1);
    picture.redraw_all();
    picture.set_most_pixels(size.width * size.height / 40.0);  // the hand alone covers more
    const auto differing = [&](const std::vector<std::uint8_t>& picture) {
      int count = 0;
      for (std::size_t i = 0; i < whole.size(); i += 3) {
        count += std::equal(&whole[i], &whole[i] + 3, &picture[i]) ? 0 : 1;
      }
      return count;
    };
    const int at_first = differing(step(1));
    CHECK(at_first > 1000);
    for (int frame = 2; frame < 202; ++frame) static_cast<void>(step(frame));
    // All that is coarse still is what moves, and it stays so.
    for (int frame = 203; frame < 211; frame += 2) {
      static_cast<void>(step(frame - 1));
      CHECK(differing(step(frame)) < at_first / 3);
    }
  }
}

TEST_CASE("so it does with a tool of voxels") {
  if (!have_gl()) return;
  for (const std::string_view kind : renderer_kinds()) {
    CAPTURE(std::string(kind));
    check_parts({.renderer = std::string(kind), .voxel_tool = true}, {96, 72}, kEdits / 10);
  }
}

TEST_CASE("so it does with two arms, their tools as meshes and as voxels") {
  if (!have_gl()) return;
  for (const std::string_view kind : renderer_kinds()) {
    CAPTURE(std::string(kind));
    for (const bool voxel_tool : {false, true}) {
      check_parts({.renderer = std::string(kind), .voxel_tool = voxel_tool}, {96, 72}, kEdits / 5,
                  2);
    }
  }
}

TEST_CASE("each of two arms is seen: a picture of both differs from that of either") {
  if (!have_gl()) return;
  for (const bool voxel_tool : {false, true}) {
    CAPTURE(voxel_tool);
    const RenderTarget target({160, 120});
    const Hand left{.tip_mm = {-6.0, 9.0, 6.0}, .force_n = {0.0, 2.0, 0.0}};
    const Hand right{.tip_mm = {6.0, 9.0, 6.0}, .tool = 1, .force_n = {0.0, 2.0, 0.0}};
    const Hand away{.tip_mm = {500.0, 0.0, 0.0}};  // beside the picture
    const auto drawn = [&](const Hand& first, const Hand& second, std::size_t arms) {
      Run run(arms);
      run.controller.move(first);
      if (arms > 1) run.controller.move(second, 1);
      run.session.poll();
      Picture picture(run.session, {.renderer = "iso", .voxel_tool = voxel_tool}, 4.0 / 3.0);
      static_cast<void>(picture.draw(run.session, {}, target));
      return target.read_rgb();
    };
    const auto both = drawn(left, right, 2), swapped = drawn(right, left, 2);
    const auto one = drawn(left, away, 2), other = drawn(away, right, 2);
    const auto neither = drawn(away, away, 2);
    CHECK(one == drawn(left, away, 1));
    CHECK(both == swapped);
    CHECK(one != neither);
    CHECK(other != neither);
    // Apart on the screen: each pixel is that of the arm that is there.
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < both.size(); ++i) {
      wrong += both[i] != (one[i] != neither[i] ? one[i] : other[i]) ? 1 : 0;
    }
    CHECK(wrong == 0);
  }
}

TEST_CASE("a changed look shows the picture of one that had it from the start") {
  if (!have_gl()) return;
  Run run;
  const RenderTarget target({160, 120});
  const auto drawn = [&](Picture& picture) {
    static_cast<void>(picture.draw(run.session, {}, target));
    return target.read_rgb();
  };
  ViewSettings clipped{.renderer = "iso"};
  clipped.clip = {.on = true, .axis = 0, .at = 0.4};
  for (const ViewSettings& settings :
       {ViewSettings{.renderer = "blend"}, ViewSettings{.renderer = "surface,blend"},
        ViewSettings{.renderer = "iso", .iso = 0.7}, clipped}) {
    std::vector<std::uint8_t> changed;
    {
      Picture picture(run.session, {.renderer = "iso"}, 4.0 / 3.0);
      const auto before = drawn(picture);
      picture.set_view(run.session, settings);
      changed = drawn(picture);
      CHECK(changed != before);
      CHECK_THROWS_AS(picture.set_view(run.session, {.renderer = "voxels"}), VisualizerError);
      CHECK(picture.settings() == settings);
    }
    Picture fresh(run.session, settings, 4.0 / 3.0);
    const bool same = drawn(fresh) == changed;
    CHECK(same);
  }
}

TEST_CASE("the first view shows every volume, in the middle of the picture") {
  if (!have_gl()) return;
  Run run;
  Picture picture(run.session, {.renderer = "iso"}, 1.0);
  const View view = picture.camera().view(1.0, picture.camera().radius_mm());
  for (const VolumeView& volume : run.session.scene().volumes) {
    const BoxCorners box = volume.corners();
    // A box's corners may lie outside, where there is hardly ever anything; its faces do not.
    const glm::dvec3 middle = 0.5 * (box.front() + box.back());
    for (const std::size_t along : {1U, 2U, 4U}) {
      for (const double side : {-0.5, 0.5}) {
        const glm::dvec3 face = middle + side * (box[along] - box[0]);
        const glm::dvec4 clip = view.clip_from_eye() * view.eye_from_world * glm::dvec4(face, 1.0);
        CHECK(std::max(std::abs(clip.x), std::abs(clip.y)) < clip.w);
      }
    }
  }
}

TEST_CASE("a target made anew in the place of another, a column narrower, is drawn whole") {
  if (!have_gl()) return;
  Run run;
  Picture picture(run.session, {.renderer = "iso", .stereo = {.on = true}}, 4.0 / 3.0);
  std::optional<RenderTarget> target(std::in_place, PictureSize{161, 80});
  static_cast<void>(picture.draw(run.session, {}, *target));
  target.emplace(PictureSize{160, 80});
  static_cast<void>(picture.draw(run.session, {}, *target));
  CHECK(equals_whole(picture, run, *target));
}

TEST_CASE("a banner wider than the picture of an eye ends where that ends") {
  if (!have_gl()) return;
  Run run;
  constexpr PictureSize kOdd{97, 73};  // an eye has 48 columns, a banner at least 60
  Picture picture(run.session, {.renderer = "iso", .stereo = {.on = true}}, 4.0 / 3.0);
  const RenderTarget target(kOdd), anew(kOdd);
  OverlayFigures figures;
  figures.banner = "stale: no news from the servo";
  for (const double force_n : {0.0, 1.0, 2.0}) {
    figures.force_n = force_n;
    CHECK(picture.draw(run.session, figures, target).any);
  }
  const auto seen = target.read_rgb();
  picture.redraw_all();
  static_cast<void>(picture.draw(run.session, figures, anew));
  const bool same = seen == anew.read_rgb();
  CHECK(same);
  int lit = 0;  // of the odd column, which is nobody's
  for (int y = 0; y < kOdd.height; ++y) {
    const auto last = static_cast<std::size_t>(3 * ((y + 1) * kOdd.width - 1));
    lit += seen[last] != 0 || seen[last + 1] != 0 || seen[last + 2] != 0 ? 1 : 0;
  }
  CHECK(lit == 0);
}

TEST_CASE("bounds on the screen hold all that is inside a box, and the whole screen near the eye") {
  const View view = look_at({0, 0, 10}, {0, 0, 0}, 1, 100);
  const PictureSize size{200, 100};
  std::vector<glm::dvec3> corners{{-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5}};
  View wide = view;
  wide.aspect = 2.0;
  const PixelRect bounds = screen_bounds(corners, wide, size);
  CHECK(bounds.x0 > 60);
  CHECK(bounds.x1 < 140);
  CHECK(bounds.y0 >= 0);
  CHECK(bounds.y1 <= 100);
  CHECK(bounds.x0 + bounds.x1 == doctest::Approx(200).epsilon(0.05));
  corners.emplace_back(0, 0, 9.5);
  CHECK(screen_bounds(corners, wide, size) == PixelRect{0, 0, 200, 100});
  corners = {{100, 0, 0}, {101, 1, 1}};
  CHECK(screen_bounds(corners, wide, size).empty());
}

}  // namespace kerf::redraw_test
