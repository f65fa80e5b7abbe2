// SPDX-License-Identifier: Apache-2.0
#include "visualizer/app/options.hpp"

#include <array>
#include <charconv>
#include <iomanip>
#include <iostream>
#include <sstream>
#include <string_view>
#include <utility>

#include "shared/text/command_line.hpp"
#include "shared/text/text.hpp"
#include "visualizer/panels/key_table.hpp"
#include "visualizer/render/renderer.hpp"
#include "visualizer/scene/appearance.hpp"
#include "visualizer/scene/camera_pose.hpp"
#include "visualizer/scene/visualizer_error.hpp"

namespace kerf {

namespace {

constexpr const char* kBenchSize = "512x512";  // the paper's

std::string footer() {
  std::ostringstream text;
  text << "In the window (files go to --out):\n";
  constexpr int kColumn = 22;
  for (const auto& [key, meaning] : kKeys) {
    text << "  " << std::left << std::setw(kColumn) << key << meaning << "\n";
  }
  text << "With --hand-socket:\n";
  for (const auto& [key, meaning] : kHandKeys) {
    text << "  " << std::left << std::setw(kColumn) << key << meaning << "\n";
  }
  text << "Exit codes: 0 fine, 1 the controller did not end cleanly or a video is cut short, 2 bad "
          "input or set-up, or the screen or the graphics card is gone.";
  return text.str();
}

/// Options that are words at first.
struct Words {
  std::optional<std::string> aov;
  std::string size = "800x600", gradient{name_of(kDefaultGradient)}, panels = "on";
  std::optional<std::string> camera;
};

/// The view settings at first. Returns --renderer.
Option declare_look(Arguments& app, VisualizerOptions& o, Words& words) {
  const Option renderer =
      app.option("--renderer", o.settings.renderer,
                 "how volumes are drawn: " + listed(renderer_kinds()) +
                     "; with commas one for each volume, such as surface,blend (default: iso, or "
                     "cast if OpenGL draws on the processor)")
          .shown_as("KIND[,KIND...]");
  app.option(
         "--camera", words.camera,
         "where pictures are seen from: EYE,TARGET,UP, nine numbers (x,y,z in mm; UP is upright "
         "in the picture), or a file as n in the window writes it (default: all volumes)")
      .shown_as("CAMERA");
  const Option present =
      app.flag("--present", o.present,
               "shows this view to all viewers of the controller that follow it: one presents");
  app.flag("--follow-view", o.follow_view,
           "shows the view that another viewer or a page presents, until it is moved; r follows it "
           "again")
      .excludes(present);
  app.option("--gradient", words.gradient,
             "what volumes are shaded from: central (two voxels), corners (2x2x2 means), farid5 "
             "(5x5x5 voxels) or adaptive (15x15x15 but at edges)")
      .shows_default();
  app.option("--transfer", o.transfer,
             "opacity of each material, TOML, for blend, slices and cast-blend; in the window w "
             "writes it")
      .shown_as("FILE");
  app.flag("--voxel-tool", o.settings.voxel_tool,
           "the tool as a volume of voxels, which the renderer draws as it does the others and "
           "the clip plane cuts too");
  app.flag("--colour-blind", o.settings.colour_blind,
           "materials in Okabe and Ito's colours, which any colour vision can distinguish; in the "
           "window y");
  app.option("--panels", words.panels,
             "off: headless without panels and banner; a window begins as h leaves it")
      .one_of({"on", "off"})
      .shows_default();
  app.option("--panel-scale", o.panel_scale,
             "size of the panels, as far as the picture has room for it (default: the display's, "
             "headless 1)")
      .within(1.0, 8.0);
  app.flag("--stereo", o.settings.stereo.on, "two eyes side by side, each in half the width");
  app.option("--eyes", o.settings.stereo.eyes_mm,
             "stereo: mm between the eyes; negative: crossed (default: 1/30 of --convergence)")
      .within(-1e3, 1e3);
  app.option("--convergence", o.settings.stereo.convergence_mm,
             "stereo: mm to what lies in the screen (default: to where the camera looks)")
      .within(1.0, 1e6);
  return renderer;
}

/// How long a run is, and where.
void declare_run(Arguments& app, VisualizerOptions& o) {
  app.option("--seconds", o.seconds, "end after this time").within(0.0, 1e6);
  app.option(
         "--ends-after", o.ends_after_s,
         "in a window: this much servo time after arming the run ends; the window says so 120 s "
         "and 10 s before")
      .within(0.0, 1e6)
      .shown_as("S");
  app.option("--wait", o.wait_s, "seconds to wait for the controller")
      .within(0.0, 1e6)
      .shows_default();
  app.option("--hand-socket", o.hand_socket,
             "the pointer, keys or a gamepad lead the hand of a kerf-emulator that has this "
             "--hand-socket; in a window")
      .shown_as("PATH");
  app.flag("--full-screen", o.full_screen, "the window fills its monitor; in the window F11");
  app.option("--monitor", o.monitor,
             "in a window: where it opens, counted from 1; an unknown one is refused with those "
             "that there are")
      .within(1, 64)
      .shown_as("N");
  app.flag("--mute", o.mute, "no sound in the window, until a is pressed");
  app.option("--attached", o.attached,
             "make this empty file once the controller is shown: a short run may begin")
      .shown_as("FILE");
  const Option choice =
      app.option("--choice", o.choice,
                 "in a window: o opens a list of scenes and volumes; the window ends with the path "
                 "of the chosen one in this new file, for who started it")
          .shown_as("FILE");
  app.option("--open-in", o.open_in, "where that list begins")
      .shown_as("FOLDER")
      .shows_default()
      .needs(choice);
  app.option("--cpu", o.cpus, "cores to run on, e.g. 0,1 (default: all but the last)")
      .split_at_commas()
      .within(0, 1023);
}

/// What is written beside pictures.
void declare_files(Arguments& app, VisualizerOptions& o, const Option& headless) {
  app.option("--export", o.mesh,
             "surface of all solid volumes as a closed mesh in mm, FILE.stl or FILE.ply (with "
             "colours): headless at the end, in the window with e")
      .shown_as("FILE");
  app.option("--sheet", o.sheet,
             "headless: at the end one PNG with the final state by every renderer")
      .shown_as("FILE")
      .needs(headless);
  app.option("--lead", o.lead,
             "headless: lead a controller in lock-step (its --until) from picture to picture")
      .shown_as("FIFO")
      .needs(headless);
  app.option("--fps", o.video_hz, "record: frames per second of servo time")
      .within(1, 240)
      .shows_default();
  app.option("--report", o.report, "write times and counts to this JSON file").shown_as("FILE");
}

/// What --aov asks for, of pictures with these settings.
AovChoice aov_of(const std::string& text, const ViewSettings& settings) {
  const auto refused = [](const std::string& problem) {
    return VisualizerError("--aov: " + problem);
  };
  AovChoice choice;
  std::istringstream words(text);
  for (std::string word; std::getline(words, word, ',');) {
    constexpr std::array<std::string_view, 2> kKnown{"depth", "normal"};
    if (word != kKnown[0] && word != kKnown[1])
      throw refused(one_line(word) + unknown_word(word, kKnown));
    if (std::exchange(word == kKnown[0] ? choice.depth : choice.normal, true)) {
      throw refused(word + " is there twice; leave one out");
    }
  }
  if (settings.stereo.on) throw refused("--stereo has two pictures in one; leave one of both out");
  std::istringstream kinds(settings.renderer);
  for (std::string kind; choice.normal && std::getline(kinds, kind, ',');) {
    if (!is_translucent(kind)) continue;
    throw refused("normal: " + kind + " shows many depths in one pixel; take iso, surface or cast");
  }
  return choice;
}

void declare_bench(Arguments& app, VisualizerOptions& o) {
  const Option bench = app.flag(
      "--bench", o.bench, "time every renderer, without a controller (512x512 unless --size)");
  app.option("--page", o.page, "bench: write the tables as their part of this Markdown file")
      .shown_as("FILE")
      .needs(bench);
}

/// Throws if an option needs a window and the run has none.
void check_window(const VisualizerOptions& options) {
  if (!options.headless && !options.bench) return;
  const std::string without = options.headless ? "--headless" : "--bench";
  if (options.hand_socket) {
    throw VisualizerError("--hand-socket: " + without +
                          " has no pointer that could lead a hand; give one of the two");
  }
  if (options.full_screen || options.monitor > 0) {
    throw VisualizerError((options.full_screen ? "--full-screen: " : "--monitor: ") + without +
                          " has no window; give one of the two");
  }
}

/// Reads the words of the options, and the files that they name.
void take_words(const Words& words, VisualizerOptions& options) {
  options.size = parse_size(words.size);
  options.panels = words.panels == "on";
  check_renderers(options.settings.renderer);
  if (words.aov) options.aov = aov_of(*words.aov, options.settings);
  options.settings.gradient = gradient_named(words.gradient);
  if (words.camera) {
    options.settings.camera = read_camera(*words.camera);
    if (is_camera_file(*words.camera)) options.camera_file = *words.camera;
  }
  if (options.transfer) options.settings.opacities = read_transfer(*options.transfer);
}

}  // namespace

PictureSize parse_size(const std::string& text) {
  const std::string_view all = text;
  const std::size_t cross = all.find('x');
  const auto side = [](std::string_view digits, int& value) {
    const auto [end, error] = std::from_chars(digits.begin(), digits.end(), value);
    return error == std::errc() && end == digits.end() && value >= 1 &&
           value <= PictureSize::kMaxSide;
  };
  PictureSize size;
  if (cross == std::string_view::npos || !side(all.substr(0, cross), size.width) ||
      !side(all.substr(cross + 1), size.height)) {
    throw VisualizerError("--size: " + text +
                          " is no size; give WIDTHxHEIGHT in pixels, each 1 to " +
                          std::to_string(PictureSize::kMaxSide) + ", for example 640x480");
  }
  return size;
}

std::optional<VisualizerOptions> parse_options(int argc, const char* const* argv) {
  VisualizerOptions options;
  Words words;
  CommandLine app("Shows the run of a kerf-controller, in a window or as PNG pictures.",
                  "kerf-visualizer", "kerf-visualizer " KERF_VERSION);
  app.footer(footer());
  app.option("--name", options.name, "the controller's name").shows_default();
  const Option sized =
      app.option("--size", words.size,
                 "width and height in pixels (default: 800x600; a window: 1280x800 at 96 dots per "
                 "inch, as far as the screen has room)")
          .shown_as("WxH");
  const Option renderer = declare_look(app, options, words);
  const Option headless =
      app.flag("--headless", options.headless, "no window: pictures into --out");
  const Option frames = app.option("--frames", options.frames, "headless: number of pictures")
                            .within(1, 9999)
                            .shows_default();
  app.option("--every-ticks", options.every_ticks,
             "headless: servo ticks between pictures (default: one second)")
      .within(1.0, 0x1p40);
  const Option aov =
      app.option("--aov", words.aov,
                 "headless: beside each picture as arrays of NumPy, depth (mm along the view) and "
                 "normal (of length 1, in the scene's axes); with a comma both")
          .shown_as("WHAT[,WHAT]")
          .needs(headless);
  app.option("--out", options.out, "folder for pictures and screenshots")
      .shown_as("DIR")
      .shows_default();
  declare_run(app, options);
  const Option record = app.option("--record", options.record,
                                   "video in true time: a file, raw (y4m) or by ffmpeg (.mp4, "
                                   ".mkv), a pipe, or - for stdout; "
                                   "headless without pictures unless --frames")
                            .shown_as("FILE");
  declare_files(app, options, headless);
  declare_bench(app, options);
  try {
    if (!app.parse(argc, argv, std::cout)) return std::nullopt;
  } catch (const UsageError& problem) {
    throw VisualizerError(problem.what());
  }
  if (record.given() && !frames.given() && !aov.given()) options.frames = 0;
  if (options.bench && !sized.given()) words.size = kBenchSize;
  options.size_is_given = sized.given();
  options.renderer_is_given = renderer.given();
  check_window(options);
  take_words(words, options);
  return options;
}

}  // namespace kerf
