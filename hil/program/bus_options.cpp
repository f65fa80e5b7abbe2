// SPDX-License-Identifier: Apache-2.0
#include "hil/program/bus_options.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <ranges>
#include <string_view>
#include <utility>

#include "hil/hil_error.hpp"
#include "shared/text/number.hpp"
#include "shared/text/words.hpp"

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
    {"stall", UsbFault::stall},   {"split", UsbFault::split}, {"deaf", UsbFault::deaf},
    {"vanish", UsbFault::vanish}, {"back", UsbFault::back},
};

/// SECONDS:KIND with one of the bus's words; the cycle, and which word it is.
template <class Fault, std::size_t N>
std::pair<std::int64_t, Fault> parse_fault(const std::string& text,
                                           const FaultWord<Fault> (&words)[N]) {
  const std::size_t colon = text.find(':');
  const auto seconds = number_in(std::string_view(text).substr(0, colon));
  const bool timed = colon != std::string::npos && seconds && *seconds >= 0 && *seconds < 1e6;
  const std::string word = timed ? text.substr(colon + 1) : "";
  const auto* found = std::ranges::find(words, word, &FaultWord<Fault>::word);
  if (found != std::end(words)) {
    return {std::llround(*seconds * static_cast<double>(kBusCyclesPerSecond)), found->fault};
  }
  throw HilError("--bus-fault: " + text + " is not SECONDS:KIND with one of " +
                 listed(words | std::views::transform(&FaultWord<Fault>::word)));
}

}  // namespace

void declare_bus(Arguments& app, BusOptions& o) {
  app.option("--mount", o.mount,
             "front fuse: folder in which the node appears: fw1, usb or hidraw0");
  app.option("--packet-hz", o.packet_hz, "front fuse: packets of the omni, 8000 or 1000")
      .one_of({"8000", "1000"})
      .shows_default();
  app.option("--drift-ppm", o.drift_ppm, "front fuse: how much slower the omni's bus runs")
      .within(-1000, 1000);
  app.flag("--reset-stops-stream", o.reset_stops_stream,
           "front fuse: in a bus reset the omni forgets its channels and stops");
  app.flag("--firmware-runs", o.firmware_runs,
           "fronts fuse, usbip: the falcon was started before (default: it waits for its "
           "firmware)");
  app.option("--bus-fault", o.faults,
             "fronts fuse, usbip, uhid: SECONDS:KIND, repeatable; vanish, back; omni: reset, "
             "device-reset, steal; falcon: stall, split; falcon and woodenhaptics on fuse: deaf");
}

FirewireSettings firewire_settings(const BusOptions& o, int lockstep_hz) {
  FirewireSettings settings;
  settings.clock = lockstep_hz > 0 ? BusClock::lock_step() : BusClock::real_time(o.drift_ppm);
  if (lockstep_hz > 0) {
    settings.lockstep_cycles = static_cast<int>(kBusCyclesPerSecond) / lockstep_hz;
  }
  settings.packet_cycles = static_cast<int>(kBusCyclesPerSecond) / o.packet_hz;
  settings.reset_stops_stream = o.reset_stops_stream;
  for (const std::string& text : o.faults) {
    const auto [cycle, fault] = parse_fault(text, kBusFaultWords);
    settings.script.push_back({cycle, fault});
  }
  return settings;
}

std::vector<ScriptedUsbFault> usb_script(const BusOptions& o) {
  std::vector<ScriptedUsbFault> script;
  for (const std::string& text : o.faults) {
    const auto [cycle, fault] = parse_fault(text, kUsbFaultWords);
    script.push_back({cycle, fault});
  }
  std::ranges::stable_sort(script, {}, &ScriptedUsbFault::cycle);
  return script;
}

}  // namespace kerf
