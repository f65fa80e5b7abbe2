// SPDX-License-Identifier: Apache-2.0
#include "tests/studies/bridge/measurements.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <deque>
#include <memory>
#include <random>
#include <span>
#include <utility>

#include "shared/numeric/statistics.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "tests/studies/bridge/volume_source.hpp"

namespace kerf::two_machines {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kJoinPatience{60'000};  // the slowest link needs 9 s
constexpr milliseconds kRepairPatience{2'000};
constexpr milliseconds kStillPatience{10'000};  // of a slow link with a queue

void sleep_s(double seconds) {
  pause(std::chrono::nanoseconds(static_cast<std::int64_t>(seconds * 1e9)));
}

[[nodiscard]] double seconds_since(std::int64_t ns) {
  return static_cast<double>(monotonic_ns() - ns) / kNsPerSecond;
}

/// Both machines with a near segment, and a serve.
struct Scene {
  Scene(const LinkSettings& link, const BridgeFiles& files, Load load, std::int32_t layers,
        bool dedicated_link = false)
      : networks(link),
        volume(BridgePair::kNearName, load, layers),
        pair(networks, files, dedicated_link) {
    sleep_s(0.5);  // it listens by then, or has reported why not
    pair.require_serve();
  }
  TwoNetworks networks;
  MilledVolume volume;
  BridgePair pair;
};

/// Milling rests; whether the far volume is the near one within `patience`.
[[nodiscard]] bool equal_when_still(MilledVolume& volume, const FarViewer& viewer,
                                    milliseconds patience) {
  volume.hold_still();
  return viewer.equals_within(volume.density_hash(), patience);
}

[[nodiscard]] PublishResult::Spread spread_of(std::vector<double>& values) {
  const auto at = [&values](double share) { return percentile(std::span(values), share); };
  return {at(0), at(0.5), at(1)};
}

}  // namespace

std::vector<Case> table_cases() {
  const LinkSettings clean, loss1{.loss = 0.01, .delay_ms = 20},
      loss5{.loss = 0.05, .delay_ms = 20};
  const LinkSettings mbit16{.mbit = 16}, mbit4{.mbit = 4};
  return {
      {"clean", clean, Load::slow, 21, false, 0.2, 20},
      {"clean, sweep", clean, Load::sweep, 21, false, 0.2, 0},
      {"1 % loss, 20 ms each way", loss1, Load::slow, 21, false, 3, 240},
      {"the same, `--dedicated-link`", loss1, Load::slow, 21, true, 3, 100},
      {"5 % loss, 20 ms each way", loss5, Load::slow, 21, false, 6, 380},
      {"the same, `--dedicated-link`", loss5, Load::slow, 21, true, 6, 150},
      {"16 Mbit/s", mbit16, Load::slow, 21, false, 5, 30},
      {"16 Mbit/s, sweep over 2000 bricks", mbit16, Load::sweep, 21, false, 5, 1200},
      // 4096 bricks of 1,024 bytes: 8.4 s at the link's rate.
      {"4 Mbit/s, 4096 bricks", mbit4, Load::slow, 4, false, 8.4, 150},
  };
}

std::vector<Case> quick_cases() {
  return {{"clean", {}, Load::slow, 4, false, 0, 0},
          {"1 % loss, 5 ms each way", {.loss = 0.01, .delay_ms = 5}, Load::slow, 4, false, 0, 0}};
}

CaseResult run_case(const Case& what, const BridgeFiles& files, double seconds) {
  Scene scene(what.link, files, what.load, what.layers, what.dedicated_link);
  FarViewer viewer("far", scene.volume), control(BridgePair::kNearName, scene.volume);
  CaseResult out;
  const std::int64_t start_ns = monotonic_ns();
  const auto join = scene.pair.join("far");
  if (!viewer.joins_within(kJoinPatience)) return out;
  out.join_s = seconds_since(start_ns);
  sleep_s(1);  // changes during the join are caught up
  const ProcessCost serve_before = cost_of(scene.pair.serve()), join_before = cost_of(*join);
  const std::uint64_t bytes_before = scene.networks.bytes_to_far();
  const std::int64_t from_ns = monotonic_ns();
  viewer.begin_ages();
  control.begin_ages();
  sleep_s(seconds);
  const Histogram ages = viewer.take_ages();
  out.near_p99_ms = control.take_ages().percentile_us(0.99) / 1e3;
  const double passed_s = seconds_since(from_ns);
  const ProcessCost serve = cost_of(scene.pair.serve()), joined = cost_of(*join);
  out.age_p50_ms = ages.percentile_us(0.5) / 1e3;
  out.age_p99_ms = ages.percentile_us(0.99) / 1e3;
  out.age_max_ms = ages.max_us() / 1e3;
  out.link_mbit =
      8e-6 * static_cast<double>(scene.networks.bytes_to_far() - bytes_before) / passed_s;
  out.serve_cpu_percent = 100 * (serve.cpu_s - serve_before.cpu_s) / passed_s;
  out.join_cpu_percent = 100 * (joined.cpu_s - join_before.cpu_s) / passed_s;
  out.serve_mib = serve.own_mib;
  out.join_mib = joined.own_mib;
  out.equal = equal_when_still(scene.volume, viewer, kStillPatience);
  return out;
}

KillResult run_kills(const BridgeFiles& files, Killed side, int times, std::int32_t layers,
                     std::uint64_t seed) {
  Scene scene({}, files, Load::slow, layers);
  FarViewer viewer("far", scene.volume);
  auto join = scene.pair.join("far");
  KillResult out;
  if (!viewer.joins_within(kJoinPatience)) return out;
  std::mt19937_64 random(seed);
  for (; out.kills < times; ++out.kills) {
    scene.volume.go_on();
    sleep_s(static_cast<double>(random() % 1000) / 1e3);
    if (side == Killed::cable) {
      scene.networks.set_cut(true);
      sleep_s(3);
      scene.networks.set_cut(false);
    } else if (side == Killed::interface) {
      using Side = TwoNetworks::Side;
      const Side machine = out.kills % 2 == 0 ? Side::near : Side::far;
      scene.networks.set_interface(machine, false);
      sleep_s(3);
      scene.networks.set_interface(machine, true);
    } else if (side == Killed::serve) {
      scene.pair.kill_serve();
      scene.pair.start_serve();
    } else {
      join->signal(SIGKILL);
      while (!join->ended()) sleep_s(1e-3);
      join = scene.pair.join("far");
    }
    const std::int64_t back_ns = monotonic_ns();
    if (!equal_when_still(scene.volume, viewer, kRepairPatience)) continue;
    ++out.equal;
    out.slowest_s = std::max(out.slowest_s, seconds_since(back_ns));
  }
  return out;
}

StoppedResult run_stopped(const BridgeFiles& files, double seconds, std::int32_t layers) {
  Scene scene({}, files, Load::slow, layers);
  FarViewer stopped("stopped", scene.volume), other("other", scene.volume);
  const auto stopped_join = scene.pair.join("stopped"), other_join = scene.pair.join("other");
  StoppedResult out;
  if (!stopped.joins_within(kJoinPatience) || !other.joins_within(kJoinPatience)) return out;
  sleep_s(1);
  stopped_join->signal(SIGSTOP);
  other.begin_ages();
  sleep_s(seconds);
  const Histogram ages = other.take_ages();
  stopped_join->signal(SIGCONT);
  out.other_p99_ms = ages.percentile_us(0.99) / 1e3;
  out.other_max_ms = ages.max_us() / 1e3;
  out.equal = equal_when_still(scene.volume, stopped, kRepairPatience);
  return out;
}

PublishResult run_publish(const BridgeFiles& files, double seconds, int pairs,
                          std::int32_t layers) {
  const TwoNetworks networks({});
  MilledVolume volume(BridgePair::kNearName, Load::slow, layers);
  std::array<std::vector<double>, 2> p50, p99;
  PublishResult out;
  for (int turn = 0; turn < 2 * pairs; ++turn) {
    const bool bridged = turn % 2 != 0;
    std::unique_ptr<BridgePair> pair;
    std::unique_ptr<sweep::Child> join;
    if (bridged) {
      pair = std::make_unique<BridgePair>(networks, files, false);
      join = pair->join("far");
      const FarViewer viewer("far", volume);
      if (!viewer.joins_within(kJoinPatience)) break;
    }
    static_cast<void>(volume.take_publish_times());
    sleep_s(seconds / (2 * pairs));
    const Histogram times = volume.take_publish_times();
    p50.at(bridged).push_back(times.percentile_us(0.5));
    p99.at(bridged).push_back(times.percentile_us(0.99));
    if (!bridged) continue;
    ++out.pairs;
    if (p99[1].back() > p99[0].back()) ++out.slower;
  }
  out.alone_p50 = spread_of(p50[0]);
  out.alone_p99 = spread_of(p99[0]);
  out.bridged_p50 = spread_of(p50[1]);
  out.bridged_p99 = spread_of(p99[1]);
  return out;
}

CrowdResult run_crowd(const BridgeFiles& files, int viewers, double seconds, std::int32_t layers) {
  Scene scene({}, files, Load::slow, layers);
  std::deque<FarViewer> looking;
  std::vector<std::unique_ptr<sweep::Child>> joins;
  CrowdResult out;
  out.viewers = viewers;
  for (int i = 0; i < viewers; ++i) {
    const std::string name = "far" + std::to_string(i);
    joins.push_back(scene.pair.join(name));
    looking.emplace_back(name, scene.volume);
  }
  for (const FarViewer& viewer : looking) {
    if (!viewer.joins_within(kJoinPatience)) return out;
  }
  sleep_s(1);
  for (FarViewer& viewer : looking) viewer.begin_ages();
  const ProcessCost before = cost_of(scene.pair.serve());
  const std::int64_t from_ns = monotonic_ns();
  sleep_s(seconds);
  const ProcessCost after = cost_of(scene.pair.serve());
  out.serve_cpu_percent = 100 * (after.cpu_s - before.cpu_s) / seconds_since(from_ns);
  out.serve_mib = after.own_mib;
  for (FarViewer& viewer : looking) {
    out.worst_p99_ms = std::max(out.worst_p99_ms, viewer.take_ages().percentile_us(0.99) / 1e3);
  }
  scene.volume.hold_still();
  const std::uint64_t hash = scene.volume.density_hash();
  for (const FarViewer& viewer : looking) {
    if (viewer.equals_within(hash, kStillPatience)) ++out.equal;
  }
  return out;
}

}  // namespace kerf::two_machines
