// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

// One axis at a wall, written a second time from docs/forces.md 5.1, 5.2, 5.4 and docs/stability.md
// alone: it includes nothing of kerf, and shares neither mechanics (small steps, stiction after
// Karnopp) nor arithmetic (double) nor a verdict with the loop that the maps run. A truth for it,
// many times as slow.

namespace kerf::second_simulation {

/// Device, wall and scene; mm, N, s, kg.
struct Axis {
  double mass_kg, viscous_ns_per_mm, coulomb_n, step_mm;  ///< of the encoder, above 0
  double period_s;
  int delay_64ths;  ///< from a reading to its force, in parts of a period
  double stiffness_n_per_mm, damping_ns_per_mm;
  double phase_mm;  ///< the encoder's steps lie so far before the multiples of one
  double peak_n = 3.3, slew_n_per_ms = 0.5;
};

struct Press {
  double push_n, hit_mm_per_s, start_mm;
};

/// The velocity of a row of readings, the newest last (docs/forces.md 5.2).
class Windowing {
 public:
  Windowing(const Axis& axis, double reading_mm)
      : stride_(
            std::max<std::size_t>(1, static_cast<std::size_t>(std::lround(1e-3 / axis.period_s)))),
        interval_s_(axis.period_s * static_cast<double>(stride_)),
        most_mm_(axis.step_mm),  // twice the noise, which is half of a step
        readings_(kLongest * stride_ + 1, reading_mm) {}

  double take(double reading_mm) {
    readings_.erase(readings_.begin());
    readings_.push_back(reading_mm);
    double slope = 0;
    for (std::size_t i = 1; i <= kLongest; ++i) {
      double sum = 0;
      for (std::size_t j = 0; j <= i; ++j) {
        sum += (static_cast<double>(i) - 2 * static_cast<double>(j)) * ago(j);
      }
      const auto n = static_cast<double>(i);
      const double wider = 6 * sum / (n * (n + 1) * (n + 2));
      for (std::size_t j = 1; i > 1 && j <= i; ++j) {
        const double miss_mm = ago(0) - static_cast<double>(j) * wider - ago(j);
        if (std::abs(miss_mm) > most_mm_ * (1 + 1e-9)) return slope / interval_s_;
      }
      slope = wider;
    }
    return slope / interval_s_;
  }

 private:
  static constexpr std::size_t kLongest = 16;
  [[nodiscard]] double ago(std::size_t intervals) const {
    return readings_[readings_.size() - 1 - intervals * stride_];
  }

  std::size_t stride_;
  double interval_s_, most_mm_;
  std::vector<double> readings_;
};

/// Force of the wall on the tip, outwards, from one reading to the next, with the limits of a
/// scene.
class Wall {
 public:
  Wall(const Axis& axis, double reading_mm)
      : axis_(axis), velocity_(axis, reading_mm), last_mm_(reading_mm) {}

  double force_n(double reading_mm) {
    const double moved_mm = reading_mm - last_mm_;
    last_mm_ = reading_mm;
    const double outwards = velocity_.take(reading_mm), spring_mm = -reading_mm;
    double wanted_n = 0;
    if (spring_mm > 0) {
      const double damps = axis_.damping_ns_per_mm * std::min(1.0, spring_mm / 0.1);
      wanted_n = std::max(0.0, axis_.stiffness_n_per_mm * spring_mm - damps * outwards);
    }
    wanted_n = std::min(wanted_n, axis_.peak_n);
    // A force that the hand moves with may fall at once.
    const double whole_n = sent_n_, slew_n = axis_.slew_n_per_ms * 1000 * axis_.period_s;
    const bool leaves = whole_n * moved_mm > 0;
    const double from_n = leaves ? std::min(whole_n, wanted_n) : whole_n;
    sent_n_ = from_n + std::clamp(wanted_n - from_n, -slew_n, slew_n);
    if (leaves) {
      const double most_n = std::max(slew_n, whole_n);
      sent_n_ = std::clamp(sent_n_, whole_n - most_n, whole_n + most_n);
    }
    return sent_n_;
  }

