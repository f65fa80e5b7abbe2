// SPDX-License-Identifier: Apache-2.0
#include "visualizer/app/options.hpp"

#include <algorithm>
#include <charconv>
#include <iomanip>
#include <iostream>
#include <sstream>
#include <string_view>

#include <CLI/CLI.hpp>

#include "visualizer/app/keys.hpp"
#include "visualizer/error.hpp"
#include "visualizer/render/renderer.hpp"
#include "visualizer/render/renderer_choice.hpp"
#include "visualizer/view/transfer_file.hpp"

namespace kerf {

namespace {

constexpr const char* kBenchSize = "512x512";  // the paper's

/// CLI11 explains over several lines; a user wants one.
std::string one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

std::string footer() {
  std::ostringstream text;
  text << "In the window (files go to --out):\n";
  constexpr int kColumn = 22;
  for (const auto& [key, meaning] : kKeys) {
    text << "  " << std::left << std::setw(kColumn) << key << meaning << "\n";
  }
  text << "Exit codes: 0 fine, 1 the controller did not end cleanly or a video is cut short, 2 bad "
          "input or set-up, or the screen or the graphics card is gone.";
  return text.str();
}

std::string limits(double lowest, double highest) {
  std::ostringstream text;
  text << std::setprecision(15) << "[" << lowest << " - " << highest << "]";
  return text.str();
}

/// CLI::Range takes "nan" for a number in any range, and names the type once more.
CLI::Validator range(double lowest, double highest) {
  const auto check = [=](const std::string& text) {
    double value = 0.0;
    const bool inside =
        CLI::detail::lexical_cast(text, value) && value >= lowest && value <= highest;
    return inside ? std::string() : text + " is no number in " + limits(lowest, highest);
  };
  return {check, limits(lowest, highest)};
}

}  // namespace

Look first_look(const VisualizerOptions& options) {
  return {.renderer = options.renderer,
          .opacities = options.opacities,
          .gradient = options.gradient,
          .stereo = options.stereo,
          .voxel_tool = options.voxel_tool};
}

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
  std::string size = "800x600";
  std::string gradient(kGradientNames[static_cast<std::size_t>(options.gradient)]);
  CLI::App app("Shows what a kerf-controller feels and mills, in a window or as PNG pictures.",
               "kerf-visualizer");
  app.footer(footer());
  app.set_version_flag("--version", std::string("kerf-visualizer " KERF_VERSION));
  app.add_option("--name", options.name, "the controller's name")->capture_default_str();
  app.add_option("--renderer", options.renderer,
                 "how volumes are drawn: " + known_renderers() +
                     "; with commas one for each volume, such as surface,blend")
      ->type_name("KIND[,KIND...]")
      ->capture_default_str();
  app.add_option("--gradient", gradient,
                 "what iso, surface, blend and slices shade from: central (two voxels), corners "
                 "(2x2x2 means) or farid5 (5x5x5, 8 more bytes a voxel in iso); cast always "
                 "corners")
      ->capture_default_str();
  app.add_option("--size", size, "width and height in pixels")
      ->type_name("WxH")
      ->capture_default_str();
  app.add_option(
         "--transfer", options.transfer,
         "opacity of each material, TOML, for blend, slices and cast-blend; in the window w "
         "writes it")
      ->type_name("FILE");
  app.add_flag("--voxel-tool", options.voxel_tool,
               "the tool as a volume of voxels, which the renderer draws as it does the others and "
               "the clip plane cuts too")
      ->disable_flag_override();
  app.add_flag("--stereo", options.stereo.on, "two eyes side by side, each in half the width")
      ->disable_flag_override();
  app.add_option("--eyes", options.stereo.eyes_mm,
                 "stereo: mm between the eyes; negative: crossed (default: 1/30 of --convergence)")
      ->check(range(-1e3, 1e3));
  app.add_option("--convergence", options.stereo.convergence_mm,
                 "stereo: mm to what lies in the screen (default: to where the camera looks)")
      ->check(range(1.0, 1e6));
  auto* headless = app.add_flag("--headless", options.headless, "no window: pictures into --out")
                       ->disable_flag_override();
  app.add_option("--frames", options.frames, "headless: number of pictures")
      ->check(range(1, 9999))
      ->capture_default_str();
  app.add_option("--every-ticks", options.every_ticks,
                 "headless: servo ticks between pictures (default: one second)")
      ->check(range(1.0, 0x1p40));
  app.add_option("--out", options.out, "folder for pictures and screenshots")
      ->type_name("DIR")
      ->capture_default_str();
  app.add_option("--seconds", options.seconds, "end after this time")->check(range(0.0, 1e6));
  app.add_option("--wait", options.wait_s, "seconds to wait for the controller")
      ->check(range(0.0, 1e6))
      ->capture_default_str();
  app.add_option("--attached", options.attached,
                 "make this empty file once the controller is shown: a short run may begin")
      ->type_name("FILE");
  app.add_option("--cpu", options.cpus, "cores to run on, e.g. 0,1 (default: all but the last)")
      ->delimiter(',')
      ->check(range(0, 1023));
  app.add_option("--export", options.mesh,
                 "surface of all solid volumes as a closed mesh in mm, FILE.stl or FILE.ply (with "
                 "colours): headless at the end, in the window with e")
      ->type_name("FILE");
  app.add_option("--sheet", options.sheet,
                 "headless: at the end one PNG with the final state by every renderer")
      ->type_name("FILE")
      ->needs(headless);
  auto* record = app.add_option("--record", options.record,
                                "raw video in true time (y4m): a file, a pipe, or - for stdout; "
                                "headless without pictures unless --frames")
                     ->type_name("FILE");
  app.add_option("--fps", options.video_hz, "record: frames per second of servo time")
      ->check(range(1, 240))
      ->capture_default_str();
  app.add_option("--report", options.report, "write times and counts to this JSON file")
      ->type_name("FILE");
  auto* bench = app.add_flag("--bench", options.bench,
                             "time every renderer, without a controller (512x512 unless --size)")
                    ->disable_flag_override();
  app.add_option("--page", options.page, "bench: write the table to this Markdown file")
      ->type_name("FILE")
      ->needs(bench);
  app.add_option("--summary", options.summary,
                 "bench: write a short table as its part of this Markdown file")
      ->type_name("FILE")
      ->needs(bench);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& asked) {  // --help, --version
    app.exit(asked, std::cout, std::cerr);
    return std::nullopt;
  } catch (const CLI::ParseError& problem) {
    throw VisualizerError(one_line(problem.what()) + "; see --help");
  }
  if (*record && app.count("--frames") == 0) options.frames = 0;
  if (options.bench && app.count("--size") == 0) size = kBenchSize;
  options.size = parse_size(size);
  check_renderers(options.renderer);
  options.gradient = gradient_named(gradient);
  if (options.transfer) options.opacities = read_transfer(*options.transfer);
  return options;
}

}  // namespace kerf
