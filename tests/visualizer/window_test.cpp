// SPDX-License-Identifier: Apache-2.0
// The window on a screen of its own (Xvfb), worked with real key and mouse events (xdotool).
#include "visualizer/gl/window.hpp"

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <future>
#include <string>
#include <thread>
#include <vector>

#include <doctest/doctest.h>
#include <epoxy/gl.h>
#include <fcntl.h>
#include <nlohmann/json.hpp>
#include <sys/wait.h>
#include <unistd.h>

#include "shared/segment/hand_over.hpp"
#include "shared/segment/writer.hpp"
#include "tests/programs/process.hpp"
#include "tests/visualizer/rgb_picture.hpp"
#include "visualizer/error.hpp"
#include "visualizer/run.hpp"
#include "visualizer/transfer_file.hpp"

using namespace kerf;
using namespace kerf::test;
namespace fs = std::filesystem;

namespace {

constexpr const char* kScene = R"({
  "volumes": [{"name": "block", "solid": true}],
  "tools": [{"name": "ball", "profile": [[-1, 0], [0, 1], [1, 0]]},
            {"name": "pin", "profile": [[0, 0], [1, 1]]}],
  "materials": [{"name": "none", "iso": 0, "colour": [0, 0, 0]},
                {"name": "bone", "iso": 0.3, "colour": [0.8, 0.7, 0.5]}]})";
constexpr VoxelGrid kGrid{32, 24, 16};

bool have(const char* program) {
  const std::string command = std::string("command -v ") + program + " >/dev/null 2>&1";
  if (std::system(command.c_str()) == 0) return true;
  MESSAGE("skipped: " << std::string(program)
                      << " is not installed (.ci/packages.txt, group check)");
  return false;
}

/// A screen that nobody sees, and a private folder.
class Screen {
 public:
  Screen() {
    int ready[2];
    REQUIRE(pipe(ready) == 0);
    server_ = fork();
    if (server_ == 0) {
      const std::string to = std::to_string(ready[1]);
      const int quiet = open("/dev/null", O_WRONLY);
      dup2(quiet, STDERR_FILENO);
      execlp("Xvfb", "Xvfb", "-displayfd", to.c_str(), "-screen", "0", "800x600x24", "-nolisten",
             "tcp", static_cast<char*>(nullptr));
      _exit(127);
    }
    close(ready[1]);
    std::string number;
    for (char digit = 0; read(ready[0], &digit, 1) == 1 && digit != '\n';) number += digit;
    close(ready[0]);
    REQUIRE_FALSE(number.empty());
    fs::remove_all(folder);
    fs::create_directories(folder);
    setenv("DISPLAY", (":" + number).c_str(), 1);
    setenv("XDG_RUNTIME_DIR", folder.c_str(), 1);
  }
  ~Screen() {
    end(SIGTERM);
    fs::remove_all(folder);
  }
  void end(int signal) {
    if (server_ < 0) return;
    kill(server_, signal);
    waitpid(server_, nullptr, 0);
    server_ = -1;
  }
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  const fs::path folder = fs::temp_directory_path() / ("kerf-window-" + std::to_string(::getpid()));

 private:
  pid_t server_ = -1;
};

