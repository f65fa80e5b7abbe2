// SPDX-License-Identifier: Apache-2.0
// A whole headless run against a segment that this process writes.
#include "visualizer/app/run.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <future>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <doctest/doctest.h>

#include "shared/posix/atomic_file.hpp"
#include "shared/posix/threads.hpp"
#include "shared/segment/server.hpp"
#include "tests/json.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/visualizer/render/rgb_picture.hpp"
#include "visualizer/app/window_run.hpp"
#include "visualizer/gl/context.hpp"
#include "visualizer/picture/picture.hpp"
#include "visualizer/render/renderer.hpp"
#include "visualizer/scene/camera_pose.hpp"
#include "visualizer/scene/session.hpp"
#include "visualizer/scene/visualizer_error.hpp"

namespace kerf::run_test {

namespace fs = std::filesystem;

namespace {

constexpr VoxelGrid kGrid{32, 32, 32};
constexpr const char* kScene = R"({
  "volumes": [{"name": "block", "solid": true}],
  "tools": [{"name": "ball", "profile": [[-1, 0], [0, 1], [1, 0]]}],
  "materials": [{"name": "none", "iso": 0, "colour": [0, 0, 0]},
                {"name": "bone", "iso": 0.3, "colour": [0.8, 0.7, 0.5]}]})";

bool have_gl() {
  try {
    static_cast<void>(make_headless_context());
    return true;
  } catch (const VisualizerError&) {
    MESSAGE("skipped: there is no OpenGL 4.5 context here");
    return false;
  }
}

/// A short run whose files lie in a folder of its own, as its socket does.
struct Place : test::RuntimeFolder {
  [[nodiscard]] VisualizerOptions options() const {
    VisualizerOptions options;
    options.name = "test";
    options.headless = true;
    options.size = {96, 72};
    options.frames = 4;
    options.every_ticks = 50;
    options.wait_s = 5.0;
    options.out = *this / "out";
    options.report = *this / "report.json";
    return options;
  }
};

/// A controller that mills a groove into a solid block, a slab further each tick.
class GrooveController {
 public:
  GrooveController()
      : writer_(SegmentWriter::create(spec())), server_(std::in_place, "test", writer_) {
    writer_.set_lifecycle(Lifecycle::run);
  }

