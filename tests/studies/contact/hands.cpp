// SPDX-License-Identifier: Apache-2.0
#include "tests/studies/contact/hands.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>
#include <span>
#include <string>

#include "controller/load/load_scene.hpp"
#include "hil/device/emulator.hpp"
#include "hil/device/omni.hpp"
#include "hil/device/packet_device.hpp"
#include "hil/hil_error.hpp"
#include "hil/script/hand_script_file.hpp"
#include "lab/rig/virtual_loop.hpp"
#include "tests/rig/geometry.hpp"

namespace kerf::extremes {
namespace {

constexpr std::size_t kWindow = 128;
constexpr std::int64_t kPatienceS = 20;  // until the hand has calibrated and left the inkwell

/// Power of one axis above a cutoff in cycles a tick: of the periodogram under a Hann window, which
/// keeps slow parts from leaking up.
double power_above(std::span<const HandTick> window, std::size_t axis, double cutoff) {
  const double turn = 2 * std::numbers::pi / kWindow;
  double power = 0;
  for (std::size_t k = 1; k <= kWindow / 2; ++k) {
    if (static_cast<double>(k) / kWindow < cutoff) continue;
    std::complex<double> sum = 0;
    for (std::size_t i = 0; i < kWindow; ++i) {
      const double hann = 0.5 - 0.5 * std::cos(turn * static_cast<double>(i));
      sum += hann * window[i].force_n[axis] *
             std::polar(1.0, -turn * static_cast<double>(k * i % kWindow));
    }
    const double sides = k == kWindow / 2 ? 1 : 2;
    power += sides * std::norm(sum) / (kWindow * kWindow);
  }
  constexpr double kHannPower = 3.0 / 8;
  return power / kHannPower;
}

void tell(const HandRun& run, const RowSink& add_row) {
  double peak_n = 0, step_n = 0;
  std::size_t contact = 0;
  const HandTick* before = nullptr;
  for (const HandTick& tick : run.ticks) {
    const Point& f = tick.force_n;
    peak_n = std::max(peak_n, length(f));
    contact += tick.contact ? 1 : 0;
    if (before != nullptr) step_n = std::max(step_n, length(f - before->force_n));
    before = &tick;
  }
  const Chatter chatter = chatter_of(run, kChatterHz);
  const auto row = [&](const char* what, double value, const char* unit,
                       std::optional<double> must = std::nullopt) {
    add_row({"hands", run.name + what, value, unit, must, {}});
  };
  row(": in contact", 100 * double(contact) / double(run.ticks.size()), "%");
  row(": peak force", peak_n, "N");
  row(": largest step of the force in a tick", step_n, "N");
  row(": removed", run.ticks.empty() ? 0 : run.ticks.back().removed_mm3, "mm^3");
  row(": force above 150 Hz over the mean", 100 * chatter.share, "%", 2);
  row(": force above 150 Hz, worst window of 0.128 s", 100 * chatter.worst, "%");
  row(": windows in contact", chatter.windows, "1");
  row(": ticks with a fault", double(run.faults), "ticks", 0);
}

/// scenes/touch.toml with another way to cut.
LoadedScene hand_scene(const Effort& effort, CutModel cut) {
  LoadedScene scene = shipped_scene("touch", effort);
  scene.cut.model = cut;
  return scene;
}

}  // namespace

HandRun run_hand(LoadedScene scene, const HandScript& hand, double seconds) {
  OmniParams params;
  params.dock_rad = scene.device.dock_rad;
  scene.device.torque_scale = params.torque_scale();
  std::vector<double> mm3_per_step(scene.volumes.size());
  for (std::size_t v = 0; v < scene.volumes.size(); ++v) {
    const auto& h = scene.volumes[v].image.spacing_mm;
    mm3_per_step[v] = h[0] * h[1] * h[2] / kDensityMax;
  }
  HandRun run;
  run.rate_hz = scene.servo.rate_hz;
  Emulator emulator(params, hand);
  DirectPort port(emulator);
  VirtualLoop loop(scene, port);
  const auto ticks = static_cast<std::int64_t>(seconds * scene.servo.rate_hz);
  double removed_mm3 = 0;
  while (static_cast<std::int64_t>(run.ticks.size()) < ticks) {
    const ServoOutput out = loop.tick();
    if (!out.started) {
      if (loop.cycles() < kPatienceS * kCyclesPerSecond) continue;
      throw HilError(
          "the emulated hand: did not take up the device within 20 s; see [device] dock_rad");
    }
    run.faults += out.fault == Fault::none ? 0 : 1;
    for (std::size_t v = 0; v < mm3_per_step.size(); ++v) {
      removed_mm3 += mm3_per_step[v] * static_cast<double>(out.removed_by_volume[v]);
    }
    const double height_mm = out.position_mm[1] - scene.device.offset_mm[1];
    run.ticks.push_back({height_mm, height_mm + out.proxy_offset_mm[1], out.commanded_force_n,
                         removed_mm3, out.contact, loop.step_us()});
  }
  return run;
}

Chatter chatter_of(const HandRun& run, double cutoff_hz) {
  Chatter chatter;
  double all_power = 0, all_n = 0;
  for (std::size_t from = 0; from + kWindow <= run.ticks.size(); from += kWindow / 2) {
    const auto window = std::span(run.ticks).subspan(from, kWindow);
    if (!std::ranges::all_of(window, &HandTick::contact)) continue;
    double mean_n = 0, power = 0;
    for (const HandTick& tick : window) mean_n += length(tick.force_n) / kWindow;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      power += power_above(window, axis, cutoff_hz / run.rate_hz);
    }
    chatter.worst = std::max(chatter.worst, std::sqrt(power) / mean_n);
    all_power += power;
    all_n += mean_n;
    ++chatter.windows;
  }
  if (chatter.windows > 0) {
    chatter.share = std::sqrt(all_power / chatter.windows) / (all_n / chatter.windows);
  }
  return chatter;
}

LoadedScene shipped_scene(const std::string& name, const Effort& effort) {
  return load_scene("scenes/" + name + ".toml", {.phantom_size = effort.phantom});
}

HandRun run_hand(const LoadedScene& scene, const std::string& name, const Effort& effort) {
  HandScript hand = read_hand_script("scenes/hands/" + name + ".toml");
  if (!hand.unit_mm) hand.unit_mm = hand_unit_mm(scene);
  HandRun run = run_hand(scene, hand, effort.hand_seconds);
  run.name = name;
  return run;
}

std::vector<HandRun> try_hands(const Effort& effort, const RowSink& add_row) {
  const LoadedScene feeling = hand_scene(effort, CutModel::none);
  const LoadedScene cutting = hand_scene(effort, CutModel::preston);
  std::vector<HandRun> runs;
  const auto run = [&](const LoadedScene& scene, const char* name) {
    runs.push_back(run_hand(scene, name, effort));
    tell(runs.back(), add_row);
  };
  run(feeling, "touch");
  run(feeling, "slide");
  run(cutting, "groove");
  run(cutting, "cut_cavity");
  run(feeling, "jerk");
  return runs;
}

}  // namespace kerf::extremes
