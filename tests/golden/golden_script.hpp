// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "controller/servo/servo.hpp"

/// The scenes of the golden run by name, and its hand in integers: joint counts, pots, gaps and
/// commands by tick. No heap: bare metal runs it too.
namespace kerf::test {

/// Two volumes, one that the tools' lattices fit and one that none fits.
enum class GoldenScene : std::uint8_t {
  mill,  ///< cuts for 20 s: in fixed point the methods `aligned` and `splat`
  feel,  ///< cuts nothing, turns tools without symmetry for 3 s: the method `gather`
  sweep  ///< feels by the swept proxy and cuts by its force for 3 s: a ball, a shaft that turns
};
[[nodiscard]] constexpr const char* name_of(GoldenScene scene) noexcept {
  constexpr const char* kNames[] = {"mill", "feel", "sweep"};
  return kNames[static_cast<std::size_t>(scene)];
}
constexpr std::int32_t golden_ticks(GoldenScene scene) noexcept {
  return scene == GoldenScene::mill ? 20'000 : 3'000;  // at 1 kHz
}

/// From the inkwell to the volumes and back, between two ticks.
struct Outing {
  std::int32_t begin, end;
};
inline constexpr std::array<Outing, 3> kOutings{{{0, 9'000}, {9'000, 14'500}, {14'500, 1 << 20}}};
inline constexpr std::int32_t kRestTicks = 80;     ///< in the inkwell before each outing
inline constexpr std::int32_t kTravelTicks = 400;  ///< each way
inline constexpr std::int32_t kLostTick = 8'300;   ///< reports stop for longer than 20 ms
inline constexpr std::int32_t kJerkTick = 13'800;  ///< the tip jumps: overspeed
inline constexpr std::int32_t kToolTicks = 1'100;  ///< then the next tool

/// -amplitude..amplitude, from 0 upwards.
constexpr std::int32_t triangle(std::int32_t tick, std::int32_t period,
                                std::int32_t amplitude) noexcept {
  const std::int32_t phase = tick % period * 4 * amplitude / period;
  if (phase < amplitude) return phase;
  return phase < 3 * amplitude ? 2 * amplitude - phase : phase - 4 * amplitude;
}

constexpr bool report_is_lost(std::int32_t tick) noexcept {
  if (tick >= kLostTick && tick < kLostTick + 25) return true;
  return tick % 997 < tick / 997 % 13;  // none, then ever longer gaps: held, then faded
}

/// What the device says in this tick.
constexpr DeviceReport scripted_report(std::int32_t tick) noexcept {
  constexpr std::array<std::int32_t, 3> kPowerUp{32'760, -32'700, 32'700};  // wraps on the way
  constexpr std::array<std::int32_t, 3> kWork{150, -200, 180};  // counts from the inkwell
  constexpr std::array<std::int32_t, 3> kSwing{75, 68, 64}, kPeriod{1'301, 1'709, 2'311};
  DeviceReport report;
  if (report_is_lost(tick)) return report;

  const Outing& outing = *std::find_if(kOutings.begin(), kOutings.end(),
                                       [&](const Outing& o) { return tick < o.end; });
  const std::int32_t since = tick - outing.begin, left = outing.end - tick;
  const std::int32_t share =
      std::clamp<std::int32_t>(std::min(since - kRestTicks, left - kRestTicks), 0, kTravelTicks);
  const auto noise = [tick](std::size_t from_bit, std::uint32_t largest) {
    const std::uint32_t bits = static_cast<std::uint32_t>(tick) * 2'654'435'761U;
    return static_cast<std::int32_t>(bits >> from_bit & largest);
  };

  report.fresh = true;
  report.parked = since < kRestTicks;
  report.counter = static_cast<std::uint32_t>(tick);
  for (std::size_t i = 0; i < 3; ++i) {
    std::int32_t counts = (kWork[i] + triangle(tick, kPeriod[i], kSwing[i])) * share / kTravelTicks;
    if (tick == kJerkTick) counts += 90;
    if (!report.parked) counts += noise(29 + i, 1);
    report.counts[i] = static_cast<std::int16_t>(kPowerUp[i] + counts);
    const std::int32_t turned = triangle(tick, 3 * kPeriod[2 - i], 9'000);
    report.wiper_a[i] = static_cast<std::uint16_t>(32'768 + turned + noise(20 + i, 31));
    report.wiper_b[i] = static_cast<std::uint16_t>(32'768 - turned + noise(10 + i, 31));
  }
  if (tick % 5'003 == 5'002) report.wiper_a = report.wiper_b = {};  // a pot that reads nothing
  return report;
}

/// What a person asks for before this tick.
constexpr ServoCommand scripted_command(std::int32_t tick, std::uint32_t tools) noexcept {
  using Kind = ServoCommand::Kind;
  if (tick == 5'000 || tick == 5'060) return {Kind::hold, tick == 5'000 ? 1U : 0U};
  if (tick == 7'000) return {Kind::select_tool, 1'000};  // refused
  if (tick == 12'000) return {Kind::fade_in, 0};
  if (tick % kToolTicks != 0) return {};
  return {Kind::select_tool, static_cast<std::uint32_t>(tick / kToolTicks) % tools};
}

}  // namespace kerf::test
