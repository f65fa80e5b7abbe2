// SPDX-License-Identifier: Apache-2.0
#include <iostream>
#include <optional>
#include <string>

#include "controller/law/registry/law_registry.hpp"
#include "controller/scene/scene.hpp"
#include "record/recording.hpp"
#include "replay/replay.hpp"
#include "shared/posix/program.hpp"
#include "shared/posix/stop_signals.hpp"
#include "shared/text/command_line.hpp"
#include "shared/text/text.hpp"

namespace kerf {
namespace {

constexpr const char* kAbout =
    "Runs a recording again, tick by tick, without device and clock.\n\n"
    "Each tick is compared with the recorded one, to the last bit. With another scene, setting, "
    "law or arithmetic it shows what the force would have been: the hand moves as it did, the "
    "volumes "
    "start as they were.";

/// An option that stands for the setting of a law.
struct LawOption {
  const char* option;
  LawKind kind;
  const char* setting;
  const std::string& name;
};

/// The setting. Throws `UsageError` for an unknown name; a name with settings, which is a table, is
/// checked with the scene.
std::string setting_of(const LawOption& law) {
  if (law.name.find_first_of("{\"'") != std::string::npos) return law.setting + law.name;
  try {
    static_cast<void>(law_by_word(law.kind, law.name));
  } catch (const LawError& error) {
    throw UsageError(std::string(law.option) + ' ' + one_line(law.name) + error.what());
  }
  return law.setting + law.name;
}

/// False if help or version was requested, and printed.
bool parse_replay(int argc, char** argv, ReplayOptions& options) {
  CommandLine app(kAbout, "kerf-replay", KERF_VERSION);
  app.footer(
      "\nExit codes: 0 fine, 1 a tick differs, or the recording has a gap, is damaged or "
      "contradicts "
      "itself, 2 bad input or set-up.");
  std::string numeric, scene, law, estimator, stabiliser;
  app.option("DIR", options.folder, "folder of a recording").required();
  app.option("--from", options.from, "the first tick that is compared").shown_as("TICK");
  app.option("--until", options.until, "the last tick that is replayed")
      .within(1, 1e18)
      .shown_as("TICK");
  app.option("--kernels", options.kernels, "of this instruction set, such as scalar or avx2")
      .shown_as("NAME");
  app.option("--set", options.changes.settings,
             "another value of a key of the scene; may be repeated")
      .one_each()
      .shown_as("KEY=VALUE");
  app.option("--law", law, "another force law: --set force.law=NAME").shown_as("NAME");
  app.option("--estimator", estimator, "another estimator: --set servo.velocity=NAME")
      .shown_as("NAME");
  app.option("--stabiliser", stabiliser, "another stabiliser: --set force.stabiliser=NAME")
      .shown_as("NAME");
  app.option("--scene", scene, "another scene, on the recorded hand").shown_as("FILE");
  app.option("--numeric", numeric, "number type of the loop").one_of({"fixed", "double"});
  app.option("--out", options.out, "folder for a recording of the replay").shown_as("DIR");
  app.option("--plot", options.plot, "forces, positions and removed densities of both runs, as SVG")
      .shown_as("FILE");
  app.option("--report", options.report, "write what it found as JSON").shown_as("FILE");
  app.option(
         "--watch", options.watch,
         "show it as the controller NAME, to a window, the browser's page and every other reader")
      .shown_as("NAME");
  if (!app.parse(argc, argv, std::cout)) return false;
  const bool compares = !options.out.empty() || !options.plot.empty() || !options.report.empty();
  if (!options.watch.empty() && compares) {
    throw UsageError("--watch: compares nothing; leave --out, --plot and --report out");
  }
  for (const LawOption& one :
       {LawOption{"--law", LawKind::force, "force.law=", law},
        LawOption{"--estimator", LawKind::velocity, "servo.velocity=", estimator},
        LawOption{"--stabiliser", LawKind::stabiliser, "force.stabiliser=", stabiliser}}) {
    if (!one.name.empty()) options.changes.settings.push_back(setting_of(one));
  }
  if (!scene.empty()) options.changes.scene = find_scene_file(scene);
  if (!numeric.empty()) {
    options.changes.numeric = numeric == "double" ? NumericKind::float64 : NumericKind::fixed;
  }
  return true;
}

}  // namespace

int run_replay_program(int argc, char** argv) {
  return run_on_recordings("kerf-replay", [&] {
    ReplayOptions options;
    if (!parse_replay(argc, argv, options)) return 0;
    return run_replay(options, catch_stop_signals());
  });
}

}  // namespace kerf
