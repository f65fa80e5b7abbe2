// SPDX-License-Identifier: Apache-2.0
// A ball of 50 g that lies in a bowl and is pushed by the tip: physics of a program's own, at its
// own rate, and the force of their contact for the hand.
//
//     ./kerf demo --scene external --name mine --seconds 20 &
//     ball mine 5
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include <kerf/device.hpp>

namespace {

using Point = std::array<double, 3>;

/// A ball on springs towards the middle of its bowl. Semi-implicit Euler, mm, s, N, kg.
struct Ball {
  static constexpr double kRadiusMm = 10, kMassKg = 0.05, kBowlNPerMm = 0.05, kRollsNsPerMm = 0.002;
  static constexpr double kStiffNPerMm = 0.3;

  /// Moves on by `dt_s`; returns the force on a tip there.
  Point push(const Point& tip_mm, double dt_s) {
    Point away{};
    double distance_mm = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      away[i] = tip_mm[i] - at_mm[i];
      distance_mm += away[i] * away[i];
    }
    distance_mm = std::sqrt(distance_mm);
    const double depth_mm = std::max(0.0, kRadiusMm - distance_mm);
    Point on_tip_n{};
    for (std::size_t i = 0; i < 3; ++i) {
      if (distance_mm > 0) on_tip_n[i] = kStiffNPerMm * depth_mm * away[i] / distance_mm;
      const double on_ball_n =
          -on_tip_n[i] - kBowlNPerMm * at_mm[i] - kRollsNsPerMm * speed_mm_per_s[i];
      speed_mm_per_s[i] += 1000 * on_ball_n / kMassKg * dt_s;
      at_mm[i] += speed_mm_per_s[i] * dt_s;
    }
    return on_tip_n;
  }

  Point at_mm{}, speed_mm_per_s{};
};

}  // namespace

int main(int count, char** words) try {
  auto device = kerf::Device::open(count > 1 ? words[1] : "kerf");
  const double seconds = count > 2 ? std::atof(words[2]) : 1e9;
  Ball ball;
  kerf::Tick last = 0, first = 0;
  double most_n = 0;
  while (device.wait()) {
    const kerf::DeviceState& now = device.state();
    if (first == 0) first = last = now.tick;
    const double dt_s = static_cast<double>(now.tick - last) * device.period_s();
    last = now.tick;
    if (static_cast<double>(last - first) * device.period_s() > seconds) break;
    if (std::isnan(now.position_mm[0])) continue;
    device.give({.force_n = ball.push(now.position_mm, std::min(dt_s, 0.01))});
    most_n = std::max(most_n, std::hypot(now.force_n[0], now.force_n[1], now.force_n[2]));
  }
  std::printf("%.1f s, the ball at %.2f %.2f %.2f mm, at most %.2f N\n",
              static_cast<double>(last - first) * device.period_s(), ball.at_mm[0], ball.at_mm[1],
              ball.at_mm[2], most_n);
} catch (const kerf::Error& error) {
  std::fprintf(stderr, "ball: %s\n", error.what());
  return 1;
}
