// SPDX-License-Identifier: Apache-2.0
#include "lab/ranges/hard_hand.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "controller/load/load_tool.hpp"
#include "lab/ranges/count_hand.hpp"

namespace kerf::ranges {
namespace {

using Place = DeviceVec<double>;

/// Writes the reports one after the other.
class Writer {
 public:
  Writer(const LoadedScene& scene, HardHand& out)
      : hand_(scene.device), rate_hz_(scene.servo.rate_hz), out_(out) {
    const double scale = scene.device.workspace_scale;
    const double voxel_mm = touched_volumes(scene.volumes).voxel_mm;
    const double radius_mm = scene.tools[scene.active_tool].radius_mm;
    constexpr double kReachMm = 30;  // of every device, about its origin
    // Half of the fastest that is allowed, for the 40 ms of a press.
    const double way_mm =
        std::min(5 * voxel_mm / scale, 0.5 * scene.limits.speed_mm_per_s * kPressMs / 1000);
    top_.y = std::clamp((radius_mm + 2 * voxel_mm) / scale, -kReachMm, kReachMm);
    deep_ = top_;
    deep_.y -= std::min(way_mm, kReachMm);
    aside_ = deep_;
    aside_.x += std::min(way_mm, kReachMm);
    aside_.z += std::min(way_mm, kReachMm) / 3;
    // An Omni is parked in its inkwell, which is where its encoders count from; others anywhere.
    dock_ =
        scene.device.personality == Personality::omni ? CountHand::Counts{} : hand_.counts_at(top_);
    at_ = dock_;
  }

  /// Parks at rest, until it is calibrated; then leaves, until the force has faded in.
  void arm() {
    glide(dock_, 20, true);
    rest(56, true);
    mark(Mark::Kind::armed);
    out_.recovered = out_.reports.size();
    // Over the solid: a proxy that came through it would stay below.
    constexpr double kHighMm = 70;
    glide(hand_.counts_at({0, kHighMm, -kHighMm}), 5, true);
    glide(hand_.counts_at({0, kHighMm, 0}), 5, true);
    glide(hand_.counts_at(top_), 10, true);
    rest(101, false);
    mark(Mark::Kind::active);
  }
  void press() {
    move(deep_, kPressMs);
    rest(10, false);
    slide(40, [](std::size_t) { return true; });
  }
  /// Every third report is lost, then the same one comes again and again.
  void lose() {
    slide(20, [](std::size_t i) { return i % 3 != 0; });
    const DeviceReport same = out_.reports.back();
    for (std::size_t i = ticks(5); i > 0; --i) out_.reports.push_back(same);
  }
  /// One report far away, and back; then counts at the ends of 16 bits, and a lost homing.
  void jump() {
    const CountHand::Counts here = at_;
    say({here[0] + 3000, here[1] - 2000, here[2] + 2500});
    say(here);
    constexpr double kEnd = std::numeric_limits<std::int16_t>::max();
    for (const double end : {kEnd, -kEnd - 1, 0.0}) say({end, end, -end});
    say(here);
    out_.reports.back().parked = true;  // for one report
    say(here);
    out_.reports.back().homed = false;
    for (std::size_t i = ticks(5); i > 0; --i) say(here);
  }
  void silence() {
    for (std::size_t i = ticks(25); i > 0; --i) out_.reports.push_back({});
    mark(Mark::Kind::faded);
    rest(5, false);
  }

 private:
  static constexpr double kPressMs = 40;

  [[nodiscard]] std::size_t ticks(double ms) const {
    return static_cast<std::size_t>(std::ceil(ms * rate_hz_ / 1000)) + 1;
  }
  void mark(Mark::Kind kind) { out_.marks.push_back({kind, out_.reports.size() - 1}); }
  void say(const CountHand::Counts& counts, bool parked = false) {
    out_.reports.push_back(hand_.report(counts, parked));
  }
  void rest(double ms, bool parked) {
    for (std::size_t i = ticks(ms); i > 0; --i) say(at_, parked);
  }
  /// By joints.
  void glide(const CountHand::Counts& to, double ms, bool parked) {
    const CountHand::Counts from = at_;
    // No encoder steps half of its 16 bits in a tick.
    const std::size_t steps = std::max<std::size_t>(ticks(ms), 5);
    for (std::size_t i = 1; i <= steps; ++i) {
      const double s = static_cast<double>(i) / static_cast<double>(steps);
      for (std::size_t j = 0; j < 3; ++j) at_[j] = from[j] + s * (to[j] - from[j]);
      say(at_, parked);
    }
    place_ = top_;
  }
  void move(const Place& to, double ms) {
    const Place from = place_;
    const std::size_t steps = ticks(ms);
    for (std::size_t i = 1; i <= steps; ++i) {
      place_ = from + (to - from) * (static_cast<double>(i) / static_cast<double>(steps));
      at_ = hand_.counts_at(place_);
      say(at_);
    }
  }
  /// To the side and back while the wrist turns; reports that `comes` refuses are lost.
  template <class Comes>
  void slide(double ms, Comes&& comes) {
    const std::size_t steps = ticks(ms);
    for (std::size_t i = 1; i <= steps; ++i) {
      const double s = static_cast<double>(i) / static_cast<double>(steps);
      place_ = deep_ + (aside_ - deep_) * (1 - std::abs(2 * s - 1));
      hand_.turn_wrist(0.5 + 0.3 * s);
      at_ = hand_.counts_at(place_);
      say(at_);
      if (!comes(i)) out_.reports.back() = {};
    }
  }

  CountHand hand_;
  double rate_hz_;
  HardHand& out_;
  Place top_, deep_, aside_, place_;
  CountHand::Counts dock_{}, at_{};
};

}  // namespace

HardHand hard_hand(const LoadedScene& scene) {
  HardHand out;
  Writer writer(scene, out);
  writer.arm();
  writer.press();
  writer.lose();
  writer.silence();
  writer.arm();
  writer.press();
  writer.jump();
  writer.arm();
  writer.press();
  return out;
}

}  // namespace kerf::ranges
