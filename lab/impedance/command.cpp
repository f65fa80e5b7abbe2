// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "controller/law/registry/law_registry.hpp"
#include "hil/hil_error.hpp"
#include "lab/impedance/logged_wall.hpp"
#include "lab/impedance/shaken_arm.hpp"
#include "lab/impedance/spectrum.hpp"
#include "lab/run/lab_command.hpp"
#include "lab/run/lab_run.hpp"
#include "lab/stability/arm.hpp"
#include "lab/stability/axes.hpp"
#include "lab/stability/axis_options.hpp"
#include "lab/stability/device_file.hpp"
#include "lab/stability/map.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/posix/report_tool.hpp"
#include "shared/text/text.hpp"

namespace kerf::impedance {
namespace {

using zwidth::AxisId;

/// The axes of a map that a wall and a device over frequency have.
constexpr std::array kAxes{AxisId::loop,  AxisId::device,     AxisId::damping,  AxisId::rate,
                           AxisId::delay, AxisId::quantum,    AxisId::friction, AxisId::viscous,
                           AxisId::mass,  AxisId::estimator,  AxisId::filter,   AxisId::numeric,
                           AxisId::law,   AxisId::stabiliser, AxisId::limits};

/// Those of them that no recording has.
constexpr std::array kOfDevice{AxisId::device,   AxisId::delay,   AxisId::quantum,
                               AxisId::friction, AxisId::viscous, AxisId::mass};

/// `kerf-lab impedance`: what a hand feels of a wall over frequency, by theory and from motion.
class ImpedanceCommand final : public LabCommand {
 public:
  explicit ImpedanceCommand(Arguments& program);
  [[nodiscard]] int run(std::ostream& out) const override;

 private:
  /// The wall and its device, nothing measured yet; `log`: of a recording.
  [[nodiscard]] Spectrum subject(const LoggedWall* log, std::ostream& out) const;
  /// Puts what a recording has in the place of axes. Throws HilError for one that is given, too.
  void take_log(const LoggedWall& wall, std::array<std::string, zwidth::kAxisCount>& texts) const;
  [[nodiscard]] SineResult row_at(double hz, const Spectrum& spectrum, const LoggedWall* log,
                                  const LoadedScene* walls) const;
  [[nodiscard]] std::vector<double> frequencies(double rate_hz) const;

