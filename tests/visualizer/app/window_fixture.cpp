// SPDX-License-Identifier: Apache-2.0
#include "tests/visualizer/app/window_fixture.hpp"

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <thread>

#include <dlfcn.h>
#include <doctest/doctest.h>
#include <fcntl.h>
#include <sys/wait.h>

#include "tests/json.hpp"
#include "visualizer/app/run.hpp"
#include "visualizer/picture/image_files.hpp"
// After all others: it defines plain words.
#include <X11/Xlib.h>
// After Xlib.
#include <X11/Xatom.h>
#include <X11/Xutil.h>

namespace kerf::test {

namespace fs = std::filesystem;

namespace {

constexpr const char* kScene = R"({
  "volumes": [%],
  "tools": [{"name": "ball", "profile": [[-1, 0], [0, 1], [1, 0]]},
            {"name": "pin", "profile": [[0, 0], [1, 1]]}],
  "materials": [{"name": "none", "iso": 0, "colour": [0, 0, 0]},
                {"name": "bone", "iso": 0.3, "colour": [0.8, 0.7, 0.5]}]})";
constexpr VoxelGrid kGrid{32, 24, 16};

SegmentSpec blocks_of(std::vector<Density>& density, int blocks) {
  density.assign(kGrid.voxel_count(), 50'000);
  SegmentSpec spec;
  std::string names;
  for (int i = 0; i < blocks; ++i) {
    names +=
        i == 0 ? R"({"name": "block", "solid": true})" : R"(, {"name": "other", "solid": true})";
    SegmentVolumeSpec& volume = spec.volumes.emplace_back();
    volume.grid = kGrid;
    volume.origin_mm = {0.0, 20.0 * i, 0.0};  // they overlap
    volume.density = density;
  }
  spec.scene_json = kScene;
  spec.scene_json.replace(spec.scene_json.find('%'), 1, names);
  return spec;
}

std::uint64_t now_ns() {
  return static_cast<std::uint64_t>(std::chrono::steady_clock::now().time_since_epoch().count());
}

/// What `User::look` takes of a picture.
std::vector<std::uint8_t> middle_of(const RgbPicture& picture) {
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

void send(const std::string& events) {
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
}

/// Until the window and its screen show what was sent.
void let_it_show() {
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
}

void wait_for(const fs::path& file) {
  for (int tries = 0; tries < 3000 && !fs::exists(file); ++tries) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  REQUIRE(fs::exists(file));
}

}  // namespace

RgbPicture read_screen(PictureSize size) {
  Display* const display = XOpenDisplay(nullptr);
  REQUIRE(display != nullptr);
  XImage* const image =
      XGetImage(display, DefaultRootWindow(display), 0, 0, static_cast<unsigned>(size.width),
                static_cast<unsigned>(size.height), AllPlanes, ZPixmap);
  REQUIRE(image != nullptr);
  RgbPicture picture{size, {}};
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const unsigned long pixel = XGetPixel(image, x, y);
      for (const int shift : {16, 8, 0}) {
        picture.rgb.push_back(static_cast<std::uint8_t>(pixel >> shift));
      }
    }
  }
  XDestroyImage(image);
  XCloseDisplay(display);
  return picture;
}

bool have(const char* program) {
  const std::string command = std::string("command -v ") + program + " >/dev/null 2>&1";
  if (std::system(command.c_str()) == 0) return true;
  MESSAGE("skipped: " << std::string(program)
                      << " is not installed (.ci/packages.txt, group check)");
  return false;
}

