// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <future>
#include <memory>
#include <string>

#include "controller/load/load_scene.hpp"
#include "controller/plan/compile.hpp"
#include "tests/studies/ranges/combination.hpp"
#include "tests/studies/ranges/extreme_rows.hpp"
#include "tests/studies/ranges/rules.hpp"

namespace kerf::ranges {
namespace {

using Vector = std::array<double, 3>;

double minus_work_mj(const Vector& force_n, const Vector& from_mm, const Vector& to_mm) {
  double work = 0;
  for (std::size_t i = 0; i < 3; ++i) work -= force_n[i] * (to_mm[i] - from_mm[i]);
  return work;
}

/// Looks at each tick of the run.
class Watch {
 public:
  Watch(const LoadedScene& scene, std::uint64_t most_samples, std::size_t round)
      : rules_(scene, most_samples), scale_(scene.device.workspace_scale), round_(round) {}

  void look_at(const DeviceReport& report, const ServoOutput& out) {
    rules_.look_at(report, out);
    book(report, out);
    time_ramp(out);
    run_.removed += out.removed_steps;
    if (++run_.ticks % round_ == 0) {
      run_.last_cycle_mj = out.absorbed_mj - round_began_mj_;
      if (run_.ticks == round_) run_.first_cycle_mj = run_.last_cycle_mj;
      round_began_mj_ = out.absorbed_mj;
    }
    run_.absorbed_mj = out.absorbed_mj;
  }
  [[nodiscard]] Rules& rules() { return rules_; }
  [[nodiscard]] LongRun& run() { return run_; }

 private:
  /// The ledger anew, in double; over a gap it is believed.
  void book(const DeviceReport& report, const ServoOutput& out) {
    double booked_mj = out.absorbed_mj - last_.absorbed_mj;
    const bool even = run_.ticks > 0 && report.fresh && !last_.stale;
    if (even)
      booked_mj =
          minus_work_mj(last_.commanded_force_n, last_.position_mm, out.position_mm) / scale_;
    own_mj_ += booked_mj;
    run_.ledger_off_mj = std::max(run_.ledger_off_mj, std::abs(own_mj_ - out.absorbed_mj));
    last_ = out;
  }
  void time_ramp(const ServoOutput& out) {
    if (out.phase == Phase::ramping) ++ramp_;
    if (out.phase == Phase::active && ramp_ > 0) {
      run_.shortest_ramp = run_.ramps == 0 ? ramp_ : std::min(run_.shortest_ramp, ramp_);
      run_.longest_ramp = std::max(run_.longest_ramp, ramp_);
      ++run_.ramps;
    }
    if (out.phase != Phase::ramping) ramp_ = 0;
  }

  Rules rules_;
  double scale_;
  std::size_t round_;
  LongRun run_;
  ServoOutput last_;
  double own_mj_ = 0, round_began_mj_ = 0;
  std::uint64_t ramp_ = 0;
};

LoadedScene long_scene(NumericKind numeric, const SceneFolder& folder) {
  const auto file = folder.path() / "long.toml";
  std::ofstream(file) << scene_text(
      {{"cut.machinability_mm3_per_s_n", "1e-4"}, {"device.offset_mm", "[0.0, 1.0, 0.0]"}});
  return load_scene(file, {.numeric = numeric});
}

/// The end after ticks `from` to `to`.
std::uint64_t play(
    CompiledScene& servo, const StressInput& hand, std::uint64_t from, std::uint64_t to,
    std::size_t volumes,
    const std::function<void(std::uint64_t tick, const DeviceReport&, const ServoOutput&)>& look) {
  ServoOutput out;
  for (std::uint64_t tick = from; tick < to; ++tick) {
    const DeviceReport& report = hand.reports[tick % hand.reports.size()];
    out = servo.step(report);
    if (look) look(tick, report, out);
  }
  return hash_of(servo, volumes, out);
}

void judge(std::uint64_t gone, Watch& watch) {
  LongRun& run = watch.run();
  const auto broken = [&](bool held, const char* rule, std::string what) {
    if (!held) watch.rules().broken(rule, std::move(what));
  };
  broken(gone == run.removed, "removed",
         std::to_string(gone) + " steps gone, " + std::to_string(run.removed) + " told");
  broken(run.largest_carry <= 1, "carry", std::to_string(run.largest_carry) + " voxels are owed");
  broken(run.ramps == 0 || run.shortest_ramp == run.longest_ramp, "clock",
         "the force fades in over " + std::to_string(run.shortest_ramp) + " to " +
             std::to_string(run.longest_ramp) + " ticks");
  // The ledger is exact in both number types; the sum here is of doubles.
  const double most_mj = 1e-6 + 1e-13 * static_cast<double>(run.ticks);
  broken(run.ledger_off_mj <= most_mj, "ledger",
         "off by " + std::to_string(run.ledger_off_mj) + " mJ");
}

}  // namespace

LongRun run_long(NumericKind numeric, std::uint64_t ticks,
                 const std::function<void(double share)>& progress) {
  const SceneFolder folder;
  LoadedScene scene = long_scene(numeric, folder);
  LoadedScene twin = scene;
  const StressInput hand = hard_hand(scene);
  const auto servo = compile(scene), other = compile(twin);
  const std::size_t volumes = scene.volumes.size();
  Watch watch(scene, most_samples(servo->costs(), scene), hand.reports.size());
  const std::uint64_t before = sum_of(*servo, volumes);
  const auto look = [&](std::uint64_t tick, const DeviceReport& report, const ServoOutput& out) {
    watch.look_at(report, out);
    constexpr std::uint64_t kTold = 1 << 16;
    if (tick % kTold == 0) progress(static_cast<double>(tick) / static_cast<double>(ticks));
  };
  const auto began = std::chrono::steady_clock::now();
  static_cast<void>(play(*servo, hand, 0, ticks / 2, volumes, look));
  const auto middle = servo->keep();
  other->restore(*middle);
  auto again = std::async(std::launch::async,
                          [&] { return play(*other, hand, ticks / 2, ticks, volumes, nullptr); });
  const std::uint64_t end = play(*servo, hand, ticks / 2, ticks, volumes, look);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
  if (again.get() != end) watch.rules().broken("halves", "other bits");
  LongRun& run = watch.run();
  run.largest_carry = std::max(middle->largest_carry(), servo->keep()->largest_carry());
  run.ticks_per_s = static_cast<double>(ticks) / took.count();
  judge(before - sum_of(*servo, volumes), watch);
  run.violations = watch.rules().violations();
  return run;
}

}  // namespace kerf::ranges
