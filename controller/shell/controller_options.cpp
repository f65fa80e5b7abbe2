// SPDX-License-Identifier: Apache-2.0
#include "controller/shell/controller_options.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iostream>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "controller/device/port/open_port.hpp"
#include "controller/scene/scene_file.hpp"
#include "controller/scene/scene_page.hpp"
#include "controller/scene/scene_words.hpp"
#include "shared/text/command_line.hpp"

namespace kerf {
namespace {

constexpr const char* kAbout =
    "The servo of kerf: reads the device, feels and mills the scene, commands the force.\n";
constexpr const char* kExitCodes =
    "\nExit codes: 0 fine, 1 ran and met a fault, 2 bad input or set-up.\n"
    "Try it without hardware: ./kerf demo";

/// One, or three numbers: one stands for all three.
std::array<double, 3> three_of(const std::vector<double>& values) {
  if (values.size() == 1) return {values[0], values[0], values[0]};
  return {values[0], values[1], values[2]};
}

template <std::size_t N>
std::vector<std::string> words_of(const std::array<std::string_view, N>& words) {
  return {words.begin(), words.end()};
}

template <std::size_t N>
std::ptrdiff_t index_of(const std::array<std::string_view, N>& words, const std::string& word) {
  return std::ranges::find(words, word) - words.begin();
}

}  // namespace

std::optional<int> parse_options(int argc, const char* const* argv, ControllerOptions& options) {
  CommandLine app(kAbout, "kerf-controller", "kerf-controller " KERF_VERSION);
  app.footer(kExitCodes);

  std::string volume;
  std::vector<double> spacing_mm;
  std::vector<double> window;
  int rate_hz = 0;
  std::string numeric;
  std::string device;
  std::vector<double> torque_scale;
  app.option("--scene", options.scene, "scene file (TOML)").shown_as("FILE");
  const Option volume_option =
      app.option("--volume", volume,
                 "replace the first volume: NRRD, MetaImage, NIfTI, DICOM folder")
          .shown_as("FILE");
  const Option spacing_option =
      app.option("--spacing", spacing_mm, "voxel size of that volume in mm: one number or three")
          .values(1, 3)
          .shown_as("A[,B,C]");
  const Option window_option =
      app.option("--window", window, "source values shown as air and as densest")
          .values(2, 2)
          .shown_as("LO,HI");
  const Option device_option =
      app.option("--device", device, "what is held, instead of the scene's")
          .one_of(words_of(kPersonalityWords))
          .shown_as("NAME");
  const Option torque_option =
      app.option("--torque-scale", torque_scale,
                 "N mm at the joint per motor count, instead of the scene's")
          .values(3, 3)
          .within(-kMaxTorqueScale, kMaxTorqueScale)
          .shown_as("A,B,C");
  app.option("--port", options.port,
             "where the device is: auto; fw, usb or hid, each [:NODE or :SERIAL]; usb also "
             "[,firmware=FILE]; socket:PATH or udp:[ADDRESS:]PORT of kerf-emulator")
      .shown_as("PORT");
  constexpr double kLongestS = 1e7;  // 115 days
  app.option("--seconds", options.seconds,
             "end after this much servo time, counted from arming; of --probe, from its start")
      .within(0.01, kLongestS)
      .shown_as("S");
  const Option rate_option = app.option("--rate", rate_hz, "servo rate, instead of the scene's")
                                 .within(250, 8000)
                                 .shown_as("HZ");
  const Option numeric_option =
      app.option("--numeric", numeric, "numbers of the loop, instead of the scene's")
          .one_of(words_of(kNumericWords));
  app.option("--name", options.name, "name under which readers find the segment").shows_default();
  app.flag("--virtual", options.virtual_time,
           "lock-step with the device, no clock: the same input gives the same bits");
  app.flag("--strict", options.real_time.strict, "refuse to start without every real-time right");
  app.flag("--guard", options.guard,
           "an unexpected system call of the servo thread switches the motors off and ends it");
  app.option("--cpu", options.real_time.cpu, "core of the servo thread (default: the last)")
      .within(0, 1023)
      .shown_as("N");
  app.option("--priority", options.real_time.priority, "SCHED_FIFO priority")
      .within(1, 99)
      .shows_default();
  app.option("--spin-us", options.real_time.spin_us,
             "spin this long before each deadline instead of sleeping to it")
      .within(0, 900)
      .shows_default();
  const Option check_flag = app.flag(
      "--check", options.check,
      "load and check the scene, whether its rate fits too, print it and every setting, and end");
  bool scene_keys = false;
  app.flag("--scene-keys", scene_keys,
           "print every key of a scene file as a page of Markdown, and end");
  const Option explain_flag =
      app.flag("--explain", options.explain,
               "tell what the scene costs: methods, operations, time, memory; and end")
          .excludes(check_flag);
  app.flag("--probe", options.probe,
           "no scene needed: show what the device says, its motors off; without --port, what "
           "is connected and what is missing")
      .excludes(check_flag)
      .excludes(explain_flag);
  app.flag("--progress", options.progress, "show a progress bar on a terminal");
  app.option("--report", options.report, "write the figures of the run, or of --explain, as JSON")
      .shown_as("FILE");
  app.option("--final", options.final_volume, "write the volume as it is at the end (.nrrd)")
      .shown_as("FILE");
  app.option("--emulator-args", options.emulator_args,
             "write hand_unit_mm, hand_script and rate_hz once the scene is loaded")
      .shown_as("FILE");

  try {
    if (!app.parse(argc, argv, std::cout)) return 0;
  } catch (const UsageError& error) {
    std::cerr << "kerf-controller: " << error.what() << '\n';
    return 2;
  }
  if (scene_keys) {
    std::cout << scene_keys_page();
    return 0;
  }
  const auto refuse = [](const std::string& line) {
    std::cerr << "kerf-controller: " << line << '\n';
    return 2;
  };
  if (spacing_option.given() && spacing_mm.size() == 2) {
    return refuse("--spacing has 2 numbers; give one for all axes, or three");
  }
  for (const double edge_mm : spacing_mm) {
    if (!(edge_mm > 0)) return refuse("--spacing: a voxel edge is above 0 mm, for example 0.125");
  }
  for (const double scale : torque_scale) {
    if (std::abs(scale) < kMinTorqueScale) {
      return refuse(
          "--torque-scale is below 0.001 N mm per count; leave it out to keep the motors off");
    }
  }
  if (options.scene.empty() && !options.probe) {
    return refuse("--scene is missing; try scenes/phantom.toml");
  }
  if (options.probe && !options.port.empty() && options.scene.empty() && !device_option.given()) {
    return refuse("--probe: which device? give --device, or a --scene that says it");
  }
  const bool runs = !options.check && !options.explain && !options.probe;
  if (runs && options.port.empty()) {
    return refuse("--port is missing; give auto, or socket:PATH, where kerf-emulator listens");
  }
  if (!options.port.empty()) {
    try {
      check_port(options.port);
    } catch (const std::runtime_error& error) {
      return refuse(error.what());
    }
  }
  if (volume_option.given()) options.overrides.volume_file = volume;
  if (spacing_option.given()) options.overrides.spacing_mm = three_of(spacing_mm);
  if (window_option.given()) options.overrides.window = std::array{window[0], window[1]};
  if (rate_option.given()) options.overrides.rate_hz = rate_hz;
  if (numeric_option.given()) {
    options.overrides.numeric = static_cast<NumericKind>(index_of(kNumericWords, numeric));
  }
  if (torque_option.given()) options.overrides.torque_scale = three_of(torque_scale);
  if (device_option.given()) {
    options.overrides.personality = static_cast<Personality>(index_of(kPersonalityWords, device));
  }
  return std::nullopt;
}

}  // namespace kerf
