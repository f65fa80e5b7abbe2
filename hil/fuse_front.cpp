// SPDX-License-Identifier: Apache-2.0
#include "hil/fuse_front.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <ostream>
#include <string_view>

#include <CLI/CLI.hpp>

#include "hil/front/firewire/firewire_node.hpp"
#include "hil/front/fuse/fuse_mount.hpp"
#include "hil/hil_error.hpp"

namespace kerf {
namespace {

struct FaultWord {
  std::string_view word;
  BusFault fault;
};
constexpr FaultWord kFaultWords[] = {
    {"reset", BusFault::reset}, {"device-reset", BusFault::device_reset},
    {"steal", BusFault::steal}, {"vanish", BusFault::vanish},
    {"back", BusFault::back},
};

ScriptedFault parse_fault(const std::string& text) {
  const std::size_t colon = text.find(':');
  double seconds = 0;
  const bool timed = colon != std::string::npos &&
                     CLI::detail::lexical_cast(text.substr(0, colon), seconds) && seconds >= 0 &&
                     seconds < 1e6;
  const std::string word = timed ? text.substr(colon + 1) : "";
  const auto* found = std::ranges::find(kFaultWords, word, &FaultWord::word);
  if (found == std::end(kFaultWords)) {
    throw HilError("--bus-fault: " + text +
                   " is not SECONDS:KIND with reset, device-reset, steal, vanish or back");
  }
  return {std::llround(seconds * static_cast<double>(kBusCyclesPerSecond)), found->fault};
}

}  // namespace

void declare_fuse(CLI::App& app, FuseFrontOptions& o) {
  app.add_option("--mount", o.mount, "front fuse: folder in which the node fw1 appears");
  app.add_option("--packet-hz", o.packet_hz, "front fuse: packets of the device, 8000 or 1000")
      ->check(CLI::IsMember({8000, 1000}))
      ->capture_default_str();
  app.add_option("--drift-ppm", o.drift_ppm, "front fuse: how much slower the bus's clock runs")
      ->check(CLI::Range(-1000.0, 1000.0));
  app.add_flag("--reset-stops-stream", o.reset_stops_stream,
               "front fuse: in a bus reset the device forgets its channels and stops");
  app.add_option(
      "--bus-fault", o.bus_faults,
      "front fuse: SECONDS:KIND, reset, device-reset, steal, vanish or back; repeatable");
}

FirewireSettings firewire_settings(const FuseFrontOptions& o, int lockstep_hz) {
  if (o.mount.empty()) throw HilError("--mount: missing; name an empty folder for --front fuse");
  FirewireSettings settings;
  settings.clock = lockstep_hz > 0 ? BusClock::lock_step() : BusClock::real_time(o.drift_ppm);
  if (lockstep_hz > 0) {
    settings.lockstep_cycles = static_cast<int>(kBusCyclesPerSecond) / lockstep_hz;
  }
  settings.packet_cycles = static_cast<int>(kBusCyclesPerSecond) / o.packet_hz;
  settings.reset_stops_stream = o.reset_stops_stream;
  for (const std::string& fault : o.bus_faults) settings.script.push_back(parse_fault(fault));
  return settings;
}

void serve_fuse(const std::string& mount, const FirewireSettings& settings, PacketDevice& device,
                const ServeLimits& limits, bool stay, FrontStats& stats, std::ostream& out) {
  FirewireNode node(settings, device);
  FuseMount folder(mount);
  folder.add("fw1", node);
  out << "kerf-emulator: omni at " << mount << "/fw1" << std::endl;
  folder.serve([&] {
    stats.cycles = node.bus().cycle() - kFirstCycle;
    return !limits.stop.load(std::memory_order_relaxed) && (stay || !node.left()) &&
           (limits.cycles == 0 || stats.cycles < limits.cycles);
  });
  stats.sent = node.bus().stats().reports;
  stats.dropped = node.bus().stats().unheard;
  stats.wake = folder.lateness();
}

}  // namespace kerf
