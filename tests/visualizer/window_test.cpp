// SPDX-License-Identifier: Apache-2.0
// The window on a screen of its own (Xvfb), worked with real key and mouse events (xdotool).
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
#include <fcntl.h>
#include <nlohmann/json.hpp>
#include <png.h>
#include <sys/wait.h>
#include <unistd.h>

#include "shared/segment/hand_over.hpp"
#include "shared/segment/writer.hpp"
#include "visualizer/run.hpp"
#include "visualizer/transfer_file.hpp"

using namespace kerf;
namespace fs = std::filesystem;

namespace {

constexpr const char* kScene = R"({
  "volumes": [{"name": "block", "solid": true}],
  "tools": [],
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
    kill(server_, SIGTERM);
    waitpid(server_, nullptr, 0);
    fs::remove_all(folder);
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

/// A window that shows a block, and a user before it.
class User {
 public:
  explicit User(const fs::path& folder)
      : out_(folder / "out"),
        report_(folder / "report.json"),
        writer_(SegmentWriter::create(block(density_))),
        server_("test", writer_) {
    writer_.set_lifecycle(Lifecycle::run);
    VisualizerOptions options;
    options.name = "test";
    options.size = {480, 360};
    options.out = out_;
    options.report = report_;
    options.seconds = 100.0;  // a test that hangs ends
    code_ = std::async(std::launch::async, [options] { return run_window(options); });
    act("search --sync --onlyvisible --name 'kerf: test' mousemove 300 180");
  }

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

  /// The middle of the window, where no panel is.
  std::vector<std::uint8_t> look() {
    const fs::path file = out_ / "kerf-0001.png";
    act("key s");
    for (int tries = 0; tries < 3000 && !fs::exists(file); ++tries) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    REQUIRE(png_image_begin_read_from_file(&image, file.c_str()) != 0);
    image.format = PNG_FORMAT_RGB;
    std::vector<std::uint8_t> all(PNG_IMAGE_SIZE(image));
    REQUIRE(png_image_finish_read(&image, nullptr, all.data(), 0, nullptr) != 0);
    fs::remove(file);
    std::vector<std::uint8_t> middle;
    for (std::size_t y = image.height / 4; y < image.height * 3 / 4; ++y) {
      const auto row = all.begin() + static_cast<std::ptrdiff_t>(y * image.width * 3);
      middle.insert(middle.end(), row + image.width * 3 * 5 / 9, row + image.width * 3 * 8 / 9);
    }
    return middle;
  }

  int quit() {
    act("key q");
    return code_.get();
  }
  [[nodiscard]] const fs::path& out() const { return out_; }
  [[nodiscard]] nlohmann::json report() const {
    return nlohmann::json::parse(std::ifstream(report_));
  }

 private:
  fs::path out_, report_;
  std::vector<Density> density_;
  SegmentWriter writer_;
  SegmentServer server_;
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
    user.act("key v");
    CHECK(user.look() != first);
    CHECK(user.quit() == 0);
    CHECK(user.report()["renderer"] == "blend");
  }
  SUBCASE("c cuts the volumes open and closes them again") {
    user.act("key c");
    CHECK(user.look() != first);
    user.act("key c");
    CHECK(user.look() == first);
    CHECK(user.quit() == 0);
  }
  SUBCASE("a drag turns, r turns back, the wheel zooms") {
    user.act("mousedown 1 mousemove 360 200 sleep 0.2 mouseup 1");
    CHECK(user.look() != first);
    user.act("key r");
    CHECK(user.look() == first);
    user.act("click 4");
    CHECK(user.look() != first);
    CHECK(user.quit() == 0);
  }
  SUBCASE("a drag that begins on the controls does not turn") {
    user.act(
        "mousemove 190 330 sleep 0.2 mousedown 1 sleep 0.2 mousemove 300 100 sleep 0.2 mouseup 1 "
        "mousemove 300 180");
    const auto after = user.look();
    CHECK(user.quit() == 0);
    CHECK(after == first);
  }
  SUBCASE("t shows two eyes side by side, and one again") {
    user.act("key t");
    CHECK(user.look() != first);
    user.act("key t");
    CHECK(user.look() == first);
    CHECK(user.quit() == 0);
  }
  SUBCASE("a slider changes an opacity while it is dragged, and w writes it") {
    user.act("key v");
    const auto blended = user.look();
    user.act("mousemove 131 284 sleep 0.2 mousedown 1 sleep 0.2 mousemove 60 284 sleep 0.2");
    CHECK(user.look() != blended);
    user.act("mouseup 1 mousemove 300 180 key w");
    CHECK(user.quit() == 0);
    const Opacities written = read_transfer(user.out() / "kerf-0001.toml");
    REQUIRE(written.size() == 1);
    CHECK(written.at("bone") < 0.1);
  }
  SUBCASE("m films until m") {
    user.act("key m sleep 0.3 key m");
    CHECK(user.quit() == 0);
    std::ifstream video(user.out() / "kerf-0001.y4m", std::ios::binary);
    std::string line;
    std::getline(video, line);
    CHECK(line.find("YUV4MPEG2 W480 H360 F60:1 ") == 0);
    std::getline(video, line);
    CHECK(line == "FRAME");
  }
  SUBCASE("every panel may be shown") {
    user.act("key p key h sleep 0.2 key p key h");
    CHECK(user.look() == first);
    CHECK(user.quit() == 0);
  }
  SUBCASE("a window that is tiny, hidden and shown again goes on") {
    const std::string window = "search --name 'kerf: test' ";
    user.act(window + "windowsize 1 1");
    user.act(window + "windowunmap");
    user.act(window + "windowmap");
    user.act(window + "windowsize 480 360");
    user.act("mousemove 300 180");
    CHECK(user.look() == first);
    CHECK(user.quit() == 0);
  }
}
