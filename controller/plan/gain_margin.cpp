// SPDX-License-Identifier: Apache-2.0
#include "controller/plan/gain_margin.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <numbers>
#include <vector>

#include "controller/law/registry/law_registry.hpp"
#include "controller/law/velocity_estimators.hpp"
#include "controller/load/load_scene.hpp"
#include "controller/load/loaded_scene.hpp"
#include "controller/plan/plan_device.hpp"
#include "controller/scene/scene.hpp"
#include "controller/stability/axis_simulation.hpp"
#include "controller/stability/identified_loop.hpp"
#include "controller/stability/sampled_loop.hpp"
#include "shared/numeric/numbers.hpp"
#include "shared/text/text.hpp"

namespace kerf {
namespace {

/// A force law linearised at one length of its spring.
struct LawSlope {
  double spring_mm = 0;
  double stiffness_n_per_mm = 0;  ///< dF/d(spring)
  double damping_ns_per_mm = 0;   ///< -dF/dv outwards
};

/// The force law of a scene along its spring, from an encoder step of the device up to the length
/// of the scene's largest force, beyond which the limit is flat, or to 10 mm.
///
/// A small swing about a press is that of the wall with these two slopes (linearisation), so the
/// law has a margin of stability at each length. The slopes are quotients over an encoder step,
/// since the loop has no finer input, and over 10 mm/s. A law with memory starts again at each
/// length, one that depends on the position is taken at the device's origin. In double; a result
/// that is no number gives no slope there. Load time; the law has passed its trial (law_trial.hpp).
std::vector<LawSlope> law_slopes(const LoadedScene& scene) {
  constexpr double kLongestMm = 10, kSpeedMmPerS = 10;
  const auto law = plan_law<ForceInput, DoubleNumbers>(
      scene.force.law, {.rate_hz = double(scene.servo.rate_hz),
                        .tip_noise_mm = device_parts::tip_noise_mm(scene.device.personality)});
  const auto memory = std::make_unique<LawMemory>();
  const auto force_n = [&](double spring_mm, double outward_mm_per_s) {
    ForceInput<DoubleNumbers> in;
    in.spring_mm.y = spring_mm;
    in.velocity_mm_per_s.y = outward_mm_per_s;
    if (spring_mm > 0) in.normal.y = 1;
    memory->begin_anew();
    return law(*memory, in).y;
  };
  const double step_mm = device_figures(scene.device.personality).quantum_mm;
  std::vector<LawSlope> slopes;
  for (double at_mm = step_mm; at_mm <= kLongestMm; at_mm += step_mm) {
    const double before_n = force_n(at_mm - step_mm / 2, 0);
    const LawSlope slope{
        at_mm, (force_n(at_mm + step_mm / 2, 0) - before_n) / step_mm,
        (force_n(at_mm, -kSpeedMmPerS) - force_n(at_mm, kSpeedMmPerS)) / (2 * kSpeedMmPerS)};
    if (before_n >= scene.limits.force_n) break;
    if (std::isfinite(slope.stiffness_n_per_mm) && std::isfinite(slope.damping_ns_per_mm)) {
      slopes.push_back(slope);
    }
  }
  return slopes;
}

/// End of the search for a boundary with friction.
constexpr double kMostNPerMm = 1000;

std::string device_word(const LoadedScene& scene) {
  return std::string(word_of(scene.device.personality));
}

/// Of the personality; or of the identified device, across its worst direction, with friction and
/// delay as unfavourable as their intervals allow.
SampledLoop bare_loop(const LoadedScene& scene) {
  const double rate_hz = scene.servo.rate_hz;
  if (!scene.identified) return unheld_loop(scene.device.personality, rate_hz);
  const DeviceDirection worst =
      worst_direction(*scene.identified, scene.force.damping_ns_per_mm, rate_hz);
  return loop_along(*scene.identified, worst, rate_hz, true);
}

SampledLoop loop_of(const LoadedScene& scene) {
  SampledLoop loop = bare_loop(scene);
  const LawChoice& estimator = scene.servo.velocity;
  if (estimator.name == Difference<DoubleNumbers>::kName && !estimator.settings.empty()) {
    loop.velocity_filter_s = estimator.settings.front().second / 1000;  // its only one
  }
  return loop;
}

bool has_law(const LoadedScene& scene) {
  return scene.force.model == ForceModel::proxy && !scene.force.law.name.empty();
}

/// Parts of the loop that the boundary leaves out, as an end of its line.
std::string not_counted(const LoadedScene& scene) {
  std::string text = scene.identified ? ", identified" : "";
  const std::string& estimator = scene.servo.velocity.name;
  if (estimator != Difference<DoubleNumbers>::kName && estimator != Foaw<DoubleNumbers>::kName) {
    text += ", " + estimator + " counted as a plain difference";
  }
  const std::string& stabiliser = scene.force.stabiliser.name;
  if (!stabiliser.empty()) text += ", " + stabiliser + " not counted";
  return text;
}

/// The length of the law's spring at which it has the least margin.
void set_worst_slope(const LoadedScene& scene, const SampledLoop& loop, GainMargin& margin) {
  margin.stiffness_n_per_mm = margin.damping_ns_per_mm = 0;
  margin.highest_n_per_mm = highest_stiffness(loop, 0);  // of a law that never rises
  double damping = -1, highest = 0;
  for (const LawSlope& slope : law_slopes(scene)) {
    if (slope.stiffness_n_per_mm <= 0) continue;  // the hand alone holds it there
    const double damps = std::max(0.0, slope.damping_ns_per_mm);
    if (damps != damping) highest = highest_stiffness(loop, damping = damps);
    const bool first = margin.stiffness_n_per_mm <= 0;
    if (!first &&
        highest * margin.stiffness_n_per_mm >= margin.highest_n_per_mm * slope.stiffness_n_per_mm) {
      continue;
    }
    margin.spring_mm = slope.spring_mm;
    margin.stiffness_n_per_mm = slope.stiffness_n_per_mm;
    margin.damping_ns_per_mm = damps;
    margin.highest_n_per_mm = highest;
  }
}

/// From the linear boundary upwards in steps of 1 %, to the first wall on which a push is not
/// proven to come to rest: with friction and an encoder, walls that rest lie above others that
/// swing. The push is half of the contact's largest force: there a swing has the most room between
/// no force and that one, and the larger it is, the less friction holds it (docs/forces.md 5.7).
/// Damping that is unstable without any wall has no such boundary: friction stops only small swings
/// then, even if one push decays.
double with_friction(const SampledLoop& loop, double damping, double linear_n_per_mm,
                     double push_n) {
  if (damping > highest_damping(loop)) return 0;
  const auto rests = [&](double stiffness) {
    return push_on_wall(loop, stiffness, damping, {.push_n = push_n}).rests();
  };
  constexpr double kStep = 1.01;
  double stable = std::max(linear_n_per_mm, kMinStiffnessNPerMm);
  if (!rests(stable)) return linear_n_per_mm;
  while (stable < kMostNPerMm && rests(kStep * stable)) stable *= kStep;
  return stable;
}

/// That the contact of a scene can have at the device: the limit's, or what the paper's force has
/// at half of the ball's depth, p0 pi R^2 (docs/forces.md 7.1).
double largest_force_n(const LoadedScene& scene) {
  const double limit_n = scene.limits.force_n;
  if (scene.force.model != ForceModel::paper) return limit_n;
  const double radius_mm = scene.tools[scene.active_tool].radius_mm;
  return std::min(limit_n, scene.device.workspace_scale * scene.force.p0_n_per_mm2 *
                               std::numbers::pi * radius_mm * radius_mm);
}

/// Begin of a remedy.
std::string gain_key(const LoadedScene& scene) {
  return scene.force.model == ForceModel::paper ? "force.p0_n_per_mm2" : "force.stiffness_n_per_mm";
}

/// Begin of a message about a law: its name and length.
std::string law_words(const LoadedScene& scene, const GainMargin& margin) {
  return format("force.law %s at a spring of %.3g mm", scene.force.law.name.c_str(),
                margin.spring_mm);
}

/// The remedy for too high a damping, or too high a stiffness.
std::string way_out(const LoadedScene& scene, const GainMargin& margin) {
  if (margin.highest_n_per_mm <= 0) {
    const double most = highest_damping(loop_of(scene)) / kSafeMargin;
    if (has_law(scene)) return "let it damp by at most " + text_below(most, 3) + " N s/mm";
    return "use at most " + text_below(most, 3) + " in force.damping_ns_per_mm";
  }
  const double safe = margin.deciding() * margin.stiffness_n_per_mm / kSafeMargin;
  if (has_law(scene)) return "let it rise by at most " + text_below(safe, 3) + " N/mm";
  if (!margin.friction_decides) {
    return "use at most " + text_below(safe, 3) + " in " + gain_key(scene);
  }
  return "lower " + gain_key(scene) + " to " + text_below(safe / margin.stiffness_n_per_mm, 3) +
         " times its value";
}

}  // namespace

GainMargin gain_margin(const LoadedScene& scene, PlayFriction friction) {
  GainMargin margin;
  margin.friction_decides = scene.force.model == ForceModel::paper;
  margin.stiffness_n_per_mm = device_stiffness_n_per_mm(scene);
  margin.damping_ns_per_mm = margin.friction_decides ? 0 : scene.force.damping_ns_per_mm;
  const SampledLoop loop = loop_of(scene);
  if (has_law(scene)) {
    set_worst_slope(scene, loop, margin);
  } else {
    margin.highest_n_per_mm = highest_stiffness(loop, margin.damping_ns_per_mm);
  }
  if (margin.friction_decides || friction == PlayFriction::always) {
    margin.highest_with_friction_n_per_mm = with_friction(
        loop, margin.damping_ns_per_mm, margin.highest_n_per_mm, largest_force_n(scene) / 2);
  }
  return margin;
}

std::string gain_lines(const LoadedScene& scene, const GainMargin& margin) {
  const SampledLoop loop = loop_of(scene);
  std::string text =
      format("gain_loop=%s at %d Hz: %g kg, %g N s/mm, Coulomb %g N, delay %g ms%s\n",
             device_word(scene).c_str(), scene.servo.rate_hz, loop.mass_kg, loop.viscous_ns_per_mm,
             loop.coulomb_n, 1000 * loop.delay_s, not_counted(scene).c_str());
  if (has_law(scene)) {
    text += format("steepest=%s: %.3g N/mm, %.3g N s/mm\n", law_words(scene, margin).c_str(),
                   margin.stiffness_n_per_mm, margin.damping_ns_per_mm);
  }
  text += format("highest_stable_stiffness_n_per_mm=%.3g\nstability_margin=%.2f\n",
                 margin.highest_n_per_mm, margin.margin());
  text += format("highest_with_friction_n_per_mm=%.3g\nstability_margin_with_friction=%.2f\n",
                 margin.highest_with_friction_n_per_mm, margin.with_friction());
  const std::string warning = gain_warning(scene, margin);
  return warning.empty() ? text : text + "note=" + warning + "\n";
}

std::string gain_warning(const LoadedScene& scene, const GainMargin& margin) {
  if (margin.deciding() >= kSafeMargin) return {};
  return format(
             "contact of %.3g N/mm and %.3g N s/mm has a stability margin of %.2f on a lightly "
             "held %s at %d Hz: %s; ",
             margin.stiffness_n_per_mm, margin.damping_ns_per_mm, margin.deciding(),
             device_word(scene).c_str(), scene.servo.rate_hz,
             margin.deciding() < 1 ? "it is unstable and will oscillate" : "it may oscillate") +
         way_out(scene, margin);
}

std::string gain_error(const LoadedScene& scene, const GainMargin& margin) {
  if (scene.force.unchecked_gain || margin.friction_decides || margin.margin() >= 1) return {};
  if (has_law(scene)) {
    return scene.path + ": " + law_words(scene, margin) +
           format(
               " rises by %.3g N/mm and damps by %.3g N s/mm, which is unstable on a lightly "
               "held %s at %d Hz, margin %.2f; ",
               margin.stiffness_n_per_mm, margin.damping_ns_per_mm, device_word(scene).c_str(),
               scene.servo.rate_hz, margin.margin()) +
           way_out(scene, margin) + ", or set force.unchecked_gain = true";
  }
  return scene.path +
         format(
             ": force.stiffness_n_per_mm = %.6g with damping %.6g is unstable on a lightly held "
             "%s at %d Hz, margin %.2f; ",
             margin.stiffness_n_per_mm, margin.damping_ns_per_mm, device_word(scene).c_str(),
             scene.servo.rate_hz, margin.margin()) +
         way_out(scene, margin) + ", or set force.unchecked_gain = true";
}

std::string device_limit_error(const LoadedScene& scene) {
  if (scene.force.model == ForceModel::paper) return {};
  const DeviceFigures device = device_figures(scene.device.personality);
  const std::string authority =
      device.gains_from.empty()
          ? "the maximum that kerf assumes for " + device_word(scene) + "; none is published"
          : "the maximum of " + std::string(device.gains_from) + " for " + device_word(scene);
  const auto refused = [&](const std::string& what, double value, double most) {
    return scene.path +
           format(": force.%s = %.6g is above %.6g, %s; ", what.c_str(), value, most,
                  authority.c_str()) +
           "lower it, use --virtual, or use --unchecked-gain";
  };
  double stiffness = scene.force.stiffness_n_per_mm, damping = scene.force.damping_ns_per_mm;
  std::string of_law;
  if (has_law(scene)) {
    of_law = "law " + scene.force.law.name + ": its steepest ";
    stiffness = damping = 0;
    for (const LawSlope& slope : law_slopes(scene)) {
      stiffness = std::max(stiffness, slope.stiffness_n_per_mm);
      damping = std::max(damping, slope.damping_ns_per_mm);
    }
  }
  if (stiffness > device.highest_stiffness_n_per_mm) {
    return refused(of_law + "stiffness_n_per_mm", stiffness, device.highest_stiffness_n_per_mm);
  }
  if (damping > device.highest_damping_ns_per_mm) {
    return refused(of_law + "damping_ns_per_mm", damping, device.highest_damping_ns_per_mm);
  }
  return {};
}

}  // namespace kerf