SegmentSpec block(std::vector<Density>& density) {
  density.assign(kGrid.voxel_count(), 50'000);
  SegmentSpec spec;
  spec.scene_json = kScene;
  SegmentVolumeSpec& volume = spec.volumes.emplace_back();
  volume.grid = kGrid;
  volume.density = density;
  return spec;
}

/// A controller of the name "test" that shows a block.
class Controller {
 public:
  Controller()
      : writer_(SegmentWriter::create(block(density_))), server_("test", writer_, {.tools = 2}) {
    writer_.set_lifecycle(Lifecycle::run);
  }
  void tick() {
    writer_.begin_tick(++now_);
    TickRecord record{};
    record.tick = now_;
    record.start_ns = now_ns();
    record.orientation[3] = 1.0F;
    writer_.publish_state(record);
    writer_.end_tick(record.start_ns);
  }
  /// What the window asked for since the last call.
  std::vector<std::uint64_t> asked_tools() {
    std::vector<std::uint64_t> tools;
    while (const auto command = server_.take_command()) tools.push_back(command->argument);
    return tools;
  }
  void say(Lifecycle lifecycle) { writer_.set_lifecycle(lifecycle); }

 private:
  static std::uint64_t now_ns() {
    return static_cast<std::uint64_t>(std::chrono::steady_clock::now().time_since_epoch().count());
  }

  std::vector<Density> density_;
  SegmentWriter writer_;
  SegmentServer server_;
  Tick now_ = 0;
};

/// Real events at the screen that DISPLAY names.
void act(const std::string& events) {
  // Where xdotool itself could not be started nothing was sent: that says nothing of the window.
  constexpr int kNotStarted = 127;
  int status = 0;
  for (int tries = 0; tries < 3; ++tries) {
    status = std::system(("xdotool " + events + " >/dev/null").c_str());
    if (!WIFEXITED(status) || WEXITSTATUS(status) != kNotStarted) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
  }
  CAPTURE(events);
  REQUIRE(status == 0);
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
}

/// A window, and a user before it.
class User {
 public:
  explicit User(const fs::path& folder) : out_(folder / "out"), report_(folder / "report.json") {
    VisualizerOptions options;
    options.name = "test";
    options.size = {480, 360};
    options.out = out_;
    options.report = report_;
    options.seconds = 100.0;  // a test that hangs ends
    code_ = std::async(std::launch::async, [options] { return run_window(options); });
    act("search --sync --onlyvisible --name 'kerf: test' mousemove 300 180");
  }

  /// The window with its panels.
  RgbPicture whole() {
    const fs::path file = out_ / "kerf-0001.png";
    act("key s");
    for (int tries = 0; tries < 3000 && !fs::exists(file); ++tries) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    const auto picture = read_png(file);
    REQUIRE(picture);
    fs::remove(file);
    return *picture;
  }
  /// The middle of it, where no panel is.
  std::vector<std::uint8_t> look() {
    const RgbPicture picture = whole();
    const auto width = static_cast<std::size_t>(picture.size.width);
    const auto height = static_cast<std::size_t>(picture.size.height);
    std::vector<std::uint8_t> middle;
    for (std::size_t y = height / 4; y < height * 3 / 4; ++y) {
      const auto row = picture.rgb.begin() + static_cast<std::ptrdiff_t>(y * width * 3);
      middle.insert(middle.end(), row + picture.size.width * 3 * 5 / 9,
                    row + picture.size.width * 3 * 8 / 9);
    }
    return middle;
  }

  int quit() {
    act("key q");
    return code_.get();
  }
  [[nodiscard]] const fs::path& out() const { return out_; }
  [[nodiscard]] Controller& controller() { return controller_; }
  [[nodiscard]] nlohmann::json report() const {
    return nlohmann::json::parse(std::ifstream(report_));
  }

 private:
  fs::path out_, report_;
  Controller controller_;
  std::future<int> code_;
};

}  // namespace

