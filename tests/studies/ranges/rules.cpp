// SPDX-License-Identifier: Apache-2.0
#include "tests/studies/ranges/rules.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <span>
#include <utility>

#include "controller/plan/plan_device.hpp"
#include "shared/numeric/linear_algebra.hpp"
#include "shared/text/text.hpp"

namespace kerf::ranges {
namespace {

using vec3::dot, vec3::length, vec3::operator-, vec3::operator*;

/// From `f` to the nearest force between 0 and `last`.
double beyond_fall(const std::array<double, 3>& f, const std::array<double, 3>& last) {
  const double whole = dot(last, last);
  const double share = whole > 0 ? std::clamp(dot(f, last) / whole, 0.0, 1.0) : 0.0;
  return length(f - share * last);
}

/// The first output that is no number; null: all are.
const char* not_finite(const ServoOutput& out) {
  const auto finite = [](std::span<const double> values) {
    return std::ranges::all_of(values, [](double x) { return std::isfinite(x); });
  };
  for (const PlaneLoad<DoubleNumbers>& plane : out.planes) {
    if (!all_finite(plane.normal) || !all_finite(plane.lever_mm) || !std::isfinite(plane.load_n)) {
      return "a plane";
    }
  }
  const std::array<double, 4> single{out.absorbed_mj, out.press_n, out.spindle_ratio,
                                     out.spindle_load};
  const std::pair<const char*, std::span<const double>> outputs[] = {
      {"gimbal_rad", out.gimbal_rad},
      {"position_mm", out.position_mm},
      {"rotation", out.rotation},
      {"velocity_mm_per_s", out.velocity_mm_per_s},
      {"force_n", out.commanded_force_n},
      {"contact_n", out.contact_force_n},
      {"modification_n", out.modification_n},
      {"torque_n_mm", out.torque_n_mm},
      {"proxy_offset_mm", out.proxy_offset_mm},
      {"tip_torque_n_mm", out.tip_torque_n_mm},
      {"energy, press or spindle", single}};
  for (const auto& [name, values] : outputs) {
    if (!finite(values)) return name;
  }
  return nullptr;
}

}  // namespace

Rules::Rules(const LoadedScene& scene, std::uint64_t most_samples)
    : force_n_(scene.limits.force_n),
      slew_n_(scene.limits.slew_n_per_ms * 1000 / scene.servo.rate_hz),
      limit_mm_(scene.limits.speed_mm_per_s / scene.servo.rate_hz),
      scale_(scene.device.workspace_scale),
      most_samples_(most_samples),
      legs_(scene.device.personality == Personality::falcon),
      motor_end_(device_parts::motor_count_end(scene.device.personality)),
      zero_ticks_(static_cast<std::size_t>(20.0 * scene.servo.rate_hz / 1000)) {
  // The place is in the axes of the scene: two roundings of the loop's numbers, and the offset's.
  const auto& offset = scene.device.offset_mm;
  const double farthest =
      std::max({std::abs(offset[0]), std::abs(offset[1]), std::abs(offset[2])}) + 500 * scale_;
  const double step = std::ldexp(1.0, -50);
  const double fixed_step = scene.servo.numeric == NumericKind::fixed ? std::ldexp(1.0, -15) : 0;
  place_error_mm_ = 2 * (fixed_step + farthest * step) / scale_ + 500 * step;
}

void Rules::broken(const char* rule, std::string what) {
  if (std::ranges::find(violations_, rule, &Violation::rule) != violations_.end()) return;
  violations_.push_back({rule, "tick " + std::to_string(tick_) + ": " + std::move(what)});
}

void Rules::look_at_force(const ServoOutput& out, bool leaves) {
  constexpr double kRounding = 4.0 / 65536;  // of the loop's coarsest force, N
  const double force_n = length(out.commanded_force_n);
  if (!(force_n <= force_n_)) broken("clamp", format("%.9g N above %.9g", force_n, force_n_));
  const int most = std::max(
      {std::abs(out.dac_counts[0]), std::abs(out.dac_counts[1]), std::abs(out.dac_counts[2])});
  if (most > motor_end_) broken("clamp", format("%d motor counts, beyond %d", most, motor_end_));
  if (!out.motors_on) {
    if (most != 0 || force_n != 0) broken("off", format("%d counts, %.9g N", most, force_n));
    return;
  }
  const bool may =
      (out.phase == Phase::ramping || out.phase == Phase::active) && out.fault == Fault::none;
  if (!may) broken("off", "motors on in phase " + std::to_string(static_cast<int>(out.phase)));
  const double step_n = leaves || most >= motor_end_
                            ? beyond_fall(out.commanded_force_n, last_force_n_)
                            : length(out.commanded_force_n - last_force_n_);
  if (!(step_n <= slew_n_ + kRounding))
    broken("slew", format("%.9g N in a tick, above %.9g", step_n, slew_n_));
  const double whole_n = length(out.commanded_force_n - last_force_n_);
  const double bound_n = std::max(slew_n_, length(last_force_n_));
  if (!(whole_n <= bound_n + kRounding))
    broken("slew", format("%.9g N in a tick, above %.9g in all", whole_n, bound_n));
}

void Rules::look_at_motion(const DeviceReport& report, const ServoOutput& out, double way_mm) {
  const double allowed_mm = limit_mm_ * static_cast<double>(gap_) * 1.001 + place_error_mm_;
  if (!report.parked && way_mm > allowed_mm && out.motors_on) {
    broken("overspeed", format("%.6g mm in a tick, above %.6g, and motors on", way_mm, allowed_mm));
  }
  const double booked_mj = std::abs(out.absorbed_mj - last_mj_);
  const double most_mj =
      largest_gap_n_ * (way_mm + place_error_mm_) * 1.001 + 1e-9 * (std::abs(last_mj_) + 2);
  if (!(booked_mj <= most_mj))
    broken("energy", format("%.9g mJ booked, at most %.9g", booked_mj, most_mj));
}

void Rules::look_at(const DeviceReport& report, const ServoOutput& out) {
  if (const char* output = not_finite(out)) {
    broken("finite", std::string(output) + " is no number");
  }
  const Vector moved_mm = known_ ? out.position_mm - last_mm_ : Vector{};
  ++gap_;
  largest_gap_n_ = std::max(largest_gap_n_, length(last_force_n_));
  // Below the rounding of the reported positions the hand's direction is unknown.
  const double unknown_mm = place_error_mm_ * scale_;
  const bool leaves =
      report.fresh && dot(last_force_n_, moved_mm) >= -unknown_mm * length(last_force_n_);
  look_at_force(out, leaves);
  stale_ticks_ = report.fresh ? 0 : stale_ticks_ + 1;
  if (stale_ticks_ > 0 && length(out.commanded_force_n) > length(last_force_n_) + 1e-4) {
    broken("stale", "a force grows without reports");
  }
  if (stale_ticks_ >= zero_ticks_ && out.motors_on)
    broken("stale", "motors on after 20 ms of silence");
  if (report.fresh) {
    if (known_) look_at_motion(report, out, length(moved_mm) / scale_);
    // Legs that cannot meet have no place: the tip stays, and the gap goes on.
    const bool placed = !known_ || !legs_ || length(moved_mm) > 0;
    known_ = true;
    if (placed) {
      gap_ = 0;
      largest_gap_n_ = 0;
    }
    last_mm_ = out.position_mm;
  }
  last_mj_ = out.absorbed_mj;
  if (out.samples_read < 0 || static_cast<std::uint64_t>(out.samples_read) > most_samples_) {
    broken("work", format("%.0f samples, planned with %.0f", static_cast<double>(out.samples_read),
                          static_cast<double>(most_samples_)));
  }
  last_force_n_ = out.commanded_force_n;
  ++tick_;
}

}  // namespace kerf::ranges
