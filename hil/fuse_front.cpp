// SPDX-License-Identifier: Apache-2.0
#include "hil/fuse_front.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <ostream>
#include <string_view>
#include <utility>

#include <CLI/CLI.hpp>

#include "hil/front/firewire/firewire_node.hpp"
#include "hil/front/fuse/fuse_mount.hpp"
#include "hil/front/usb/usbfs_node.hpp"
#include "hil/hil_error.hpp"

namespace kerf {
namespace {

template <class Fault>
struct FaultWord {
  std::string_view word;
  Fault fault;
};
constexpr FaultWord<BusFault> kBusFaultWords[] = {
    {"reset", BusFault::reset}, {"device-reset", BusFault::device_reset},
    {"steal", BusFault::steal}, {"vanish", BusFault::vanish},
    {"back", BusFault::back},
};
constexpr FaultWord<UsbFault> kUsbFaultWords[] = {
    {"stall", UsbFault::stall},
    {"split", UsbFault::split},
    {"vanish", UsbFault::vanish},
    {"back", UsbFault::back},
};

/// SECONDS:KIND with one of the bus's words; the cycle, and which word it is.
template <class Fault, std::size_t N>
std::pair<std::int64_t, Fault> parse_fault(const std::string& text,
                                           const FaultWord<Fault> (&words)[N]) {
  const std::size_t colon = text.find(':');
  double seconds = 0;
  const bool timed = colon != std::string::npos &&
                     CLI::detail::lexical_cast(text.substr(0, colon), seconds) && seconds >= 0 &&
                     seconds < 1e6;
  const std::string word = timed ? text.substr(colon + 1) : "";
  const auto* found = std::ranges::find(words, word, &FaultWord<Fault>::word);
  if (found != std::end(words)) {
    return {std::llround(seconds * static_cast<double>(kBusCyclesPerSecond)), found->fault};
  }
  std::string known;
  for (const auto& one : words) known += (known.empty() ? "" : ", ") + std::string(one.word);
  throw HilError("--bus-fault: " + text + " is not SECONDS:KIND with one of " + known);
}

/// Serves `node` under `name`; `cycles()` since the begin.
template <class Node, class Cycles>
void serve_node(const FuseService& service, const char* device, const std::string& name, Node& node,
                Cycles cycles) {
  FuseMount folder(service.mount);
  folder.add(name, node);
  service.out << "kerf-emulator: " << device << " at " << service.mount << '/' << name << std::endl;
  folder.serve([&] {
    service.stats.cycles = cycles();
    return !service.limits.stop.load(std::memory_order_relaxed) && (service.stay || !node.left()) &&
           (service.limits.cycles == 0 || service.stats.cycles < service.limits.cycles);
  });
  service.stats.wake = folder.lateness();
}

}  // namespace

void declare_fuse(CLI::App& app, FuseFrontOptions& o) {
  app.add_option("--mount", o.mount,
                 "front fuse: folder in which the node appears: fw1, usb or hidraw0");
  app.add_option("--packet-hz", o.packet_hz, "front fuse: packets of the omni, 8000 or 1000")
      ->check(CLI::IsMember({8000, 1000}))
      ->capture_default_str();
  app.add_option("--drift-ppm", o.drift_ppm, "front fuse: how much slower the omni's bus runs")
      ->check(CLI::Range(-1000.0, 1000.0));
  app.add_flag("--reset-stops-stream", o.reset_stops_stream,
               "front fuse: in a bus reset the omni forgets its channels and stops");
  app.add_flag("--firmware-runs", o.firmware_runs,
               "front fuse: the falcon was started before (default: it waits for its firmware)");
  app.add_option("--bus-fault", o.bus_faults,
                 "front fuse: SECONDS:KIND, repeatable; vanish, back; omni: reset, device-reset, "
                 "steal; falcon: stall, split");
}

FirewireSettings firewire_settings(const FuseFrontOptions& o, int lockstep_hz) {
  FirewireSettings settings;
  settings.clock = lockstep_hz > 0 ? BusClock::lock_step() : BusClock::real_time(o.drift_ppm);
  if (lockstep_hz > 0) {
    settings.lockstep_cycles = static_cast<int>(kBusCyclesPerSecond) / lockstep_hz;
  }
  settings.packet_cycles = static_cast<int>(kBusCyclesPerSecond) / o.packet_hz;
  settings.reset_stops_stream = o.reset_stops_stream;
  for (const std::string& text : o.bus_faults) {
    const auto [cycle, fault] = parse_fault(text, kBusFaultWords);
    settings.script.push_back({cycle, fault});
  }
  return settings;
}

std::vector<ScriptedUsbFault> usb_script(const FuseFrontOptions& o) {
  std::vector<ScriptedUsbFault> script;
  for (const std::string& text : o.bus_faults) {
    const auto [cycle, fault] = parse_fault(text, kUsbFaultWords);
    script.push_back({cycle, fault});
  }
  std::ranges::stable_sort(script, {}, &ScriptedUsbFault::cycle);
  return script;
}

void serve_fuse(const FuseService& service, const FirewireSettings& omni) {
  FirewireNode node(omni, service.device);
  serve_node(service, "omni", "fw1", node, [&] { return node.bus().cycle() - kFirstCycle; });
  service.stats.sent = node.bus().stats().reports;
  service.stats.dropped = node.bus().stats().unheard;
}

void serve_fuse(const FuseService& service, const FtdiFalcon::Settings& falcon,
                std::vector<ScriptedUsbFault> script) {
  UsbfsNode node(falcon, std::move(script), service.device);
  serve_node(service, "falcon", "usb", node, [&] { return node.chip().time().cycle(); });
  service.stats.sent = node.chip().reports();
  service.stats.dropped = node.chip().lost();
}

void serve_fuse(const FuseService& service, const HidrawNode::Settings& wooden) {
  HidrawNode node(wooden, service.device);
  serve_node(service, "woodenhaptics", "hidraw0", node, [&] { return node.time().cycle(); });
  service.stats.sent = node.reports();
  service.stats.dropped = node.lost();
}

}  // namespace kerf
