// SPDX-License-Identifier: Apache-2.0
#include "hil/program/program.hpp"

#include <ostream>
#include <string>

#include "hil/devmodel/bus_cycle.hpp"
#include "hil/front/hello_link.hpp"
#include "hil/front/seqpacket_server.hpp"
#include "hil/front/serving.hpp"
#include "hil/front/udp_server.hpp"
#include "hil/hil_error.hpp"
#include "hil/program/bus_service.hpp"
#include "hil/program/emulated_device.hpp"
#include "hil/program/emulator_options.hpp"
#include "hil/program/run_report.hpp"
#include "shared/posix/failure.hpp"
#include "shared/text/command_line.hpp"
#include "shared/text/words.hpp"

namespace kerf {
namespace {

void describe(const EmulatorOptions& o, std::ostream& out) {
  const auto scale = make_device(o, {})->params().torque_scale();
  out << "torque_scale=" << scale[0] << ',' << scale[1] << ',' << scale[2] << '\n';
}

Hello hello_of(const EmulatorOptions& o) {
  return {o.personality, o.lockstep, o.lockstep ? o.rate_hz : kCyclesPerSecond / o.packet_cycles};
}

/// Serves the clients of a port that is open already. One that wants another device is refused.
template <class Server>
void serve_clients(const EmulatorOptions& o, Server& server, const std::string& place,
                   EmulatedDevice& device, FrontStats& stats, const ServeLimits& limits,
                   std::ostream& out, std::ostream& err) {
  out << "kerf-emulator: " << o.device << " at " << escaped(place) << std::endl;
  do {
    auto client = server.accept(limits.stop, limits.left_ns(stats.cycles));
    if (!client) break;
    device.renew();
    HelloLink link(*client, hello_of(o));
    if (o.lockstep) {
      const bool speaks_first = o.personality == Personality::omni;
      serve_lockstep(link, device,
                     {.tick_cycles = kCyclesPerSecond / o.rate_hz,
                      .says_nothing_came = !o.fault.empty(),
                      .speaks_first = speaks_first},
                     limits, stats);
    } else {
      serve_real_time(link, device, o.packet_cycles, limits, stats);
    }
    if (link.refusal().empty()) continue;
    if (!o.stay) throw HilError(place + ": " + link.refusal());
    err << "kerf-emulator: " << place << ": " << link.refusal() << std::endl;
  } while (o.stay && !limits.reached(stats.cycles));
}

FtdiFalcon::Settings falcon_settings(const EmulatorOptions& o) {
  return {.firmware_runs = o.bus.firmware_runs};
}

WoodenHid::Settings wooden_settings(const EmulatorOptions& o) {
  return {.packet_bytes = o.packet_bytes, .script = usb_script(o.bus)};
}

void serve_on_fuse(const EmulatorOptions& o, BusService& service) {
  switch (o.personality) {
    case Personality::omni:
      return serve_fuse(service, o.bus.mount, firewire_settings(o.bus, o.lockstep ? o.rate_hz : 0));
    case Personality::falcon:
      return serve_fuse(service, o.bus.mount, falcon_settings(o), usb_script(o.bus));
    case Personality::woodenhaptics:
      return serve_fuse(service, o.bus.mount, wooden_settings(o));
  }
}

void serve(const EmulatorOptions& o, const std::atomic<bool>& stop, std::ostream& out,
           std::ostream& err) {
  check_report(o);
  EmulatedDevice device(o);
  if (!o.lockstep) {
    const std::string missing = make_real_time(o.priority, o.cpu);
    if (!missing.empty()) err << "kerf-emulator: warning: " << missing << std::endl;
  }
  const ServeLimits limits{cycles_of(o.seconds), stop};
  FrontStats stats;
  BusService bus{device, limits, o.stay, stats, out};
  if (o.front == "fuse") {
    serve_on_fuse(o, bus);
  } else if (o.front == "usbip") {
    serve_usbip(bus, falcon_settings(o), usb_script(o.bus));
  } else if (o.front == "uhid") {
    serve_uhid(bus, wooden_settings(o));
  } else if (o.front == "udp") {
    UdpServer server(o.udp);
    const std::string place = "udp port " + std::to_string(server.port());
    serve_clients(o, server, place, device, stats, limits, out, err);
  } else {
    SeqpacketServer server(o.socket);
    serve_clients(o, server, o.socket, device, stats, limits, out, err);
  }
  if (!o.report.empty()) write_run_report(o.report, device, stats);
}

}  // namespace

int run_emulator(int argc, const char* const* argv, const std::atomic<bool>& stop,
                 std::ostream& out, std::ostream& err) {
  EmulatorOptions options;
  try {
    CommandLine app("Is the haptic device: wire bytes, mechanics, hand and faults.",
                    "kerf-emulator", "kerf-emulator " KERF_VERSION);
    declare(app, options);
    if (!app.parse(argc, argv, out)) return 0;
    check(options);
    if (options.describe) {
      describe(options, out);
    } else {
      serve(options, stop, out, err);
    }
    return 0;
  } catch (...) {
    err << "kerf-emulator: " << failure_text() << '\n';
    return 2;
  }
}

}  // namespace kerf
