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

#include <CLI/CLI.hpp>

#include "controller/device/port/open_port.hpp"
#include "controller/scene/scene_file.hpp"
#include "controller/scene/scene_words.hpp"

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
  CLI::App app{kAbout, "kerf-controller"};
  app.footer(kExitCodes);
  app.set_version_flag("--version", std::string("kerf-controller ") + KERF_VERSION);
  app.get_formatter()->column_width(34);

  std::string volume;
  std::vector<double> spacing_mm;
  std::vector<double> window;
  int rate_hz = 0;
  std::string numeric;
  std::string device;
  std::vector<double> torque_scale;
  app.add_option("--scene", options.scene, "scene file (TOML)")->type_name("FILE");
  auto* volume_option =
      app.add_option("--volume", volume,
                     "replace the first volume: NRRD, MetaImage, NIfTI, DICOM folder")
          ->type_name("FILE");
  auto* spacing_option = app.add_option("--spacing", spacing_mm,
                                        "voxel size of that volume in mm: one number or three")
                             ->delimiter(',')
                             ->expected(1, 3)

                             ->type_name("A[,B,C]");
  auto* window_option =
      app.add_option("--window", window, "source values shown as air and as densest")
          ->delimiter(',')
          ->expected(2)
          ->type_name("LO,HI");
  auto* device_option = app.add_option("--device", device, "what is held, instead of the scene's")
                            ->check(CLI::IsMember(words_of(kPersonalityWords)))
                            ->type_name("NAME");
  auto* torque_option = app.add_option("--torque-scale", torque_scale,
                                       "N mm at the joint per motor count, instead of the scene's")
                            ->delimiter(',')
                            ->expected(3)
                            ->check(CLI::Range(-kMaxTorqueScale, kMaxTorqueScale))
                            ->type_name("A,B,C");
  app.add_option("--port", options.port,
                 "where the device is: auto; fw, usb or hid, each [:NODE or :SERIAL]; usb also "
                 "[,firmware=FILE]; socket:PATH or udp:[ADDRESS:]PORT of kerf-emulator")
      ->type_name("PORT");
  constexpr double kLongestS = 1e7;  // 115 days
  app.add_option("--seconds", options.seconds,
                 "end after this much servo time, counted from arming; of --probe, from its start")
      ->check(CLI::Range(0.01, kLongestS))
      ->type_name("S");
  auto* rate_option = app.add_option("--rate", rate_hz, "servo rate, instead of the scene's")
                          ->check(CLI::Range(250, 8000))
                          ->type_name("HZ");
  auto* numeric_option =
      app.add_option("--numeric", numeric, "numbers of the loop, instead of the scene's")
          ->check(CLI::IsMember(words_of(kNumericWords)));
  app.add_option("--name", options.name, "name under which readers find the segment")
      ->capture_default_str();
  app.add_flag("--virtual", options.virtual_time,
               "lock-step with the device, no clock: the same input gives the same bits");
  app.add_flag("--strict", options.real_time.strict,
               "refuse to start without every real-time right");
  app.add_flag("--guard", options.guard,
               "an unexpected system call of the servo thread switches the motors off and ends it");
  app.add_option("--cpu", options.real_time.cpu, "core of the servo thread (default: the last)")
      ->check(CLI::Range(0, 1023))
      ->type_name("N");
  app.add_option("--priority", options.real_time.priority, "SCHED_FIFO priority")
      ->check(CLI::Range(1, 99))
      ->capture_default_str();
  app.add_option("--spin-us", options.real_time.spin_us,
                 "spin this long before each deadline instead of sleeping to it")
      ->check(CLI::Range(0, 900))
      ->capture_default_str();
  auto* check_flag = app.add_flag(
      "--check", options.check,
      "load and check the scene, whether its rate fits too, print what it means, and end");
  auto* explain_flag =
      app.add_flag("--explain", options.explain,
                   "tell what the scene costs: methods, operations, time, memory; and end")
          ->excludes(check_flag);
  app.add_flag("--probe", options.probe,
               "no scene needed: show what the device says, its motors off; without --port, what "
               "is connected and what is missing")
      ->excludes(check_flag)
      ->excludes(explain_flag);
  app.add_flag("--progress", options.progress, "show a progress bar on a terminal");
  app.add_option("--report", options.report,
                 "write the figures of the run, or of --explain, as JSON")
      ->type_name("FILE");
  app.add_option("--final", options.final_volume, "write the volume as it is at the end (.nrrd)")
      ->type_name("FILE");
  app.add_option("--emulator-args", options.emulator_args,
                 "write hand_unit_mm, hand_script and rate_hz once the scene is loaded")
      ->type_name("FILE");

  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& success) {  // --help, --version
    return app.exit(success);
  } catch (const CLI::ParseError& error) {
    std::cerr << "kerf-controller: " << error.what() << "; see kerf-controller --help\n";
    return 2;
  }
  const auto refuse = [](const std::string& line) {
    std::cerr << "kerf-controller: " << line << '\n';
    return 2;
  };
  if (*spacing_option && spacing_mm.size() == 2) {
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
  if (options.probe && !options.port.empty() && options.scene.empty() && !*device_option) {
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
  if (*volume_option) options.overrides.volume_file = volume;
  if (*spacing_option) options.overrides.spacing_mm = three_of(spacing_mm);
  if (*window_option) options.overrides.window = std::array{window[0], window[1]};
  if (*rate_option) options.overrides.rate_hz = rate_hz;
  if (*numeric_option) {
    options.overrides.numeric = static_cast<NumericKind>(index_of(kNumericWords, numeric));
  }
  if (*torque_option) options.overrides.torque_scale = three_of(torque_scale);
  if (*device_option) {
    options.overrides.personality = static_cast<Personality>(index_of(kPersonalityWords, device));
  }
  return std::nullopt;
}

}  // namespace kerf