TEST_CASE("keys and mouse work the window") {
  if (!have("Xvfb") || !have("xdotool")) return;
  const Screen screen;
  User user(screen.folder);
  const auto first = user.look();
  CHECK(user.look() == first);

  SUBCASE("v takes the next renderer") {
    act("key v");
    CHECK(user.look() != first);
    CHECK(user.quit() == 0);
    CHECK(user.report()["renderer"] == "blend");
  }
  SUBCASE("c cuts the volumes open and closes them again") {
    act("key c");
    CHECK(user.look() != first);
    act("key c");
    CHECK(user.look() == first);
    CHECK(user.quit() == 0);
  }
  SUBCASE("a drag turns, r turns back, the wheel zooms") {
    act("mousedown 1 mousemove 360 200 sleep 0.2 mouseup 1");
    CHECK(user.look() != first);
    act("key r");
    CHECK(user.look() == first);
    act("click 4");
    CHECK(user.look() != first);
    CHECK(user.quit() == 0);
  }
  SUBCASE("a drag with shift, or with the middle button, moves") {
    act("keydown shift mousedown 1 mousemove 340 200 sleep 0.2 mouseup 1 keyup shift");
    const auto shifted = user.look();
    CHECK(shifted != first);
    act("key r mousemove 300 180");
    CHECK(user.look() == first);
    act("mousedown 2 mousemove 340 200 sleep 0.2 mouseup 2");
    CHECK(user.look() == shifted);
    CHECK(user.quit() == 0);
  }
  SUBCASE("a digit asks the controller for that tool, where there is one") {
    act("key 2 key 9");
    CHECK(user.controller().asked_tools() == std::vector<std::uint64_t>{1});
    CHECK(user.quit() == 0);
  }
  SUBCASE("e exports the surface") {
    act("key e");
    CHECK(user.quit() == 0);
    CHECK(fs::file_size(user.out() / "kerf-0001.ply") > 1000);
  }
  SUBCASE("h shows the keys, then no panel at all, then what was there") {
    const auto panels = user.whole().rgb;
    act("key h");
    const auto keys = user.whole().rgb;
    CHECK(keys != panels);
    act("key h");
    const auto nothing = user.whole().rgb;
    CHECK(nothing != keys);
    CHECK(nothing != panels);
    act("key h");
    CHECK(user.whole().rgb != nothing);
    CHECK(user.quit() == 0);
  }
  SUBCASE("a drag that begins on the controls does not turn") {
    act("mousemove 190 330 sleep 0.2 mousedown 1 sleep 0.2 mousemove 300 100 sleep 0.2 mouseup 1 "
        "mousemove 300 180");
    const auto after = user.look();
    CHECK(user.quit() == 0);
    CHECK(after == first);
  }
  SUBCASE("t shows two eyes side by side, and one again") {
    act("key t");
    CHECK(user.look() != first);
    act("key t");
    CHECK(user.look() == first);
    CHECK(user.quit() == 0);
  }
  SUBCASE("a slider changes an opacity while it is dragged, and w writes it") {
    act("key v");
    const auto blended = user.look();
    act("mousemove 131 284 sleep 0.2 mousedown 1 sleep 0.2 mousemove 60 284 sleep 0.2");
    CHECK(user.look() != blended);
    act("mouseup 1 mousemove 300 180 key w");
    CHECK(user.quit() == 0);
    const Opacities written = read_transfer(user.out() / "kerf-0001.toml");
    REQUIRE(written.size() == 1);
    CHECK(written.at("bone") < 0.1);
  }
  SUBCASE("m films until m") {
    act("key m sleep 0.3 key m");
    CHECK(user.quit() == 0);
    std::ifstream video(user.out() / "kerf-0001.y4m", std::ios::binary);
    std::string line;
    std::getline(video, line);
    CHECK(line.find("YUV4MPEG2 W480 H360 F60:1 ") == 0);
    std::getline(video, line);
    CHECK(line == "FRAME");
  }
  SUBCASE("every panel may be shown") {
    act("key p key h sleep 0.2 key p key h");
    CHECK(user.look() == first);
    CHECK(user.quit() == 0);
  }
  const std::string window = "search --name 'kerf: test' ";
  SUBCASE("a window of one pixel, or of nothing on a side, comes back whole") {
    for (const char* size : {"1 1", "0 0", "1 360", "480 1"}) act(window + "windowsize " + size);
    act(window + "windowsize 480 360");
    act("mousemove 300 180");
    CHECK(user.look() == first);
    CHECK(user.quit() == 0);
  }
  SUBCASE("a window that is minimised and restored shows what it showed, and still follows keys") {
    for (int times = 0; times < 3; ++times) {
      act(window + "windowunmap");
      act(window + "windowmap");
    }
    act("mousemove 300 180");
    CHECK(user.look() == first);
    act("key v");
    CHECK(user.look() != first);
    CHECK(user.quit() == 0);
  }
}

