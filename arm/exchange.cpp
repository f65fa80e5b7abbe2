// SPDX-License-Identifier: Apache-2.0
#include "arm/exchange.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "shared/numeric/linear_algebra.hpp"

namespace kerf {
namespace {

using Vec3 = vec3::Vec;
using vec3::dot;

}  // namespace

std::optional<std::array<double, 4>> orientation_of(const Vec3& x, const Vec3& y,
                                                    const Vec3& z) noexcept {
  constexpr double kWithin = 0.05;
  const auto is = [](double value, double wanted) { return std::abs(value - wanted) <= kWithin; };
  const Vec3 across = vec3::cross(x, y);
  if (!is(dot(x, x), 1) || !is(dot(y, y), 1) || !is(dot(z, z), 1) || !is(dot(x, y), 0) ||
      !is(dot(y, z), 0) || !is(dot(z, x), 0) || !(dot(across, z) > 0)) {  // the last: left-handed
    return std::nullopt;
  }
  // The largest of the four components comes from the diagonal, the others from sums and
  // differences off it (Shepperd, J. Guidance and Control 1, 1978).
  const double trace = x[0] + y[1] + z[2];
  std::array<double, 4> q;
  if (trace > std::max({x[0], y[1], z[2]})) {
    q = {y[2] - z[1], z[0] - x[2], x[1] - y[0], 1 + trace};
  } else if (x[0] >= y[1] && x[0] >= z[2]) {
    q = {1 + x[0] - y[1] - z[2], y[0] + x[1], z[0] + x[2], y[2] - z[1]};
  } else if (y[1] >= z[2]) {
    q = {y[0] + x[1], 1 + y[1] - x[0] - z[2], z[1] + y[2], z[0] - x[2]};
  } else {
    q = {z[0] + x[2], z[1] + y[2], 1 + z[2] - x[0] - y[1], x[1] - y[0]};
  }
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  for (double& value : q) value /= length;
  return q;
}

ArmExchange::ArmExchange(ArmPageAdapter& page, double peak_n, int rate_hz, Clock* clock) noexcept
    : page_(page),
      peak_n_(peak_n),
      command_life_ns_(kZeroNs - std::max<std::int64_t>(1'000'000, 1'000'000'000 / rate_hz)),
      clock_(clock) {}

std::array<double, 3> ArmExchange::turn(const std::optional<ArmReading>& reading) noexcept {
  const std::int64_t begin_ns = clock_();
  Vec3 force_n{};
  const bool is_pose = reading && publish(*reading, begin_ns);
  if (is_pose) published_.fetch_add(1);
  if (reading && !is_pose) ++counts_.unreadable;
  // At once, and not only when the controller has seen it.
  if (reading) is_homed_ = reading->homed;
  const bool is_let_go = is_let_go_.load();
  if (is_homed_ && published_.load() > 0 && !is_let_go) force_n = commanded(begin_ns);
  if (is_let_go) count_zero_frame(begin_ns);
  if (force_n != Vec3{}) ++counts_.forced;
  last_force_n_ = force_n;
  counts_.turn.record(clock_() - begin_ns);
  frames_.fetch_add(1);
  return force_n;
}

void ArmExchange::count_zero_frame(std::int64_t now_ns) noexcept {
  constexpr auto kZeroForNs = static_cast<std::int64_t>(kZeroS * kNsPerSecond);
  if (zero_frames_ == 0) zero_since_ns_ = now_ns;
  zero_frames_ = std::min(zero_frames_ + 1, kFewest);
  if (zero_frames_ == kFewest && now_ns - zero_since_ns_ >= kZeroForNs) is_finished_.store(true);
}

bool ArmExchange::publish(const ArmReading& reading, std::int64_t now_ns) noexcept {
  CartesianReport report;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto um = cartesian::packed_mm(reading.position_mm[i]);
    if (!um) return false;
    report.position_um[i] = *um;
    report.force_mn[i] = cartesian::packed_n(last_force_n_[i]);
  }
  const auto orientation = cartesian::packed_orientation(reading.orientation);
  if (!orientation) return false;
  report.orientation = *orientation;
  report.button1 = reading.button1;
  report.button2 = reading.button2;
  report.parked = reading.parked;
  report.homed = reading.homed;
  report.powered = reading.powered && !is_let_go_.load();
  page_.publish(report, now_ns);
  return true;
}

std::optional<TimedCommand> ArmExchange::current(std::int64_t now_ns) noexcept {
  const auto newest = page_.newest();
  ticket_ = newest ? newest->ticket : 0;
  if (!newest || in_lockstep_) return newest;
  // A command written during this exchange may be slightly newer than `now_ns`. A later time is
  // invalid.
  constexpr std::int64_t kAheadNs = 1'000'000;
  const bool is_current =
      newest->at_ns > now_ns - command_life_ns_ && newest->at_ns <= now_ns + kAheadNs;
  return is_current ? newest : std::nullopt;
}

std::array<double, 3> ArmExchange::commanded(std::int64_t now_ns) noexcept {
  const auto newest = current(now_ns);
  if (!newest && ticket_ != 0 && last_force_n_ != Vec3{}) ++counts_.expired;
  if (!newest || !newest->command.force_on) return {};
  Vec3 force_n;
  for (std::size_t i = 0; i < 3; ++i) {
    force_n[i] = newest->command.force_mn[i] * cartesian::kNewtonsPerCount;
  }
  const double length = std::sqrt(dot(force_n, force_n));
  if (length > peak_n_) {
    ++counts_.clamped;
    for (double& component : force_n) component *= peak_n_ / length;
  }
  counts_.command_age.record(now_ns - newest->at_ns);
  return force_n;
}

void ArmExchange::publish(const CartesianReport& report) noexcept {
  CartesianReport sent = report;
  sent.powered = report.powered && !is_let_go_.load();
  page_.publish(sent, clock_());
  published_.fetch_add(1);
}

std::optional<TimedCommand> ArmExchange::command() noexcept {
  const std::int64_t now_ns = clock_();
  const auto newest = current(now_ns);
  frames_.fetch_add(1);
  if (is_let_go_.load()) {
    count_zero_frame(now_ns);
    return std::nullopt;
  }
  if (newest && newest->command.force_on) ++counts_.forced;
  if (newest && !in_lockstep_) counts_.command_age.record(now_ns - newest->at_ns);
  return newest;
}

void ArmExchange::set_lockstep(int rate_hz) noexcept {
  in_lockstep_ = true;
  page_.set_lockstep(rate_hz);
}

void ArmExchange::fail(std::uint32_t code) noexcept {
  let_go();
  std::uint32_t none = 0;
  failure_.compare_exchange_strong(none, code);
}

}  // namespace kerf
