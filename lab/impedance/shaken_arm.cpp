// SPDX-License-Identifier: Apache-2.0
#include "lab/impedance/shaken_arm.hpp"

#include <cmath>
#include <cstdint>

#include "controller/stability/sampled_loop.hpp"
#include "hil/device/emulator.hpp"
#include "hil/hil_error.hpp"
#include "lab/rig/direct_port.hpp"
#include "lab/rig/virtual_loop.hpp"
#include "lab/stability/arm.hpp"
#include "shared/text/text.hpp"

namespace kerf::impedance {
namespace {

/// So stiff that the tip moves as a sine although the motors' force comes in steps, and critically
/// damped, so that it soon does.
SampledHand stiff_hand(const SampledLoop& loop) {
  constexpr double kStiff = 20, kMmPerM = 1000;  // N/mm
  return {0, 2 * std::sqrt(kStiff * loop.mass_kg / kMmPerM), kStiff};
}

/// Down into the wall, until the tip is in the middle of the stroke.
HandScript approach(const Stroke& stroke, double stiffness_n_per_mm, const SampledHand& hand) {
  constexpr double kAboveMm = 3, kDownS = 0.4, kRestS = 0.2;
  HandScript script;
  script.start = {0, zwidth::kArmTouchMm + kAboveMm, 0};
  HandStep rest;
  rest.seconds = kRestS;
  // The wall pushes the tip back against the hand's spring.
  const double depth_mm = stroke.middle_mm * (1 + stiffness_n_per_mm / hand.stiffness_n_per_mm);
  script.steps = {hand_move({0, zwidth::kArmTouchMm - depth_mm, 0}, kDownS), rest};
  return script;
}

/// Adds up the fundamentals of a motion and of the force of the motors, bus cycle by bus cycle.
class Fundamental {
 public:
  explicit Fundamental(double rad_per_cycle) : rad_per_cycle_(rad_per_cycle) {}

  /// At the end of cycle `n` of the shake; the force was held through it.
  void add(std::int64_t n, double tip_mm, double force_n) {
    const double angle = rad_per_cycle_ * static_cast<double>(n);
    tip_ += tip_mm * std::polar(1.0, -angle);
    force_ += force_n * std::polar(1.0, rad_per_cycle_ - angle);
    ++count_;
  }
  [[nodiscard]] Impedance tip_mm() const { return tip_ * (2 / static_cast<double>(count_)); }
  [[nodiscard]] Impedance force_n() const {
    const Impedance jw(0, rad_per_cycle_);
    return force_ * (2 / static_cast<double>(count_)) * (1.0 - std::exp(-jw)) / jw;
  }

 private:
  double rad_per_cycle_;
  Impedance tip_ = 0, force_ = 0;
  std::int64_t count_ = 0;
};

}  // namespace

SineResult measure_arm(const LoadedScene& walls, const zwidth::LoopCase& subject,
                       double stiffness_n_per_mm, double hz, double most_mm) {
  const double rate_hz = std::round(1 / subject.loop.period_s);
  // A quarter of a second: the steps of the encoders are met in hundreds of phases.
  const std::int64_t least_ticks = std::llround(rate_hz) / 4;
  const SteppedSine sine = sine_near(hz, rate_hz, 2, least_ticks);
  const auto stroke = stroke_at(subject, stiffness_n_per_mm, sine.hz, most_mm);
  if (!stroke) return {sine.hz, most_mm, {}, {}};

  zwidth::LoopCase held = subject;
  held.loop.hand = stiff_hand(subject.loop);
  Emulator emulator(zwidth::arm_model(held), approach(*stroke, stiffness_n_per_mm, held.loop.hand));
  DirectPort port(emulator);
  LoadedScene scene = zwidth::arm_scene(walls, held, stiffness_n_per_mm);
  VirtualLoop loop(scene, port);
  loop.driver().allow_stillness();

  // The goal that moves the tip by the stroke, if the wall is that of the theory.
  const Impedance jw(0, kTurn * sine.hz);
  const Impedance hand = held.loop.hand.stiffness_n_per_mm + jw * held.loop.hand.damping_ns_per_mm;
  const Impedance felt =
      wall_impedance(subject.loop, stiffness_n_per_mm, subject.damping_ns_per_mm, sine.hz) +
      Impedance(subject.loop.viscous_ns_per_mm, kTurn * sine.hz * subject.loop.mass_kg / 1000);
  const Impedance goal = stroke->amplitude_mm * (1.0 + jw * felt / hand);
  const double rad_per_cycle = kTurn * sine.hz / kCyclesPerSecond;
  emulator.shake({{0, goal.real(), 0}, {0, -goal.imag(), 0}, rad_per_cycle});

  const std::int64_t cycles = sine.ticks * (kCyclesPerSecond / std::llround(rate_hz));
  // Until the beginning is forgotten: twice the longest window of an estimator and more.
  const std::int64_t warm = cycles_of(0.3 + 20 * subject.loop.velocity_filter_s);
  const std::int64_t patience = cycles_of(8) + warm + cycles;
  Fundamental fundamental(rad_per_cycle);
  for (std::int64_t cycle = 0; emulator.shaken_cycles() < warm + cycles; ++cycle) {
    if (loop.cycle()) {
      const ServoOutput out = loop.step();
      const bool is_lost =
          out.fault != Fault::none || (emulator.shaken_cycles() > warm && !out.contact);
      if (is_lost || cycle > patience) {
        throw HilError(format("--arm: at %.4g Hz ", sine.hz) +
                       (out.fault != Fault::none ? "the servo latched a fault"
                        : is_lost                ? "the tip left the wall"
                                                 : "the hand did not come to the wall") +
                       "; give less --amplitude, stiffness or damping");
      }
    }
    if (emulator.shaken_cycles() <= warm) continue;
    const PlantState& plant = emulator.model().state();
    fundamental.add(emulator.shaken_cycles(), plant.pose.tip_mm.y, plant.motor_force_n.y);
  }
  const Impedance velocity = jw * fundamental.tip_mm();
  // The hand's goal is straight from cycle to cycle: what is left of its sine.
  const double half = rad_per_cycle / 2, straight = std::pow(std::sin(half) / half, 2);
  const Impedance hand_n = hand * (straight * goal - fundamental.tip_mm());
  return {sine.hz, std::abs(fundamental.tip_mm()), -fundamental.force_n() / velocity,
          hand_n / velocity};
}

}  // namespace kerf::impedance