TEST_CASE("the exit code of a window tells how the controller ended, and a video cut short") {
  if (!have("Xvfb") || !have("xdotool")) return;
  const Screen screen;
  User user(screen.folder);
  SUBCASE("cleanly") {
    user.controller().say(Lifecycle::clean_end);
    CHECK(user.quit() == 0);
  }
  SUBCASE("by a fault") {
    user.controller().say(Lifecycle::fault);
    CHECK(user.quit() == 1);
  }
  SUBCASE("a window that changes its size ends the video") {
    act("key m");
    act("search --name 'kerf: test' windowsize 400 300");
    CHECK(user.quit() == 1);
  }
  SUBCASE("a video that the user ends is whole") {
    act("key m sleep 0.3 key m");
    act("search --name 'kerf: test' windowsize 400 300");
    CHECK(user.quit() == 0);
  }
}

TEST_CASE("before a hand that is still most frames of a window draw nothing") {
  if (!have("Xvfb")) return;
  const Screen screen;
  Controller controller;
  VisualizerOptions options;
  options.name = "test";
  options.size = {160, 120};
  options.seconds = 2.0;
  options.report = screen.folder / "report.json";
  auto code = std::async(std::launch::async, [&] { return run_window(options); });
  while (code.wait_for(std::chrono::milliseconds(1)) != std::future_status::ready) {
    controller.tick();
  }
  CHECK(code.get() == 0);
  const auto report = nlohmann::json::parse(std::ifstream(*options.report));
  CHECK(report["frames"] > 0);
  CHECK(report["rest_frames"] > report["frames"]);
}

TEST_CASE("a GL error in a window fails the test that makes it" * doctest::should_fail()) {
  if (!have("Xvfb")) FAIL("no screen: nothing to see, and this test has to fail");
  const Screen screen;
  const Window window({64, 64}, Window::Visibility::hidden);
  glEnable(GL_INVALID_ENUM);
}

TEST_CASE("a window whose GL context is lost ends with one line") {
  if (!have("Xvfb")) return;
  const Screen screen;
  const Controller controller;
  VisualizerOptions options;
  options.name = "test";
  options.seconds = 100.0;
  // No test can reset a graphics card: the driver's answer is put in its place.
  const auto driver = glGetGraphicsResetStatus;
  glGetGraphicsResetStatus = []() -> GLenum { return GL_INNOCENT_CONTEXT_RESET; };
  CHECK_THROWS_WITH_AS(static_cast<void>(run_window(options)),
                       "OpenGL: the graphics card was reset by another program and its memory is "
                       "lost; start kerf-visualizer again",
                       VisualizerError);
  glGetGraphicsResetStatus = driver;
}

TEST_CASE("when the X server dies the window ends with one line, and the controller goes on") {
  if (!have("Xvfb") || !have("xdotool")) return;
  for (const int signal : {SIGTERM, SIGKILL}) {
    CAPTURE(signal);
    Screen screen;
    Controller controller;
    Process window({KERF_TEST_BIN "/kerf-visualizer", "--name", "test"}, screen.folder / "said");
    act("search --sync --onlyvisible --name 'kerf: test'");
    screen.end(signal);
    CHECK(window.wait() == 2);
    CHECK(window.output() ==
          "kerf-visualizer: window: the X server is gone; the controller goes on, so start "
          "kerf-visualizer again on another screen or with --headless --out DIR\n");
    controller.tick();
    VisualizerOptions options;
    options.name = "test";
    options.headless = true;
    options.frames = 1;
    options.seconds = 0.5;
    options.size = {64, 48};
    options.out = screen.folder / "later";
    CHECK(run_headless(options) == 0);
    CHECK(fs::exists(options.out / "frame-0001.png"));
  }
}