  zwidth::AxisOptions axes_;
  std::string frequency_, log_, json_, plot_;
  std::optional<double> stiffness_, amplitude_;
  bool arm_ = false;
};

ImpedanceCommand::ImpedanceCommand(Arguments& program)
    : LabCommand(program, "impedance",
                 "which stiffness and damping a hand feels, over frequency, beside the theory") {
  axes_.declare(app_, kAxes);
  app_.option("--stiffness", stiffness_, "of the wall, K, N/mm").within(1e-4, 127).shows_default();
  app_.option("--frequency", frequency_,
              "of the motion: from:to:count, even in their ratio, or a list [1 to half of the "
              "Nyquist frequency, 25]")
      .shown_as("Hz");
  app_.option("--amplitude", amplitude_,
              "of the motion, mm, or less as far as the limits of the force need [0.5]")
      .within(kLeastMm, 10);
  app_.flag("--arm", arm_,
            "the whole servo step with an emulated device in a stiff hand in place of one axis");
  app_.option("--log", log_,
              "measure nothing: the wall of a recording, from the motion that it has in contact")
      .shown_as("DIR");
  app_.option("--json", json_, "write axes, margins and a row for each frequency").shown_as("FILE");
  app_.option("--plot", plot_, "draw stiffness and damping over frequency (SVG)").shown_as("FILE");
  app_.footer(
      "Each option has one value. K and B at the hand are -w Im Z and Re Z of the force over the "
      "velocity "
      "of a\ntip that moves as a sine in the wall; docs/forces.md 5.8.\n"
      "Exit codes: 0 fine, 2 bad input or set-up.");
}

void ImpedanceCommand::take_log(const LoggedWall& wall,
                                std::array<std::string, zwidth::kAxisCount>& texts) const {
  for (const AxisId axis : kAxes) {
    if (texts[zwidth::index_of(axis)].empty() ||
        std::ranges::find(kOfDevice, axis) != kOfDevice.end()) {
      continue;
    }
    throw HilError(std::string("--") + zwidth::axis_kinds()[zwidth::index_of(axis)].name +
                   ": the scene of the recording has it; leave it out");
  }
  if (stiffness_ || amplitude_ || arm_) {
    throw HilError(std::string(stiffness_   ? "--stiffness"
                               : amplitude_ ? "--amplitude"
                                            : "--arm") +
                   ": the recording has its own; leave it or --log out");
  }
  if (wall.law != "coupling") {
    throw HilError("--log: the force of its scene is " + wall.law +
                   ", of which no stiffness is known; give a recording of the coupling");
  }
  texts[zwidth::index_of(AxisId::rate)] = format("%.9g", wall.rate_hz);
  texts[zwidth::index_of(AxisId::damping)] = format("%.9g", wall.damping_ns_per_mm);
  texts[zwidth::index_of(AxisId::estimator)] = wall.estimator;
  texts[zwidth::index_of(AxisId::stabiliser)] = wall.stabiliser;
}

Spectrum ImpedanceCommand::subject(const LoggedWall* log, std::ostream& out) const {
  std::array<std::string, zwidth::kAxisCount> texts = axes_.texts;
  if (log != nullptr) take_log(*log, texts);
  zwidth::take_device_option(axes_.direction, arm_, texts, out);
  Spectrum spectrum;
  for (const AxisId axis : kAxes) {
    const std::size_t i = zwidth::index_of(axis);
    if (texts[i].empty()) continue;
    const zwidth::AxisValues values = zwidth::axis_values(axis, texts[i]);
    if (values.size() > 1) {
      throw HilError(std::string("--") + zwidth::axis_kinds()[i].name + ": " + texts[i] +
                     ": one wall has one value; give one");
    }
    spectrum.values[i] = values.front();
  }
  if (zwidth::value_of(spectrum.values, AxisId::law) == "paper") {
    throw HilError("--law: paper is a force of the whole arm; give another one");
  }
  if (arm_) {
    for (const AxisId axis : {AxisId::loop, AxisId::quantum, AxisId::limits}) {
      if (axes_.texts[zwidth::index_of(axis)].empty()) continue;
      throw HilError(std::string("--") + zwidth::axis_kinds()[zwidth::index_of(axis)].name +
                     ": device and servo have their own with --arm; leave one of the two out");
    }
  }
  zwidth::check_filter(spectrum.values);
  spectrum.subject = zwidth::subject_of(spectrum.values);
  spectrum.stiffness_n_per_mm = log != nullptr ? log->stiffness_n_per_mm : stiffness_.value_or(1);
  if (log != nullptr) spectrum.unmeasured = "not in the motion of the log";
  return spectrum;
}

/// Throws HilError for a rate or a delay that no emulated device has.
LoadedScene walls_of(const Spectrum& spectrum) {
  LoadedScene walls = zwidth::walls_scene(spectrum.subject);
  zwidth::MapSpec map;
  map.arm = true;
  map.stiffness_n_per_mm = {spectrum.stiffness_n_per_mm};
  const std::string why = zwidth::impossible(map, spectrum.subject);
  if (!why.empty()) throw HilError("--arm: " + why);
  return walls;
}

std::vector<double> ImpedanceCommand::frequencies(double rate_hz) const {
  // Nearer to the Nyquist frequency a sine and its alias are no longer two.
  constexpr double kMostPart = 0.4, kLeastHz = 0.1;
  return zwidth::ratio_values(
      {"frequency", "1:250:25 (from, to, count) or 1,30,250", "Hz", kLeastHz, kMostPart * rate_hz},
      frequency_.empty() ? format("1:%g:25", rate_hz / 4) : frequency_);
}

SineResult ImpedanceCommand::row_at(double hz, const Spectrum& spectrum, const LoggedWall* log,
                                    const LoadedScene* walls) const {
  const zwidth::LoopCase& subject = spectrum.subject;
  constexpr double kMostMm = 0.5;
  const double most_mm = amplitude_.value_or(kMostMm), k = spectrum.stiffness_n_per_mm;
  try {
    if (log != nullptr) return logged_at(*log, subject.loop, hz);
    if (walls != nullptr) return measure_arm(*walls, subject, k, hz, most_mm);
    return measure_one_axis(subject, k, sine_near(hz, 1 / subject.loop.period_s), most_mm);
  } catch (const LawError& error) {
    throw HilError("--law: " + subject.force_law.name + error.what());
  }
}

int ImpedanceCommand::run(std::ostream& out) const {
  const LabOutput as_json("--json", json_, ".json"), as_plot("--plot", plot_, ".svg");
  LabOutput::check_distinct({&as_json, &as_plot});
  if (!log_.empty()) {
    check_outputs({log_}, {{"--json", json_, ".json"}, {"--plot", plot_, ".svg"}});
  }
  if (!plot_.empty()) check_can_plot();
  std::optional<LoggedWall> log;
  if (!log_.empty()) log = read_logged_wall(log_);
  Spectrum spectrum = subject(log ? &*log : nullptr, out);
  std::optional<LoadedScene> walls;
  if (arm_) walls = walls_of(spectrum);
  for (const double hz : frequencies(1 / spectrum.subject.loop.period_s)) {
    spectrum.rows.push_back(row_at(hz, spectrum, log ? &*log : nullptr, walls ? &*walls : nullptr));
  }
  if (std::ranges::none_of(spectrum.rows, [](const auto& row) { return row.wall.has_value(); })) {
    if (log) {
      throw HilError("--log: " + log_ +
                     ": no frequency has enough motion; record a hand that shakes within a wall, "
                     "or give another --frequency");
    }
    throw HilError("--limits: peak and slew of the force leave no motion at " +
                   number_text(spectrum.stiffness_n_per_mm) +
                   " N/mm; add --limits off, or give less stiffness or damping");
  }
  out << text_of(spectrum);
  const std::string json = json_of(spectrum);
  as_json.write(json);
  as_plot.write_report({"impedance", "plot"}, json, out);
  return 0;
}

}  // namespace
}  // namespace kerf::impedance

std::unique_ptr<kerf::LabCommand> kerf::make_impedance_command(Arguments& program) {
  return std::make_unique<impedance::ImpedanceCommand>(program);
}
