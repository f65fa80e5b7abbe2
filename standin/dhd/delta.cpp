// SPDX-License-Identifier: Apache-2.0
#include "standin/dhd/delta.hpp"

#include <algorithm>
#include <cmath>

#include "shared/posix/monotonic_clock.hpp"
#include "shared/wire/personality.hpp"

namespace kerf::dhd {

using standin::length_of;
using standin::Row;

namespace {

constexpr double kTickS = 0.001;  // period of the regulator in real time
constexpr double kNothingN = 1e-9;
constexpr double kArrivedMm = 1;  // friction may stop the spring this far from its goal
// For a tip of about 0.3 kg, hand included: 9 Hz, damping ratio 0.6.
constexpr double kStiffnessNPerMm = 1.0;
constexpr double kDampingNsPerMm = 0.02;

}  // namespace

Delta::Delta(const standin::Settings& settings, standin::Device& device)
    : is_initialised(!settings.uncalibrated),
      settings_(settings),
      device_(device),
      ledger_(device.ledger),
      arm_(settings, device.settings, ledger_),
      slots_(kNsPerSecond / device.settings.rate_hz) {
  ledger_.add(Row::opened);
}

std::int64_t Delta::now_ns() const noexcept {
  return lockstep() ? static_cast<std::int64_t>(arm_.time_s() * kNsPerSecond) : monotonic_ns();
}

int Delta::read() noexcept {
  if (!lockstep()) arm_.refresh();
  if (arm_.lost()) return kFailed;
  const std::int64_t now = now_ns();
  if (guard_us > 0 && read_ns_ != 0 && now - read_ns_ < std::int64_t{guard_us} * 1000) {
    return kReused;
  }
  read_ns_ = now;
  return kOk;
}

unsigned Delta::buttons() const noexcept {
  const standin::Pose& now = arm_.pose();
  if (settings_.hand_buttons) return (now.button1 ? 1U : 0U) | (now.button2 ? 2U : 0U);
  return (now.parked ? 1U : 0U) | (now.button1 ? 2U : 0U) | (now.button2 ? 4U : 0U);
}

double Delta::command_khz() const noexcept {
  return period_s_ > 0 ? 0.001 / period_s_ : 0;
}

void Delta::note_command(DeviceVec<double> force_n) noexcept {
  const std::int64_t now = now_ns();
  ledger_.add(Row::ticks);
  if (commanded_ns_ != 0) {
    const std::int64_t period_ns = now - commanded_ns_;
    const double period_s = static_cast<double>(period_ns) / kNsPerSecond;
    period_s_ = period_s_ > 0 ? period_s_ + 0.01 * (period_s - period_s_) : period_s;
    if (!lockstep()) {
      ledger_.record_period_us(period_ns / 1000);
      if (norm(force_n_) > kNothingN && period_ns > std::int64_t{settings_.stall_ms} * 1'000'000) {
        ledger_.add(Row::stalls);
      }
    }
  }
  commanded_ns_ = now;
  force_n_ = force_n;
}

std::int64_t Delta::take_slot_ns() noexcept {
  if (lockstep()) return 0;
  const Slots::Slot slot = slots_.take(monotonic_ns());
  if (counts_misses_) ledger_.add(Row::missed_ticks, static_cast<std::uint64_t>(slot.missed));
  counts_misses_ = true;
  return slot.at_ns;
}

void Delta::send(DeviceVec<double> force_n) noexcept {
  arm_.command(force_n, gives_force(), is_initialised);
}

int Delta::set_force(DeviceVec<double> force_n) noexcept {
  if (!lockstep()) arm_.refresh();
  if (arm_.lost()) return kFailed;
  if (!(std::isfinite(force_n.x) && std::isfinite(force_n.y) && std::isfinite(force_n.z))) {
    ledger_.add(Row::not_finite);
    send({});
    force_n_ = {};
    return kFailed;
  }
  const double wanted_n = length_of(force_n);
  const bool is_force = wanted_n > kNothingN;
  arm_.count_command(wanted_n);
  if (mode_ == Mode::idle && !settings_.force_needs_enable) {
    set_mode(Mode::force, Cause::none);
    enabled_by_force_ = true;
  }
  if (enabled_by_force_ && is_force) ledger_.add(Row::before_enable);
  if (most_n >= 0 && wanted_n > most_n) force_n = force_n * (most_n / wanted_n);
  const double peak_n = force_figures(standin::kDhd.personality).peak_n;
  int result = kOk;
  if (const double length = length_of(force_n); length > peak_n) {
    ledger_.add(Row::excess);
    force_n = settings_.cut_excess ? DeviceVec<double>{} : force_n * (peak_n / length);
    result = kSaturated;
  }
  const auto velocity_mm_s = velocity();
  if (velocity_limit_m_s > 0 && velocity_mm_s && gives_force()) {
    const double fastest = std::max(
        {std::abs(velocity_mm_s->x), std::abs(velocity_mm_s->y), std::abs(velocity_mm_s->z)});
    if (fastest > velocity_limit_m_s * kMmPerM) {
      ledger_.add(Row::too_fast);
      set_mode(Mode::brake, Cause::velocity);
    }
  }
  if (!gives_force()) {
    const bool by_device = cause_ == Cause::watchdog || cause_ == Cause::velocity;
    if (is_force) ledger_.add(by_device ? Row::after_trip : Row::output_off);
    force_n = {};
  }
  note_command(force_n);
  send(force_n);
  return result;
}

void Delta::set_mode(Mode mode, Cause cause) noexcept {
  mode_ = mode;
  cause_ = cause;
  enabled_by_force_ = false;
  if (mode == Mode::force) return;
  force_n_ = {};
  counts_misses_ = false;
}

int Delta::apply() noexcept {
  if (!lockstep()) arm_.refresh();
  if (arm_.lost()) return kFailed;
  note_command({});
  send({});
  return kOk;
}

void Delta::close() noexcept {
  if (gives_force() && norm(force_n_) > kNothingN) ledger_.add(Row::not_cleared);
  regulates_ = false;
  set_mode(Mode::idle, Cause::software);
  arm_.command({}, false, false);
  ledger_.set(Row::last_n, 0);
  ledger_.add(Row::closed);
}

void Delta::tick() noexcept {
  if (!lockstep()) arm_.refresh();
  if (watchdog_s > 0 && gives_force() && !regulates_ && commanded_ns_ != 0 &&
      now_ns() - commanded_ns_ > static_cast<std::int64_t>(watchdog_s * kNsPerSecond)) {
    ledger_.add(Row::watchdog);
    set_mode(Mode::brake, Cause::watchdog);
    send({});
  } else if (regulates_) {
    step_regulator(lockstep() ? 1.0 / device_.settings.rate_hz : kTickS);
  } else if (lockstep()) {
    send(force_n_);
  }
}

bool Delta::start() noexcept {
  if (!is_initialised) return false;
  if (!lockstep()) arm_.refresh();
  regulates_ = true;
  counts_misses_ = false;
  set_mode(Mode::force, Cause::none);
  goal_mm_ = target_mm_ = pose().tip_mm;
  return true;
}

void Delta::stop(bool force_on) noexcept {
  if (!regulates_) return;
  regulates_ = false;
  set_mode(force_on ? Mode::force : Mode::brake, Cause::software);
  force_n_ = {};
  send({});
}

void Delta::go_to(DeviceVec<double> goal_mm, const Profile& profile) noexcept {
  goal_mm_ = goal_mm;
  speed_mm_s_ = profile.speed * kMmPerM;
}

bool Delta::moves() const noexcept {
  return regulates_ &&
         (norm(goal_mm_ - target_mm_) > 0 || norm(goal_mm_ - pose().tip_mm) > kArrivedMm);
}

void Delta::step_regulator(double dt_s) noexcept {
  const DeviceVec<double> way = goal_mm_ - target_mm_;
  const double step = speed_mm_s_ * dt_s;
  const double length = norm(way);
  target_mm_ = length <= step || !filters ? goal_mm_ : target_mm_ + way * (step / length);
  DeviceVec<double> force_n = free_force_n;
  if (regulates_position) {
    force_n = (target_mm_ - pose().tip_mm) * kStiffnessNPerMm -
              arm_.velocity(0.005).value_or(DeviceVec<double>{}) * kDampingNsPerMm;
  }
  const double peak_n = force_figures(standin::kDhd.personality).peak_n;
  const double wanted_n = length_of(force_n);
  arm_.count_command(wanted_n);
  if (wanted_n > peak_n) {
    if (!regulates_position) ledger_.add(Row::excess);  // the program's own force, not a spring's
    force_n = force_n * (peak_n / wanted_n);
  }
  note_command(force_n);
  send(force_n);
}

}  // namespace kerf::dhd
