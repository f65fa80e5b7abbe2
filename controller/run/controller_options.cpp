// SPDX-License-Identifier: Apache-2.0
#include "controller/run/controller_options.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iostream>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "controller/device/open_port.hpp"
#include "controller/input/load_error.hpp"
#include "controller/scene/scene.hpp"
#include "controller/scene/scene_keys.hpp"
#include "shared/posix/program.hpp"
#include "shared/text/command_line.hpp"
#include "shared/text/text.hpp"

namespace kerf {
namespace {

constexpr const char* kAbout =
    "The servo of kerf: reads the device, computes contact and cut, commands the force.\n";
constexpr const char* kExitCodes =
    "\nExit codes: 0 fine, 1 ran and met a fault, 2 bad input or set-up.\n"
    "Try it without hardware: ./kerf demo";

/// One or three numbers; one is used for all three.
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

/// Values of options that belong to the scene, as they are written; empty if not given.
struct Raw {
  std::vector<double> spacing_mm, override_spacing_mm, window, torque_scale;
  int rate_hz = 0;
  std::string numeric, device;
  std::vector<std::string> settings;
  bool scene_keys = false;
};

/// Scene, device and run.
void declare_scene_options(Arguments& app, ControllerOptions& options, Raw& raw) {
  app.option("--scene", options.scene, "scene file (TOML)").shown_as("FILE");
  app.option("--set", raw.settings, "another value of a key of the scene; may be repeated")
      .one_each()
      .shown_as("KEY=VALUE");
  app.option("--volume", options.overrides.volume_file,
             "replace the first volume: NRRD, MetaImage, NIfTI, DICOM folder")
      .shown_as("FILE");
  Option fills =
      app.option("--spacing", raw.spacing_mm,
                 "mm per voxel of that volume, if its file has none: one number or three");
  fills.values(1, 3).shown_as("A[,B,C]");
  app.option("--override-spacing", raw.override_spacing_mm, "the same, in place of the file's")
      .values(1, 3)
      .shown_as("A[,B,C]")
      .excludes(fills);
  app.option("--window", raw.window, "source values that become density 0 and 1")
      .values(2, 2)
      .shown_as("LO,HI");
  app.option("--read-seconds", options.overrides.read_cpu_s,
             "CPU time that parsing a volume or a mesh may take")
      .within(1, kMostReadCpuSeconds)
      .shows_default();
  app.option("--device", raw.device, "the device, instead of the scene's")
      .one_of(words_of(kPersonalityWords))
      .shown_as("NAME");
  app.option(
         "--torque-scale", raw.torque_scale,
         "N mm at the joint per motor count, instead of the scene's; six numbers: of two devices")
      .values(3, 6)
      .within(-kMaxTorqueScale, kMaxTorqueScale)
      .shown_as("A,B,C");
  app.option("--port", options.ports,
             "where the device is: auto; fw, usb or hid, each [:NODE or :SERIAL]; fw also "
             "[,20010] and [,fill]; usb also [,firmware=FILE]; arm, which starts kerf-arm if none "
             "runs, "
             "or arm:NAME of one that does; "
             "socket:PATH or udp:[ADDRESS:]PORT of kerf-emulator; "
             "twice for a scene with two devices, in their order")
      .one_each()
      .shown_as("PORT");
  constexpr double kLongestS = 1e7;  // 115 days
  app.option("--seconds", options.seconds,
             "end after this much servo time, counted from arming; of --probe, from its start")
      .within(0.01, kLongestS)
      .shown_as("S");
  app.option(
         "--wait", options.wait_s,
         "give up with exit code 1 if the user has not picked up the device after this servo time")
      .within(0.01, kLongestS)
      .shown_as("S")
      .shows_default();
  app.flag("--pedal", options.overrides.pedal,
           "the tool cuts only while the device's first button is pressed, unless the scene's "
           "cut.pedal is \"always\": for a hand that a window leads");
  app.option("--rate", raw.rate_hz, "servo rate, instead of the scene's")
      .within(250, 8000)
      .shown_as("HZ");
  app.option("--numeric", raw.numeric, "numbers of the loop, instead of the scene's")
      .one_of(words_of(kNumericWords));
}

/// How it runs, and what else can be asked.
void declare_run_options(Arguments& app, ControllerOptions& options, Raw& raw) {
  app.option("--name", options.name, "name under which readers find the segment").shows_default();
  app.flag("--virtual", options.virtual_time,
           "lock-step with the device, no clock: the same input gives the same bits");
  app.option("--until", options.until,
             "with --virtual: go on only to the tick that the reader of this FIFO allows (--lead "
             "of visualizer and recorder); may be repeated")
      .one_each()
      .shown_as("FIFO");
  app.flag("--unchecked-gain", options.unchecked_gain,
           "allow a stiffness and damping above the device's bounds or the stable range; the "
           "limits of force stay");
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
  app.flag("--scene-keys", raw.scene_keys,
           "print every key of a scene file as a page of Markdown, and end");
  const Option explain_flag =
      app.flag("--explain", options.explain,
               "print the cost of the scene: methods, operations, time, memory; and end")
          .excludes(check_flag);
  app.flag("--probe", options.probe,
           "no scene needed: show the reports of the device, its motors off; without --port, "
           "the connected devices and what is missing")
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
}

/// The conflict between options, as text; empty if there is none.
std::string wrong_with(const ControllerOptions& options, const Raw& raw) {
  for (const auto& [option, edges_mm] : {std::pair{"--spacing", &raw.spacing_mm},
                                         {"--override-spacing", &raw.override_spacing_mm}}) {
    if (edges_mm->size() == 2) {
      return std::string(option) + " has 2 numbers; give one for all axes, or three";
    }
    for (const double edge_mm : *edges_mm) {
      if (edge_mm > 0) continue;
      return std::string(option) + ": a voxel edge is above 0 mm, for example 0.125";
    }
  }
  if (raw.torque_scale.size() % 3 != 0) {
    return "--torque-scale has " + std::to_string(raw.torque_scale.size()) +
           " numbers; give three, or six for two devices";
  }
  for (const double scale : raw.torque_scale) {
    if (std::abs(scale) < kMinTorqueScale) {
      return "--torque-scale is below 0.001 N mm per count; leave it out to keep the motors off";
    }
  }
  if (options.scene.empty() && !options.probe) {
    return "--scene is missing; try scenes/phantom.toml";
  }
  if (options.probe && options.ports.size() > 1) {
    return "--probe: looks at one device; give one --port";
  }
  if (options.probe && !options.ports.empty() && options.scene.empty() && raw.device.empty()) {
    return "--probe: which device? give --device, or a --scene that says it";
  }
  if (!options.until.empty() && (!options.virtual_time || options.guard)) {
    return "--until: waits, which only lock-step can; give --virtual and no --guard, or leave it "
           "out";
  }
  const bool runs = !options.check && !options.explain && !options.probe;
  if (runs && options.ports.empty()) {
    return "--port is missing; give auto, or socket:PATH, where kerf-emulator listens";
  }
  try {
    for (const std::string& port : options.ports) check_port(port);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

void override_scene(const Raw& raw, SceneOverrides& scene) {
  for (const std::string& text : raw.settings) {
    const KeyOverride setting = parse_setting(text);
    if (std::ranges::find(scene.settings, setting.key, &KeyOverride::key) != scene.settings.end()) {
      throw LoadError("--set " + text + ": the key stands there already; give it once");
    }
    scene.settings.push_back(setting);
  }
  if (!raw.spacing_mm.empty()) scene.spacing_mm = three_of(raw.spacing_mm);
  if (!raw.override_spacing_mm.empty()) {
    scene.override_spacing_mm = three_of(raw.override_spacing_mm);
  }
  if (!raw.window.empty()) scene.window = std::array{raw.window[0], raw.window[1]};
  if (raw.rate_hz != 0) scene.rate_hz = raw.rate_hz;
  if (!raw.numeric.empty()) {
    scene.numeric = static_cast<NumericKind>(index_of(kNumericWords, raw.numeric));
  }
  if (const std::vector<double>& scale = raw.torque_scale; !scale.empty()) {
    scene.torque_scale = std::array{scale[0], scale[1], scale[2]};
    if (scale.size() == 6) scene.second_torque_scale = std::array{scale[3], scale[4], scale[5]};
  }
  if (!raw.device.empty()) {
    scene.personality = static_cast<Personality>(index_of(kPersonalityWords, raw.device));
  }
}

}  // namespace

std::optional<int> parse_options(int argc, const char* const* argv, ControllerOptions& options) {
  CommandLine app(kAbout, "kerf-controller", "kerf-controller " KERF_VERSION);
  app.footer(kExitCodes);
  Raw raw;
  declare_scene_options(app, options, raw);
  declare_run_options(app, options, raw);
  std::string wrong;
  try {
    if (!app.parse(argc, argv, std::cout)) return 0;
    if (raw.scene_keys) {
      std::cout << scene_keys_page();
      return 0;
    }
    wrong = wrong_with(options, raw);
  } catch (const UsageError& error) {
    wrong = error.what();
  }
  if (!wrong.empty()) {
    std::cerr << "kerf-controller: " << wrong << '\n';
    return 2;
  }
  override_scene(raw, options.overrides);
  if (const std::string found = find_scene_file(options.scene); found != options.scene) {
    std::cerr << "kerf-controller: --scene " << one_line(options.scene) << ": " << found << '\n';
    options.scene = found;
  }
  options.overrides.unchecked_gain = options.unchecked_gain;
  return std::nullopt;
}

}  // namespace kerf
