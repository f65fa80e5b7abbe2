// SPDX-License-Identifier: Apache-2.0
#include "hil/program/program.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <ostream>
#include <string>

#include "hil/devmodel/emulator.hpp"
#include "hil/devmodel/falcon_model.hpp"
#include "hil/devmodel/omni_model.hpp"
#include "hil/devmodel/wooden_model.hpp"
#include "hil/fault/faulty_device.hpp"
#include "hil/front/seqpacket_server.hpp"
#include "hil/front/serving.hpp"
#include "hil/front/udp_server.hpp"
#include "hil/hil_error.hpp"
#include "hil/program/bus_service.hpp"
#include "hil/program/emulator_options.hpp"
#include "hil/program/run_report.hpp"
#include "hil/script/fault_script.hpp"
#include "hil/script/hand_script_file.hpp"
#include "shared/posix/failure.hpp"
#include "shared/text/command_line.hpp"

namespace kerf {
namespace {

/// What any device takes from the command line.
template <class Params>
Params plant_of(const EmulatorOptions& o) {
  Params params;
  params.joint_inertia_kg_m2.fill(o.joint_inertia_kg_m2);
  params.mode_hz = o.mode_hz;
  if (o.drop_torque) params.on_silence = OnSilence::drop_torque;
  return params;
}

std::unique_ptr<DeviceModel> make_device(const EmulatorOptions& o) {
  switch (o.personality) {
    case Personality::falcon:
      return std::make_unique<FalconModel>(plant_of<FalconParams>(o));
    case Personality::woodenhaptics: {
      auto params = plant_of<WoodenParams>(o);
      params.packet_bytes = o.packet_bytes;
      params.wireless_button = o.wireless_button;
      return std::make_unique<WoodenModel>(params);
    }
    case Personality::omni:
      break;
  }
  auto params = plant_of<OmniParams>(o);
  params.pot_noise = o.pot_noise;
  params.seed = o.seed;
  return std::make_unique<OmniModel>(params);
}

void describe(const EmulatorOptions& o, std::ostream& out) {
  const auto scale = make_device(o)->params().torque_scale();
  out << "torque_scale=" << scale[0] << ',' << scale[1] << ',' << scale[2] << '\n';
}

Emulator make_emulator(const EmulatorOptions& o) {
  std::optional<HandScript> script;
  if (!o.hand.empty()) {
    script = read_hand_script(o.hand);
    if (o.unit_mm) script->unit_mm = *o.unit_mm;
  }
  return Emulator(make_device(o), script);
}

/// Faults of a device; one of its host can only be played where both are in one program.
FaultScript faults_of(const EmulatorOptions& o) {
  if (o.fault.empty()) return {};
  FaultScript script = read_fault_script(o.fault);
  if (std::ranges::count(script.faults, FaultKind::host_late, &DeviceFault::kind) > 0) {
    throw HilError(o.fault + ": host_late: no device can hold up its host; use ./kerf lab faults " +
                   "--scripts " + o.fault + ", or stop the controller (kill -STOP)");
  }
  return script;
}

/// Serves the clients of a port that is open already.
template <class Server>
void serve_clients(const EmulatorOptions& o, Server& server, const std::string& place,
                   PacketDevice& device, FrontStats& stats, const ServeLimits& limits,
                   std::ostream& out) {
  out << "kerf-emulator: " << o.device << " at " << place << std::endl;
  do {
    auto client = server.accept(limits.stop, limits.left_ns(stats.cycles));
    if (!client) break;
    if (o.lockstep) {
      serve_lockstep(*client, device, kCyclesPerSecond / o.rate_hz, limits, stats);
    } else {
      serve_real_time(*client, device, o.packet_cycles, limits, stats);
    }
  } while (o.stay && !limits.reached(stats.cycles));
}

FtdiFalcon::Settings falcon_settings(const EmulatorOptions& o) {
  return {.firmware_runs = o.bus.firmware_runs};
}

WoodenHid::Settings wooden_settings(const EmulatorOptions& o) {
  return {.packet_bytes = o.packet_bytes, .script = usb_script(o.bus)};
}

void serve_on_fuse(const EmulatorOptions& o, const BusService& service) {
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
  if (!o.report.empty()) check_report(o.report);
  Emulator emulator = make_emulator(o);
  FaultyDevice device(emulator, faults_of(o));
  if (!o.lockstep) {
    const std::string missing = make_real_time(o.priority, o.cpu);
    if (!missing.empty()) err << "kerf-emulator: warning: " << missing << std::endl;
  }
  const ServeLimits limits{cycles_of(o.seconds), stop};
  FrontStats stats;
  const BusService bus{device, limits, o.stay, stats, out};
  if (o.front == "fuse") {
    serve_on_fuse(o, bus);
  } else if (o.front == "usbip") {
    serve_usbip(bus, falcon_settings(o), usb_script(o.bus));
  } else if (o.front == "uhid") {
    serve_uhid(bus, wooden_settings(o));
  } else if (o.front == "udp") {
    UdpServer server(o.udp);
    const std::string place = "udp port " + std::to_string(server.port());
    serve_clients(o, server, place, device, stats, limits, out);
  } else {
    SeqpacketServer server(o.socket);
    serve_clients(o, server, o.socket, device, stats, limits, out);
  }
  if (!o.report.empty()) write_run_report(o.report, emulator, device.withheld(), stats);
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
