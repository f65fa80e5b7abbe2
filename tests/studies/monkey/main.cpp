// SPDX-License-Identifier: Apache-2.0
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <utility>

#include <unistd.h>

#include "shared/posix/program.hpp"
#include "shared/posix/stop_signals.hpp"
#include "shared/text/command_line.hpp"
#include "tests/studies/monkey/monkey.hpp"
#include "visualizer/gl/context.hpp"
#include "visualizer/gl/window.hpp"
#include "visualizer/picture/image_files.hpp"
#include "visualizer/scene/frame_report.hpp"
#include "visualizer/scene/visualizer_error.hpp"

namespace {

namespace fs = std::filesystem;
using kerf::Monkey;

struct MonkeyOptions {
  std::uint32_t seed = 1;
  std::uint32_t events = 200;
  double seconds = 10.0;
  fs::path out = "out/monkey";
  bool trace = false, window = false, large = false;
};

/// A private folder for the socket and for what keys write.
struct Place {
  fs::path path = fs::temp_directory_path() / ("kerf-monkey-" + std::to_string(::getpid()));
  Place() {
    fs::create_directories(path);
    fs::permissions(path, fs::perms::owner_all);
    setenv("XDG_RUNTIME_DIR", path.c_str(), 1);
  }
  ~Place() { fs::remove_all(path); }
};

std::string g_gl_fault;  ///< the first one since it was looked at

/// One event of the monkey; what GL finds wrong with it is as bad as a wrong picture.
void act(Monkey& monkey) {
  monkey.act();
  if (!g_gl_fault.empty()) throw kerf::VisualizerError(std::exchange(g_gl_fault, {}));
}

void write(const fs::path& file, const kerf::MonkeyPicture& picture) {
  if (picture.size.width > 0) kerf::write_png(file, picture.size, picture.rgb);
}

/// True if all went well; else prints what did not, and writes both pictures.
bool play(kerf::GlContext& context, std::uint32_t seed, const fs::path& files,
          const MonkeyOptions& options, Monkey::Count& count) {
  auto* const window = options.window ? dynamic_cast<kerf::Window*>(&context) : nullptr;
  Monkey monkey(context, {seed, files, window, options.large});
  try {
    while (monkey.count().events < options.events && !kerf::stop_requested()) {
      act(monkey);
      if (options.trace) std::fprintf(stderr, "%s\n", monkey.event().c_str());
    }
    count += monkey.count();
    return true;
  } catch (const kerf::VisualizerError& problem) {
    count += monkey.count();
    kerf::make_folder(options.out);
    write(options.out / "shown.png", monkey.shown());
    write(options.out / "expected.png", monkey.expected());
    std::fprintf(stderr,
                 "seed %u, event %ju (%s): %s; both pictures are in %s, again: "
                 "kerf-visualizer-monkey%s --seed %u --events %ju --seconds 0 --trace\n",
                 seed, std::uintmax_t{monkey.count().events}, monkey.event().c_str(),
                 problem.what(), options.out.c_str(), options.large ? " --large" : "", seed,
                 std::uintmax_t{monkey.count().events});
    return false;
  }
}

int run(const MonkeyOptions& options) {
  const Place place;
  kerf::report_gl_faults([](const std::string& text) { g_gl_fault = "OpenGL: " + text; });
  constexpr kerf::PictureSize kWindow{640, 480};
  const std::unique_ptr<kerf::GlContext> context =
      options.window ? std::make_unique<kerf::Window>(kerf::WindowPlace{.size = kWindow},
                                                      kerf::Window::Visibility::shown)
                     : kerf::make_headless_context();
  const kerf::Stopwatch watch;
  Monkey::Count count;
  std::uint32_t seed = options.seed;
  int wrong = 0;
  do {
    const fs::path files = place.path / "files";
    if (!play(*context, seed++, files, options, count)) ++wrong;
    fs::remove_all(files);
  } while (!kerf::stop_requested() && watch.wall_ms() < 1e3 * options.seconds);
  std::fprintf(stderr, "seeds %u to %u: %ju events, %ju frames, %ju compared, %d seeds wrong\n",
               options.seed, seed - 1, std::uintmax_t{count.events}, std::uintmax_t{count.frames},
               std::uintmax_t{count.compared}, wrong);
  return wrong > 0 ? 1 : 0;
}

}  // namespace

int main(int argc, char** argv) {
  return kerf::run_program("kerf-visualizer-monkey", [&] {
    MonkeyOptions options;
    kerf::CommandLine app(
        "Works a window without a screen at random, and compares what it shows with pictures drawn "
        "anew.",
        "kerf-visualizer-monkey", "kerf-visualizer-monkey " KERF_VERSION);
    app.option("--seed", options.seed, "of the first round; the next ones count up")
        .shows_default();
    app.option("--events", options.events, "of each round").within(1, 1e9).shows_default();
    app.option("--seconds", options.seconds, "rounds begin until this time is over")
        .within(0.0, 1e6)
        .shows_default();
    app.option("--out", options.out, "folder for the two pictures of a round that went wrong")
        .shown_as("DIR")
        .shows_default();
    app.flag("--window", options.window, "show it in a window too, on the screen of DISPLAY");
    app.flag("--large", options.large, "pictures of 800x600 and 1100x760 pixels only");
    app.flag("--trace", options.trace, "tell each event");
    app.footer("Exit codes: 0 fine, 1 a picture was wrong, 2 bad input or set-up.");
    if (!app.parse(argc, argv, std::cout)) return 0;
    if (std::freopen("/dev/null", "w", stdout) == nullptr) return 2;  // the messages of keys
    kerf::catch_stop_signals();
    return run(options);
  });
}