 private:
  const Axis& axis_;
  Windowing velocity_;
  double last_mm_, sent_n_ = 0;
};

/// The tip in steps of a 64th of a period: speed first, then place (semi-implicit Euler), and speed
/// 0 where friction would turn it round (Karnopp).
class Tip {
 public:
  static constexpr int kSteps = 64;
  Tip(const Axis& axis, const Press& press)
      : axis_(axis), mm_(press.start_mm), mm_per_s_(-press.hit_mm_per_s) {}

  void step(double force_n) {
    const double s = axis_.period_s / kSteps, per_n = 1000 * s / axis_.mass_kg;
    if (mm_per_s_ == 0 && std::abs(force_n) <= axis_.coulomb_n) return;
    const double way = mm_per_s_ != 0 ? mm_per_s_ : force_n;
    const double drive_n = force_n - std::copysign(axis_.coulomb_n, way);
    const double speed = (mm_per_s_ + per_n * drive_n) / (1 + per_n * axis_.viscous_ns_per_mm);
    mm_per_s_ = speed * way > 0 ? speed : 0;
    mm_ += s * mm_per_s_;
  }
  [[nodiscard]] double mm() const { return mm_; }
  [[nodiscard]] bool stands() const { return mm_per_s_ == 0; }
  [[nodiscard]] double reading_mm() const {
    return std::floor((mm_ + axis_.phase_mm) / axis_.step_mm) * axis_.step_mm - axis_.phase_mm;
  }

 private:
  const Axis& axis_;
  double mm_, mm_per_s_;
};

/// Whether the tip still oscillates at the end: in both halves of the last half it turns at least
/// twice, after more than an encoder step each time, and its travel does not fall in all of the
/// eight windows. A tip that stands under one force for longer than the loop remembers has settled.
inline bool oscillates(const Axis& axis, const Press& press, double seconds) {
  constexpr std::size_t kWindows = 8;
  constexpr double kRemembersS = 0.25, kFarMm = 1e4;
  Tip tip(axis, press);
  Wall wall(axis, tip.reading_mm());
  const double hand_n = axis.coulomb_n + press.push_n;
  const auto ticks = static_cast<std::size_t>(seconds / axis.period_s);
  std::vector<double> asked_n(static_cast<std::size_t>(axis.delay_64ths / Tip::kSteps) + 2, 0.0);
  std::array<double, kWindows> low_mm{}, high_mm{};
  low_mm.fill(kFarMm);
  high_mm.fill(-kFarMm);
  std::array<int, 2> turns{};
  double from_mm = tip.mm(), last_n = 0, stood_s = 0;
  int way = 1;
  for (std::size_t tick = 0; tick < ticks; ++tick) {
    const double now_n = wall.force_n(tip.reading_mm());
    asked_n.pop_back();
    asked_n.insert(asked_n.begin(), now_n);
    for (int part = 0; part < Tip::kSteps; ++part) {
      const int late = axis.delay_64ths - part;  // 64ths by which the newest is still on its way
      const int ago = late > 0 ? (late + Tip::kSteps - 1) / Tip::kSteps : 0;
      tip.step(asked_n[static_cast<std::size_t>(ago)] - hand_n);
    }
    if (std::abs(tip.mm()) > kFarMm) return true;
    stood_s = tip.stands() && now_n == last_n ? stood_s + axis.period_s : 0;
    last_n = now_n;
    if (stood_s > kRemembersS) return false;
    if (2 * tick < ticks) {
      from_mm = tip.mm();
      continue;
    }
    const std::size_t window = (2 * tick - ticks) * kWindows / ticks;
    low_mm[window] = std::min(low_mm[window], tip.mm());
    high_mm[window] = std::max(high_mm[window], tip.mm());
    // A turn counts once the tip is back by more than a step from where it was farthest.
    const double back_mm = way * (from_mm - tip.mm());
    if (back_mm < 0) from_mm = tip.mm();
    if (back_mm > axis.step_mm) {
      ++turns[window < kWindows / 2 ? 0 : 1];
      way = -way;
      from_mm = tip.mm();
    }
  }
  bool falls = true;
  for (std::size_t i = 1; i < kWindows; ++i) {
    falls = falls && high_mm[i] - low_mm[i] < high_mm[i - 1] - low_mm[i - 1];
  }
  return turns[0] >= 2 && turns[1] >= 2 && !falls;
}

}  // namespace kerf::second_simulation