  /// Ticks as fast as a servo, to `last`; the groove gets a layer deeper every eight ticks.
  void run_to(Tick last) {
    while (tick_ < last) {
      ++tick_;
      writer_.begin_tick(tick_);
      const auto top = static_cast<std::int32_t>(31 - tick_ / 8 % 24);
      const VoxelBox box{{8, 8, top}, {24, 24, top + 1}};
      std::uint32_t removed = 0;
      for (int y = box.lo.y; y < box.hi.y; ++y) {
        for (int x = box.lo.x; x < box.hi.x; ++x) {
          Density& density = density_[kGrid.index(x, y, top)];
          removed += density;
          density = 0;
        }
      }
      writer_.publish_box(0, density_, box, removed);
      TickRecord record{};
      record.tick = tick_;
      record.start_ns = now_ns();
      record.flags = kFlagStarted;
      record.position_mm[1] = 20.0;
      record.orientation[3] = 1.0F;
      record.commanded_force_n[1] = 1.0F;
      writer_.publish_state(record);
      writer_.end_tick(record.start_ns);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
  void say(Lifecycle lifecycle) { writer_.set_lifecycle(lifecycle); }
  void vanish() { server_.reset(); }

 private:
  static std::uint64_t now_ns() {
    return static_cast<std::uint64_t>(std::chrono::steady_clock::now().time_since_epoch().count());
  }
  SegmentSpec spec() {
    density_.assign(kGrid.voxel_count(), 50000);
    SegmentVolumeSpec volume;
    volume.grid = kGrid;
    volume.density = density_;
    SegmentSpec spec;
    spec.volumes = {volume};
    spec.scene_json = kScene;
    return spec;
  }

  std::vector<Density> density_;
  Tick tick_ = 0;
  SegmentWriter writer_;
  std::optional<SegmentServer> server_;
};

/// Of a user who presses them in one frame.
WindowInput pressing(std::string keys) {
  WindowInput input;
  input.keys = {keys.begin(), keys.end()};
  return input;
}

/// Of a drag and a turn of the wheel.
WindowInput moving(double right, double up, double wheel) {
  WindowInput input;
  input.drag_right = right;
  input.drag_up = up;
  input.wheel = wheel;
  return input;
}

/// A busy machine may take long over a picture; a minute is not busy but broken.
bool appears(const fs::path& file) {
  for (int tries = 0; tries < 6000 && !fs::exists(file); ++tries) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return fs::exists(file);
}

}  // namespace

TEST_CASE("a headless run writes its pictures, follows the milling and ends with the controller") {
  if (!have_gl()) return;
  const Place place;
  VisualizerOptions options = place.options();
  // The visualizer is started first and waits.
  options.renderer_is_given = false;
  auto code = std::async(std::launch::async, [&] { return run_headless(options); });
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  GrooveController miller;
  // Ticks count from the first armed one, tick 1.
  for (const int picture : {1, 2, 3}) {
    miller.run_to(static_cast<Tick>(50 * picture + 1));
    REQUIRE(appears(options.out / ("frame-000" + std::to_string(picture) + ".png")));
  }
  miller.run_to(180);
  miller.say(Lifecycle::clean_end);
  CHECK(code.get() == 0);

  for (int i = 1; i <= 4; ++i) {
    CAPTURE(i);
    CHECK(test::text_of(options.out / ("frame-000" + std::to_string(i) + ".png")).substr(1, 3) ==
          "PNG");
  }
  CHECK_FALSE(fs::exists(options.out / "frame-0005.png"));
  CHECK(test::text_of(options.out / "frame-0001.png") !=
        test::text_of(options.out / "frame-0004.png"));
  const auto report = test::read_json_file(*options.report);
  CHECK(report["clean_end"] == true);
  CHECK(report["frames"] == 4);
  CHECK(report["bricks_uploaded"] > 64);  // all of them once, then what changed
  CHECK(report["gl_renderer"] != "");
  const bool software = is_software_gl(report["gl_renderer"].get<std::string>());
  CHECK(report["renderer"] == (software ? "cast" : "iso"));
  CHECK(report["cpu_ms"]["p50"] > 0.0);
  // Each picture but the last is 50 ticks of a millisecond after the one before, and a cut comes
  // every eight.
  CHECK(report["latency_ms"]["p50"] > 1.0);
  CHECK(report["latency_ms"]["p99"] >= report["latency_ms"]["p50"]);
}

TEST_CASE("a headless video plays in the servo's time, to the end of the run") {
  if (!have_gl()) return;
  const Place place;
  VisualizerOptions options = place.options();
  options.frames = 0;
  options.record = (place / "a.y4m").string();
  options.video_hz = 50;
  GrooveController miller;
  miller.run_to(1);
  auto code = std::async(std::launch::async, [&] { return run_headless(options); });
  const std::size_t frame = 6 + 96 * 72 * 3 / 2;
  // The first frame shows the first tick.
  const auto begun = [&] {
    return fs::exists(*options.record) && fs::file_size(*options.record) > frame;
  };
  for (int tries = 0; tries < 6000 && !begun(); ++tries) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  miller.run_to(400);
  miller.say(Lifecycle::clean_end);
  CHECK(code.get() == 0);
  const std::string video = test::text_of(*options.record);
  const std::size_t header = video.find('\n') + 1;
  CHECK((video.size() - header) % frame == 0);
  const std::size_t frames = (video.size() - header) / frame;
  CHECK(frames == 20);  // 399 ticks of a millisecond, the first one included
  CHECK(video.substr(header, frame) != video.substr(video.size() - frame));
  CHECK_FALSE(fs::exists(options.out));  // no pictures
  options.record = "/dev/full";
  CHECK_THROWS_AS(static_cast<void>(run_headless(options)), FileError);
}

TEST_CASE("a session tells once when the oldest new removal was, and nothing from before it") {
  const Place place;
  GrooveController miller;
  miller.run_to(20);  // cuts in ticks 1, 8 and 16
  Session session("test");
  CHECK_FALSE(session.take_oldest_removal());
  miller.run_to(22);
  session.poll();
  CHECK_FALSE(session.take_oldest_removal());
  miller.run_to(23);
  const auto before = std::chrono::steady_clock::now();
  miller.run_to(24);  // the next cut
  const auto after_first = std::chrono::steady_clock::now();
  CHECK_FALSE(session.take_oldest_removal());  // not polled
  miller.run_to(32);                           // and one more
  session.poll();
  session.poll();  // what an earlier poll brought stays
  const auto removal = session.take_oldest_removal();
  REQUIRE(removal);
  CHECK(*removal >= before);
  CHECK(*removal < after_first);
  CHECK_FALSE(session.take_oldest_removal());
}

TEST_CASE("a controller that vanishes or faults is shown in its last state, and the code says so") {
  if (!have_gl()) return;
  for (const bool fault : {false, true}) {
    const Place place;
    GrooveController miller;
    auto code = std::async(std::launch::async, [&] { return run_headless(place.options()); });
    miller.run_to(51);
    REQUIRE(appears(place.options().out / "frame-0001.png"));
    miller.run_to(70);
    if (fault) {
      miller.say(Lifecycle::fault);
    } else {
      miller.vanish();
    }
    CHECK(code.get() == 1);
    CHECK(fs::exists(place.options().out / "frame-0002.png"));
  }
}

TEST_CASE("every renderer draws a session") {
  if (!have_gl()) return;
  const Place place;
  GrooveController miller;
  miller.run_to(20);
  miller.say(Lifecycle::clean_end);
  std::vector<std::string> pictures;
  for (const std::string_view kind : renderer_kinds()) {
    const std::string renderer(kind);
    CAPTURE(renderer);
    VisualizerOptions options = place.options();
    options.settings.renderer = renderer;
    options.out = place / renderer;
    CHECK(run_headless(options) == 0);
    pictures.push_back(test::text_of(options.out / "frame-0001.png"));
    CHECK(pictures.back().size() > 500);
  }
  CHECK(pictures[0] != pictures[1]);
  VisualizerOptions options = place.options();
  options.settings.renderer = "surface,blend";
  CHECK_THROWS_WITH_AS(static_cast<void>(run_headless(options)),
                       doctest::Contains("surface,blend is for 2 volumes, and the scene has 1"),
                       VisualizerError);
}

TEST_CASE("a visualizer that joins late shows the picture of one that was there all the time") {
  if (!have_gl()) return;
  const Place place;
  GrooveController miller;
  VisualizerOptions options = place.options();
  options.size = {640, 480};
  options.every_ticks = 100'000;  // only the final state
  VisualizerOptions late = options;
  late.out = place / "late";
  auto first = std::async(std::launch::async, [&] { return run_headless(options); });
  std::this_thread::sleep_for(std::chrono::milliseconds(400));
  miller.run_to(100);
  miller.say(Lifecycle::clean_end);
  CHECK(first.get() == 0);
  CHECK(run_headless(late) == 0);
  // On the left is the panel, which says since when it counts the materials.
  const auto right_half = [](const fs::path& file) {
    const test::RgbPicture picture = test::read_png(file).value();
    std::vector<std::uint8_t> half;
    for (std::size_t byte = 0; byte < picture.rgb.size(); ++byte) {
      if (byte / 3 % 640 >= 320) half.push_back(picture.rgb[byte]);
    }
    return half;
  };
  const auto seen = right_half(options.out / "frame-0001.png");
  CHECK(std::any_of(seen.begin(), seen.end(), [](std::uint8_t value) { return value > 128; }));
  CHECK(right_half(late.out / "frame-0001.png") == seen);
}

TEST_CASE("a headless run exports the final surface, drawn by the surface renderer") {
  if (!have_gl()) return;
  const Place place;
  GrooveController miller;
  VisualizerOptions options = place.options();
  options.settings.renderer = "surface";
  options.mesh = place / "block.stl";
  auto code = std::async(std::launch::async, [&] { return run_headless(options); });
  miller.run_to(51);
  REQUIRE(appears(options.out / "frame-0001.png"));
  miller.run_to(170);
  miller.say(Lifecycle::clean_end);
  CHECK(code.get() == 0);
  CHECK(test::text_of(options.out / "frame-0001.png") !=
        test::text_of(options.out / "frame-0004.png"));
  const std::string stl = test::text_of(*options.mesh);
  REQUIRE(stl.size() > 84);
  std::uint32_t triangles = 0;
  std::memcpy(&triangles, &stl[80], sizeof(triangles));
  CHECK(triangles > 12'000);  // the block's six faces and the groove's
  CHECK(stl.size() == 84 + 50 * std::size_t{triangles});
}

TEST_CASE("a sheet at the end of a headless run shows the opacities of --transfer") {
  if (!have_gl()) return;
  const Place place;
  GrooveController miller;
  miller.run_to(60);
  miller.say(Lifecycle::clean_end);
  std::vector<std::string> sheets;
  for (const double opacity : {1.0, 0.01}) {
    VisualizerOptions options = place.options();
    options.sheet = place / "sheet.png";
    options.transfer = "named in messages only";
    options.settings.opacities = {{"bone", opacity}};
    CHECK(run_headless(options) == 0);
    sheets.push_back(test::text_of(*options.sheet));
    CHECK(sheets.back().substr(1, 3) == "PNG");
  }
  CHECK(sheets[0] != sheets[1]);
}

TEST_CASE("n writes the window's view, and a headless run from there shows the same picture") {
  if (!have_gl()) return;
  const Place place;
  GrooveController miller;
  miller.run_to(60);
  VisualizerOptions options = place.options();
  options.out = place / "window";
  options.size = {320, 240};
  options.panels = false;
  options.renderer_is_given = true;
  {
    const auto context = make_headless_context();
    WindowRun run(options, Session("test"), *context);
    auto now = WindowRun::Clock::now();
    const auto step = [&](const WindowInput& input) {
      now += std::chrono::seconds(1);
      static_cast<void>(run.step(input, options.size, now));
    };
    step({});
    step(pressing("s"));
    step(moving(0.2, -0.1, 2.0));
    step(pressing("sn"));
    CHECK(run.end() == 0);
  }
  miller.say(Lifecycle::clean_end);
  // A window keeps its banners, which lie below the middle.
  const auto upper_half = [](const fs::path& file) {
    std::vector<std::uint8_t> rgb = test::read_png(file).value().rgb;
    rgb.resize(rgb.size() / 2);
    return rgb;
  };
  const auto picture_of = [&](const char* name, const std::string& camera) {
    VisualizerOptions still = place.options();
    still.size = options.size;
    still.out = place / name;
    still.frames = 1;
    still.panels = false;
    still.sheet = place / (std::string(name) + ".png");
    if (!camera.empty()) still.settings.camera = read_camera(camera);
    CHECK(run_headless(still) == 0);
    return upper_half(still.out / "frame-0001.png");
  };
  const auto shot = [&](const char* name) { return upper_half(options.out / name); };
  const std::string camera = (options.out / "kerf-0001-camera.toml").string();
  CHECK(picture_of("first", "") == shot("kerf-0001.png"));
  // The file has six digits after the point, and a texture unit may filter with 8 bits of weight.
  const std::vector<std::uint8_t> moved = picture_of("moved", camera);
  const std::vector<std::uint8_t> seen = shot("kerf-0002.png");
  REQUIRE(moved.size() == seen.size());
  int most = 0;
  for (std::size_t i = 0; i < moved.size(); ++i)
    most = std::max(most, std::abs(moved[i] - seen[i]));
  CHECK(most <= 2);
  CHECK(shot("kerf-0001.png") != shot("kerf-0002.png"));
  CHECK(test::text_of(place / "first.png") != test::text_of(place / "moved.png"));  // sheets
}

TEST_CASE("r goes back to the camera that was given, and n writes to its file") {
  if (!have_gl()) return;
  const Place place;
  GrooveController miller;
  miller.run_to(20);
  VisualizerOptions options = place.options();
  const CameraPose given{{3, 90, 60}, {16, 16, 16}, {0.5, 1, 0}};
  options.camera_file = place / "camera.toml";
  options.settings.camera = given;
  const auto context = make_headless_context();
  WindowRun run(options, Session("test"), *context);
  auto now = WindowRun::Clock::now();
  const auto step = [&](const WindowInput& input) {
    now += std::chrono::seconds(1);
    static_cast<void>(run.step(input, options.size, now));
    return run.picture().camera().pose();
  };
  const auto is_given = [&](const CameraPose& pose) {
    return glm::length(pose.eye_mm - given.eye_mm) + glm::length(pose.target_mm - given.target_mm) <
           1e-9;
  };
  CHECK(is_given(step({})));
  const CameraPose moved = step(moving(0.3, 0.1, -1.0));
  CHECK_FALSE(is_given(moved));
  step(pressing("n"));
  const CameraPose kept = read_camera(options.camera_file->string());
  CHECK(glm::length(kept.eye_mm - moved.eye_mm) < 2e-6);
  CHECK(glm::length(kept.up - moved.up) < 2e-6);
  CHECK(is_given(step(pressing("r"))));
}

TEST_CASE("a window follows the presented view until its user moves it, and r follows again") {
  if (!have_gl()) return;
  const Place place;
  GrooveController miller;
  miller.run_to(20);
  VisualizerOptions options = place.options();
  const auto context = make_headless_context();
  auto now = WindowRun::Clock::now();
  const auto step = [&](WindowRun& run, const WindowInput& input) {
    now += std::chrono::seconds(1);
    static_cast<void>(run.step(input, options.size, now));
    return run.picture().camera().pose();
  };
  const auto alike = [](const CameraPose& a, const CameraPose& b) {
    return glm::length(a.eye_mm - b.eye_mm) + glm::length(a.target_mm - b.target_mm) < 1e-9;
  };
  {
    options.follow_view = true;
    WindowRun follower(options, Session("test"), *context);
    const CameraPose home = step(follower, {});
    std::optional<ViewPresenter> presenter(std::in_place, "test");
    const auto present = [&](double x) {
      presenter->show({{x, 50, 60}, {16, 16, 16}, {0, 1, 0.2}});
      return CameraPose{{x, 50, 60}, {16, 16, 16}, {0, 1, 0.2}};
    };
    const CameraPose first = present(1);
    CHECK_FALSE(alike(first, home));
    CHECK(alike(step(follower, {}), first));
    const CameraPose second = present(20);
    CHECK(alike(step(follower, {}), second));
    const CameraPose own = step(follower, moving(0.1, 0.0, 0.0));
    CHECK_FALSE(alike(own, second));
    const CameraPose third = present(30);
    CHECK(alike(step(follower, {}), own));
    CHECK(alike(step(follower, pressing("r")), third));
    VisualizerOptions another = options;
    another.follow_view = false;
    another.present = true;
    CHECK_THROWS_WITH_AS(SharedView{another}, doctest::Contains("--present: process "),
                         SegmentError);
    presenter.reset();
    CHECK(alike(step(follower, {}), third));  // the last view stays
    CHECK(alike(step(follower, {}), third));
  }
  options.follow_view = false;
  options.present = true;
  WindowRun presents(options, Session("test"), *context);
  ViewFollower seen("test");
  const CameraPose moved = step(presents, moving(0.2, -0.1, 3.0));
  seen.poll();
  REQUIRE(seen.presented());
  for (int i = 0; i < 3; ++i) {
    CHECK(seen.view().eye_mm[i] == moved.eye_mm[i]);
    CHECK(seen.view().up[i] == moved.up[i]);
  }
}

TEST_CASE("a camera inside of the body, or far off, makes a picture by every renderer") {
  if (!have_gl()) return;
  const Place place;
  GrooveController miller;
  miller.run_to(20);
  const Session session("test");
  const auto context = make_headless_context();
  for (const auto kind : renderer_kinds()) {
    CAPTURE(kind);
    for (const CameraPose& pose : {CameraPose{{16, 10, 16}, {16, 10, 0}, {0, 1, 0}},
                                   CameraPose{{16, 20, 16}, {40, 30, 3}, {0, 1, 0}},
                                   CameraPose{{1e5, 1e5, 1e5}, {0, 0, 0}, {0, 1, 0}},
                                   CameraPose{{16, 31, 16}, {16, 31 + 1e-6, 16}, {1, 0, 0}}}) {
      ViewSettings settings;
      settings.renderer = kind;
      settings.camera = pose;
      Picture picture(session, settings, 4.0 / 3.0);
      const RenderTarget target({96, 72});
      OverlayFigures figures;
      figures.hidden = true;
      static_cast<void>(picture.draw(session, figures, target));
      CHECK(glGetError() == GL_NO_ERROR);
      CHECK(target.read_rgb().size() == 96 * 72 * 3);
    }
  }
}

TEST_CASE("a core that is not there is refused, also beside one that is") {
  const std::vector<int> mine = allowed_cores();
  CHECK_THROWS_AS(place_process(std::vector{mine.front(), 1023}), VisualizerError);
  CHECK(place_process(mine) == mine);
}

TEST_CASE("no output takes the place of another kind of file") {
  const Place place;
  const fs::path scan = place / "scan.nrrd", notes = place / "notes";
  for (const fs::path& mine : {scan, notes}) std::ofstream(mine) << "mine";
  const auto refused = [&](const auto& ask) {
    VisualizerOptions options = place.options();
    ask(options);
    CHECK_THROWS_AS(static_cast<void>(run_headless(options)), FileError);
    CHECK_THROWS_AS(static_cast<void>(run_window(options)), FileError);
  };
  refused([&](VisualizerOptions& o) { o.attached = scan; });
  refused([&](VisualizerOptions& o) { o.attached = notes; });
  refused([&](VisualizerOptions& o) { o.choice = scan; });
  refused([&](VisualizerOptions& o) { o.sheet = scan; });
  refused([&](VisualizerOptions& o) { o.record = scan.string(); });
  refused([&](VisualizerOptions& o) { o.report = scan; });
  refused([&](VisualizerOptions& o) { o.report = o.transfer = notes; });
  refused([&](VisualizerOptions& o) { o.report = o.sheet = place / "one"; });
  for (const fs::path& mine : {scan, notes}) CHECK(test::text_of(mine) == "mine");
}

TEST_CASE("a video alone ends when its time is over") {
  if (!have_gl()) return;
  const Place place;
  VisualizerOptions options = place.options();
  options.frames = 0;
  options.every_ticks.reset();
  options.seconds = 0.1;
  options.record = (place / "a.y4m").string();
  GrooveController miller;
  miller.run_to(1);
  CHECK(run_headless(options) == 0);
  CHECK(test::text_of(*options.record).find("FRAME") != std::string::npos);
}

}  // namespace kerf::run_test
