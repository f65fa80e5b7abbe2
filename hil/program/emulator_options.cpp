// SPDX-License-Identifier: Apache-2.0
#include "hil/program/emulator_options.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <ranges>
#include <string_view>
#include <utility>

#include "hil/device/packet_device.hpp"
#include "hil/hil_error.hpp"
#include "shared/text/text.hpp"
#include "shared/wire/woodenhaptics.hpp"

namespace kerf {
namespace {

constexpr double kMaxSeconds = 1e6;

void declare_front(Arguments& app, EmulatorOptions& o) {
  app.option("--front", o.front,
             "how it is reached: socket; udp; websocket (inverse3), as its vendor's service; fuse, "
             "a device node; usbip (falcon) or uhid (woodenhaptics), in this kernel's own USB or "
             "HID stack, as root")
      .shows_default();
  app.option("--socket", o.socket, "front socket: path of the SEQPACKET socket to serve");
  app.option("--udp", o.udp, "front udp: [ADDRESS:]PORT to serve (address: 127.0.0.1)");
  declare_service(app, o.service);
  declare_bus(app, o.bus);
  app.flag("--lockstep", o.lockstep, "no clock: one servo period per command received");
  app.option("--rate", o.rate_hz, "servo rate for --lockstep, Hz; must divide 8000 (USB: 1000)")
      .shows_default();
  app.option("--packet-cycles", o.packet_cycles,
             "fronts socket, udp, in real time: bus cycles of 125 us from one look at the host "
             "to the next")
      .within(1, 800)
      .shows_default();
  app.option("--priority", o.priority, "SCHED_FIFO priority; 0 = none")
      .within(0, 99)
      .shows_default();
  app.option("--cpu", o.cpu, "core to run on (default: the last)").within(0, 1023);
  app.flag("--stay", o.stay, "wait for another client when one leaves");
  app.option("--seconds", o.seconds,
             "device time to serve, and the longest wait for a client (default: no limit)")
      .within(0.001, kMaxSeconds);
  app.option("--linger", o.linger,
             "fronts socket, udp: device time that goes on once a client has left, without a host")
      .within(0, 60);
}

void declare_device(Arguments& app, EmulatorOptions& o) {
  for (std::size_t i = 0; i < o.plant.size(); ++i) {
    const PlantKey& row = kPlantKeys[i];
    app.option(row.option, o.plant[i], row.meaning).within(row.low, row.high);
  }
  app.flag("--drop-torque", o.drop_torque,
           "motors let go when the host is silent for 0.1 s (default: hold; woodenhaptics: after "
           "0.5 s)");
  app.option("--silence-ms", o.silence_ms, "host silence after which --drop-torque acts")
      .within(1, 10'000)
      .shows_default();
  app.flag("--pot-noise", o.pot_noise, "omni: noise in the low bits of the gimbal pots");
  app.option("--packet-bytes", o.packet_bytes,
             "woodenhaptics: 14 (mbed) or, fronts fuse, uhid, 64 (Teensy)")
      .shows_default();
  app.flag("--wireless-button", o.wireless_button,
           "woodenhaptics: the hand's first button shows on encoder d");
  app.option("--seed", o.seed, "of the noise").shows_default();
}

/// Which of the known words `value` is.
template <std::size_t N>
std::size_t known_at(const char* option, const std::string& value,
                     const std::array<std::string_view, N>& known) {
  const auto* const found = std::ranges::find(known, value);
  if (found != known.end()) return static_cast<std::size_t>(found - known.begin());
  throw HilError(std::string(option) + ": " + value + unknown_word(value, known));
}

/// Of the front's bus, and of lock-step on it.
void check_rate(const EmulatorOptions& o) {
  const bool streams = kind_of(o.personality).streams;
  const bool is_usb = o.front == "usbip" || o.front == "uhid" || (o.front == "fuse" && !streams);
  if (is_usb && o.lockstep) {
    throw HilError("--lockstep: the USB front runs by its own clock; use --front socket");
  }
  const int fastest = streams ? kCyclesPerSecond : kUsbFramesPerSecond;
  if (o.rate_hz < 1 || fastest % o.rate_hz != 0) {
    throw HilError("--rate: " + std::to_string(o.rate_hz) + " does not divide " +
                   std::to_string(fastest) + ", the rate of the bus; use such as 500 or 1000");
  }
  if (!o.lockstep && o.rate_hz != EmulatorOptions{}.rate_hz) {
    throw HilError(
        "--rate: the device runs by its own clock; give --lockstep too, or leave it out");
  }
  if (o.lockstep && o.packet_cycles != EmulatorOptions{}.packet_cycles) {
    throw HilError("--packet-cycles: lock-step looks at the host once a tick; leave it out");
  }
  if (o.lockstep && !o.fault.empty() && (o.front == "fuse" || o.front == "websocket")) {
    throw HilError("--fault: in lock-step a " +
                   std::string(o.front == "fuse" ? "node" : "service") +
                   " has no way to say that nothing came; use --front socket or udp");
  }
}

void check_front(const EmulatorOptions& o) {
  constexpr std::array<std::string_view, 6> kFronts{"socket", "udp",   "websocket",
                                                    "fuse",   "usbip", "uhid"};
  known_at("--front", o.front, kFronts);
  if (o.front == "socket" && o.socket.empty()) {
    throw HilError("--socket: no path; say where the socket shall be, or use --front udp");
  }
  if (o.front == "udp" && o.udp.empty()) {
    throw HilError("--udp: no port; say [ADDRESS:]PORT, or use --front socket");
  }
  if (o.front == "websocket" && o.service.where.empty()) {
    throw HilError("--ws: no port; say [ADDRESS:]PORT, or use --front socket");
  }
  if (o.front == "fuse" && o.bus.mount.empty()) {
    throw HilError("--mount: missing; name an empty folder for --front fuse");
  }
  const auto only_on = [&](std::initializer_list<std::string_view> fronts, const char* option,
                           bool given) {
    if (!given || std::ranges::find(fronts, o.front) != fronts.end()) return;
    throw HilError(std::string(option) + ": front " + o.front +
                   " has no such thing; leave it out, or use --front " + listed(fronts));
  };
  only_on({"socket"}, "--socket", !o.socket.empty());
  only_on({"udp"}, "--udp", !o.udp.empty());
  only_on({"socket", "udp"}, "--packet-cycles", o.packet_cycles != EmulatorOptions{}.packet_cycles);
  // Nobody fills up a short packet there, as a HID host does.
  only_on({"fuse", "uhid"}, "--packet-bytes", o.packet_bytes != wooden::kPacketBytes);
  only_on({"fuse", "usbip", "uhid", "websocket"}, "--bus-fault", !o.bus.faults.empty());
  only_on({"websocket"}, "--ws", !o.service.where.empty());
  only_on({"websocket"}, "--ws-events", !o.service.event_port.empty());
  only_on({"websocket"}, "--profile", o.service.profile != ServiceOptions{}.profile);
  only_on({"fuse", "usbip"}, "--firmware-runs", o.bus.firmware_runs);
  only_on({"fuse"}, "--mount", !o.bus.mount.empty());
  only_on({"fuse"}, "--packet-hz", o.bus.packet_hz != BusOptions{}.packet_hz);
  only_on({"fuse"}, "--drift-ppm", o.bus.drift_ppm != 0);
  only_on({"fuse"}, "--reset-stops-stream", o.bus.reset_stops_stream);
  const auto speaks_for = [&](const char* front, Personality device) {
    if (o.front == front && o.personality != device) {
      throw HilError(std::string("--front ") + front + ": not for " + o.device +
                     "; use --personality " + std::string(word_of(device)) + ", or another front");
    }
  };
  speaks_for("usbip", Personality::falcon);
  speaks_for("uhid", Personality::woodenhaptics);
  speaks_for("websocket", Personality::inverse3);
  if (is_cartesian(o.personality) && o.front == "fuse") {
    throw HilError("--front fuse: the bytes of " + o.device +
                   " are its vendor's secret; use --front socket or udp");
  }
  check_rate(o);
}

void check_device(const EmulatorOptions& o) {
  const auto belongs_to = [&](bool given, const char* option, Personality owner) {
    if (given && o.personality != owner) {
      throw HilError(std::string(option) + ": " + o.device +
                     " has no such thing; leave it out, or use --personality " +
                     std::string(word_of(owner)));
    }
  };
  belongs_to(o.pot_noise, "--pot-noise", Personality::omni);
  belongs_to(o.bus.firmware_runs, "--firmware-runs", Personality::falcon);
  belongs_to(o.wireless_button, "--wireless-button", Personality::woodenhaptics);
  belongs_to(o.packet_bytes != wooden::kPacketBytes, "--packet-bytes", Personality::woodenhaptics);
  if (o.packet_bytes != wooden::kPacketBytes && o.packet_bytes != wooden::kLongPacketBytes) {
    throw HilError("--packet-bytes: " + std::to_string(o.packet_bytes) +
                   " is no firmware's length; use 14 or 64");
  }
  if (o.silence_ms != EmulatorOptions{}.silence_ms && !o.drop_torque) {
    throw HilError(
        "--silence-ms: the motors keep their force for ever; give --drop-torque too, or leave it "
        "out");
  }
  if (o.drop_torque && kind_of(o.personality).has_watchdog) {
    throw HilError("--drop-torque: " + o.device +
                   " switches its motors off by itself; leave it out");
  }
  for (std::size_t i = 0; i < o.plant.size(); ++i) {
    const PlantKey& row = kPlantKeys[i];
    const double value = o.plant[i].value_or(0);
    if (!row.whole || value == std::floor(value)) continue;
    throw HilError(std::string(row.option) + ": " + number_text(value) +
                   " is not whole; give a number of bus cycles");
  }
}

template <class Fault>
struct FaultWord {
  std::string_view word;
  Fault fault;
};
constexpr std::array<FaultWord<BusFault>, 5> kBusFaultWords{{
    {"reset", BusFault::reset},
    {"device-reset", BusFault::device_reset},
    {"steal", BusFault::steal},
    {"vanish", BusFault::vanish},
    {"back", BusFault::back},
}};
constexpr std::array<FaultWord<UsbFault>, 5> kUsbFaultWords{{
    {"stall", UsbFault::stall},
    {"split", UsbFault::split},
    {"deaf", UsbFault::nak},
    {"vanish", UsbFault::vanish},
    {"back", UsbFault::back},
}};

/// SECONDS:KIND with one of the bus's words; the cycle, and which word it is.
template <class Fault, std::size_t N>
std::pair<std::int64_t, Fault> parse_fault(const std::string& text,
                                           const std::array<FaultWord<Fault>, N>& words) {
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

/// The words of `ServiceFault`, in its order.
constexpr auto service_fault_words() {
  std::array<FaultWord<ServiceFault>, kServiceFaultWords.size()> words{};
  for (std::size_t i = 0; i < words.size(); ++i) {
    words[i] = {kServiceFaultWords[i], static_cast<ServiceFault>(i)};
  }
  return words;
}
constexpr auto kServiceFaults = service_fault_words();

}  // namespace

void declare(Arguments& app, EmulatorOptions& o) {
  app.option("--personality", o.device,
             "which device to be: omni, falcon, woodenhaptics, inverse3, touch, omega")
      .shows_default();
  app.flag("--describe", o.describe,
           "print the settings that a host needs for this unit (torque_scale), and end");
  app.option("--hand", o.hand, "hand script (TOML); none: the arm stays in its rest pose");
  app.option("--hand-socket", o.hand_socket,
             "path of a socket at which a window (kerf-visualizer --hand-socket) leads the hand, "
             "in place of a script");
  app.option("--fault", o.fault, "fault script (TOML), for example hil/faults/late_reports.toml");
  app.option("--identified", o.identified,
             "device.toml of kerf identify: its mean mass and friction, and its delay, in place of "
             "those of the hand script and of the device");
  app.option("--unit-mm", o.unit_mm,
             "device mm per unit of a hand script without unit_mm (default: 1)")
      .within(1e-3, 100.0);
  declare_front(app, o);
  declare_device(app, o);
  app.option("--report", o.report, "write what was seen as JSON");
}

void check(EmulatorOptions& o) {
  o.personality = static_cast<Personality>(known_at("--personality", o.device, kPersonalityWords));
  check_device(o);
  if (!o.hand_socket.empty() && !o.hand.empty()) {
    throw HilError("--hand-socket: the hand of --hand goes its own way; give one of the two");
  }
  if (!o.hand_socket.empty() && o.hand_socket == o.socket) {
    throw HilError("--hand-socket: " + o.hand_socket + " is --socket's; name another path");
  }
  if (!o.hand_socket.empty() && o.lockstep) {
    throw HilError("--hand-socket: a user has no lock-step; leave out --lockstep");
  }
  if (!o.describe) check_front(o);
}

void declare_bus(Arguments& app, BusOptions& o) {
  app.option(
      "--mount", o.mount,
      "front fuse: folder in which the node appears: fw1 (beside the host's, fw0), usb or hidraw0");
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
             "fronts fuse, usbip, uhid, websocket: SECONDS:KIND, repeatable; vanish, back; omni: "
             "reset, device-reset, steal; falcon: stall, split; falcon and woodenhaptics on fuse: "
             "deaf; inverse3: malformed, close, reset, half_open, restart, other_id, second_arm, "
             "power_off, power_on, grip_sleep, grip_wake, second_client, reconfigure, event");
}

void declare_service(Arguments& app, ServiceOptions& o) {
  app.option("--ws", o.where,
             "front websocket: [ADDRESS:]PORT to serve (address: 127.0.0.1; port 0: any free one, "
             "which is printed)");
  app.option("--ws-events", o.event_port,
             "front websocket: port of the service's events at that address (default: none)");
  app.option("--profile", o.profile,
             "front websocket: version and handles of the service: 3.4, a wired one; 3.5, both; "
             "3.5-wireless; 3.0, which kerf refuses")
      .shows_default();
}

ServiceSettings service_settings(const ServiceOptions& o, const std::vector<std::string>& faults,
                                 int lockstep_hz) {
  ServiceSettings settings;
  settings.profile =
      static_cast<ServiceProfile>(known_at("--profile", o.profile, kServiceProfileWords));
  settings.lockstep = lockstep_hz > 0;
  if (settings.lockstep) settings.rate_hz = lockstep_hz;
  for (const std::string& text : faults) {
    const auto [cycle, fault] = parse_fault(text, kServiceFaults);
    settings.script.push_back({cycle, fault});
  }
  return settings;
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