Screen::Screen(const std::string& size, bool has_glx) {
  int ready[2];
  REQUIRE(pipe(ready) == 0);
  server_ = fork();
  if (server_ == 0) {
    const std::string to = std::to_string(ready[1]);
    const int quiet = open("/dev/null", O_WRONLY);
    dup2(quiet, STDERR_FILENO);
    const std::string pixels = size + "x24";
    execlp("Xvfb", "Xvfb", "-displayfd", to.c_str(), "-screen", "0", pixels.c_str(), "-nolisten",
           "tcp", has_glx ? "+extension" : "-extension", "GLX", static_cast<char*>(nullptr));
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

Screen::~Screen() {
  end(SIGTERM);
  fs::remove_all(folder);
}

void Screen::end(int signal) {
  if (server_ < 0) return;
  kill(server_, signal);
  waitpid(server_, nullptr, 0);
  server_ = -1;
}

Controller::Controller(int blocks)
    : writer_(SegmentWriter::create(blocks_of(density_, blocks))),
      server_("test", writer_, {.tools = 2}) {
  writer_.set_lifecycle(Lifecycle::run);
}

void Controller::tick() {
  writer_.begin_tick(++now_);
  TickRecord record{};
  record.tick = now_;
  record.flags = flags_;
  record.start_ns = now_ns();
  record.orientation[3] = 1.0F;
  writer_.publish_state(record);
  writer_.end_tick(record.start_ns);
}

std::vector<std::uint64_t> Controller::asked_tools() {
  std::vector<std::uint64_t> tools;
  while (const auto command = server_.take_command()) tools.push_back(command->argument);
  return tools;
}

int Controller::asked(CommandKind kind) {
  int asked = 0;
  while (const auto command = server_.take_command()) asked += command->kind == kind ? 1 : 0;
  return asked;
}

OtherWindow::OtherWindow(const std::array<int, 4>& place) {
  Display* const display = XOpenDisplay(nullptr);
  REQUIRE(display != nullptr);
  display_ = display;
  XSetWindowAttributes attributes{};
  attributes.override_redirect = True;
  window_ =
      XCreateWindow(display, DefaultRootWindow(display), place[0], place[1],
                    static_cast<unsigned>(place[2]), static_cast<unsigned>(place[3]), 0,
                    CopyFromParent, InputOutput, CopyFromParent, CWOverrideRedirect, &attributes);
  XMapRaised(display, window_);
  XSync(display, False);
}

OtherWindow::~OtherWindow() {
  XCloseDisplay(static_cast<Display*>(display_));
}

void OtherWindow::take_focus() const {
  Display* const display = static_cast<Display*>(display_);
  XSetInputFocus(display, window_, RevertToNone, CurrentTime);
  XSync(display, False);
}

DisplayDensity::DisplayDensity(int dots_per_inch) {
  Display* const display = XOpenDisplay(nullptr);
  REQUIRE(display != nullptr);
  display_ = display;
  const std::string text = "Xft.dpi:\t" + std::to_string(dots_per_inch) + "\n";
  XChangeProperty(display, DefaultRootWindow(display), XA_RESOURCE_MANAGER, XA_STRING, 8,
                  PropModeReplace, reinterpret_cast<const unsigned char*>(text.data()),
                  static_cast<int>(text.size()));
  XSync(display, False);
}

DisplayDensity::~DisplayDensity() {
  XCloseDisplay(static_cast<Display*>(display_));
}

namespace {

// As in X11/extensions/Xrandr.h, as far as they are used.
struct RandrResources {
  Time timestamp, configured;
  int crtc_count;
  XID* crtcs;
};
struct RandrCrtc {
  Time timestamp;
  int x, y;
  unsigned width, height;
  XID mode;
  unsigned short rotation;
  int output_count;
  XID* outputs;
};

template <class Function>
Function* randr(void* library, const char* name) {
  void* const found = dlsym(library, name);
  REQUIRE(found != nullptr);
  return reinterpret_cast<Function*>(found);
}

void set_crtc(void* library, Display* display, RandrResources* resources, const RandrCrtc& to) {
  const auto set =
      randr<int(Display*, RandrResources*, XID, Time, int, int, XID, unsigned short, XID*, int)>(
          library, "XRRSetCrtcConfig");
  CHECK(set(display, resources, resources->crtcs[0], CurrentTime, to.x, to.y, to.mode, to.rotation,
            to.outputs, to.output_count) == 0);
  XSync(display, False);
}

}  // namespace

UnpluggedMonitor::UnpluggedMonitor()
    : library_(dlopen("libXrandr.so.2", RTLD_NOW)), display_(XOpenDisplay(nullptr)) {
  REQUIRE(library_ != nullptr);
  REQUIRE(display_ != nullptr);
  auto* const display = static_cast<Display*>(display_);
  auto* const resources = randr<RandrResources*(Display*, ::Window)>(
      library_, "XRRGetScreenResources")(display, DefaultRootWindow(display));
  REQUIRE(resources != nullptr);
  resources_ = resources;
  before_ = randr<RandrCrtc*(Display*, RandrResources*, XID)>(library_, "XRRGetCrtcInfo")(
      display, resources, resources->crtcs[0]);
  RandrCrtc none{};
  none.rotation = 1;  // as it is
  set_crtc(library_, display, resources, none);
}

UnpluggedMonitor::~UnpluggedMonitor() {
  auto* const display = static_cast<Display*>(display_);
  set_crtc(library_, display, static_cast<RandrResources*>(resources_),
           *static_cast<RandrCrtc*>(before_));
  XCloseDisplay(display);
}

namespace {

/// X, Y, WIDTH, HEIGHT.
std::array<int, 4> geometry() {
  FILE* const told = popen(
      "xdotool search --sync --onlyvisible --name 'kerf: test' getwindowgeometry --shell", "r");
  REQUIRE(told != nullptr);
  std::array<int, 4> all{};
  std::array<char, 128> line{};
  while (std::fgets(line.data(), line.size(), told) != nullptr) {
    std::sscanf(line.data(), "X=%d", &all[0]);
    std::sscanf(line.data(), "Y=%d", &all[1]);
    std::sscanf(line.data(), "WIDTH=%d", &all[2]);
    std::sscanf(line.data(), "HEIGHT=%d", &all[3]);
  }
  CHECK(pclose(told) == 0);
  return all;
}

}  // namespace

PictureSize seen_size() {
  const auto all = geometry();
  return {all[2], all[3]};
}

std::array<int, 2> seen_place() {
  const auto all = geometry();
  return {all[0], all[1]};
}

void act(const std::string& events) {
  send(events);
  let_it_show();
}

User::User(const fs::path& folder, int blocks)
    : out_(folder / "out"),
      report_(folder / "report.json"),
      choice_(folder / "choice"),
      controller_(blocks) {
  const fs::path scenes = folder / "scenes";
  fs::create_directories(scenes);
  std::ofstream(scenes / "none.toml") << "[tool]\n";
  std::ofstream(scenes / "one.toml") << "[[volume]]\n";
  VisualizerOptions options;
  options.name = "test";
  options.mute = true;
  options.size = {480, 360};
  options.out = out_;
  options.report = report_;
  options.choice = choice_;
  options.open_in = scenes;
  options.seconds = 100.0;  // a test that hangs ends
  code_ = std::async(std::launch::async, [options] { return run_window(options); });
  act("search --sync --onlyvisible --name 'kerf: test' mousemove 300 180");
}

RgbPicture User::whole() {
  const fs::path file = out_ / "kerf-0001.png";
  send("key s");
  wait_for(file);
  const auto picture = read_png(file);
  REQUIRE(picture);
  fs::remove(file);
  return *picture;
}

void User::begin_video() {
  send("key m");
  wait_for(out_ / (have_ffmpeg() ? "kerf-0001.mp4" : "kerf-0001.y4m"));
}

std::vector<std::uint8_t> User::picture() {
  return middle_of(whole());
}

std::vector<std::uint8_t> User::look_at_screen() {
  const PictureSize size = whole().size;
  let_it_show();
  return middle_of(read_screen(size));
}

int User::quit() {
  send("key q");
  return code_.get();
}

std::string User::choice() const {
  std::string line;
  std::getline(std::ifstream(choice_), line);
  return line;
}

test::ReadJson User::report() const {
  return test::read_json_file(report_);
}

}  // namespace kerf::test
