// SPDX-License-Identifier: Apache-2.0

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <ostream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "hil/device/packet_device.hpp"
#include "hil/front/firewire/firewire_bus.hpp"
#include "hil/front/firewire/firewire_node.hpp"
#include "hil/front/fuse/fuse_mount.hpp"
#ifdef KERF_HAS_WS
#include "hil/front/inverse3/service_front.hpp"
#endif
#include "hil/front/serving.hpp"
#include "hil/front/socket_servers.hpp"
#include "hil/front/usb/falcon_usb.hpp"
#include "hil/front/usb/hidraw_node.hpp"
#include "hil/front/usb/usb_device.hpp"
#include "hil/front/usb/usbfs_node.hpp"
#include "hil/front/usb/usbip_falcon.hpp"
#include "hil/front/usb/wooden_hid.hpp"
#include "hil/hil_error.hpp"
#include "hil/program/emulated_device.hpp"
#include "hil/program/emulator_options.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/posix/error_text.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "shared/text/command_line.hpp"
#include "shared/text/json.hpp"
#include "shared/text/text.hpp"

namespace kerf {

namespace {

double seconds_of(std::int64_t cycles) {
  return static_cast<double>(cycles) / kCyclesPerSecond;
}

/// The faults that have begun, one by one.
Json injected_list(const std::vector<InjectedFault>& faults) {
  Json list = Json::List{};
  for (const InjectedFault& fault : faults) {
    list.push_back({{"kind", kFaultWords[static_cast<std::size_t>(fault.kind)]},
                    {"packets", fault.of_commands ? "commands" : "reports"},
                    {"at_s", seconds_of(fault.at_cycle)},
                    {"changed", fault.changed}});
  }
  return list;
}

/// Throws FileError now if the report could not be written after the run, or would replace a file
/// that the run reads.
void check_report(const EmulatorOptions& options) {
  check_outputs({options.hand, options.fault, options.identified},
                {{"--report", options.report, ".json"}});
}

/// Writes the figures of a run as JSON: under another name first, then renamed, so the file is
/// whole or absent. Times in s from the first client on, device time. Counts are those of all
/// clients together, the device's state at the end is the last one's. Throws FileError.
void write_run_report(const std::string& file, const EmulatedDevice& device,
                      const FrontStats& front) {
  const EmulatorStats stats = device.stats();
  const DeviceModel& model = device.model();
  const DeviceVec<double> tip = model.tip_mm();
  Json report;
  report["personality"] = model.name();
  report["seconds"] = seconds_of(stats.cycles);
  report["packets_sent"] = front.sent;
  report["packets_dropped"] = front.dropped;
  report["packets_withheld"] = device.withheld();
  report["injected"] = injected_list(device.injected());
  report["commands_received"] = stats.commands;
  report["commands_refused"] = stats.refused;
  report["resyncs"] = front.resyncs;
  report["wake_us"] = {{"p50", front.wake.percentile_us(0.5)},
                       {"p99", front.wake.percentile_us(0.99)},
                       {"max", front.wake.max_us()}};
  report["peak_motor_force_n"] = stats.peak_motor_force_n;
  report["rms_motor_force_n"] =
      stats.cycles > 0 ? std::sqrt(stats.square_sum_n2 / static_cast<double>(stats.cycles)) : 0.0;
  report["motor_work_mj"] = stats.motor_work_mj;
  report["final_motor_force_n"] = norm(model.motor_force_n());
  report["calibrated"] = model.calibration() == Calibration::done;
  report["docked"] = model.docked();
  report["undocked_at_s"] = stats.undocked_at ? Json(seconds_of(*stats.undocked_at)) : nullptr;
  report["final_tip_mm"] = std::array{tip.x, tip.y, tip.z};
  if (device.leader()) {
    report["wishes"] = device.leader()->targets();
    report["wishes_refused"] = device.leader()->refused();
  }
  report["report_hash"] = hex64(stats.report_hash);

  write_new_file(file, report.document());
}

void describe(const EmulatorOptions& o, std::ostream& out) {
  const auto scale = torque_scale_of(make_device(o, {})->params(), o.personality);
  out << "torque_scale=" << scale[0] << ',' << scale[1] << ',' << scale[2] << '\n';
}

LinkHello hello_of(const EmulatorOptions& o) {
  return {o.personality, o.lockstep, o.lockstep ? o.rate_hz : kCyclesPerSecond / o.packet_cycles};
}

/// Serves the clients of a port that is open already. One that wants another device is refused.
template <class Server>
void serve_clients(const EmulatorOptions& o, Server& server, const std::string& location,
                   EmulatedDevice& device, FrontStats& stats, const ServeLimits& limits,
                   std::ostream& out, std::ostream& err) {
  out << "kerf-emulator: " << o.device << " at " << escaped(location) << std::endl;
  do {
    auto client = server.accept(limits.stop, limits.left_ns(stats.cycles));
    if (!client) break;
    device.renew();
    HandshakeLink link(*client, hello_of(o));
    if (o.lockstep) {
      serve_lockstep(link, device,
                     {.tick_cycles = kCyclesPerSecond / o.rate_hz,
                      .empty_turns = !o.fault.empty(),
                      .device_first = kind_of(o.personality).streams},
                     limits, stats);
    } else {
      serve_real_time(link, device, o.packet_cycles, limits, stats);
    }
    if (link.refusal().empty()) {
      device.advance(static_cast<int>(cycles_of(o.linger)));
      continue;
    }
    if (!o.stay) throw HilError(location + ": " + link.refusal());
    err << "kerf-emulator: " << location << ": " << link.refusal() << std::endl;
  } while (o.stay && !limits.reached(stats.cycles));
}

/// A device that is served on a bus, and when that ends: at a stop, at the limit of bus cycles,
/// once its client is gone, or if it was unused for the rest of the limit.
struct BusService {
  EmulatedDevice& device;
  const ServeLimits& limits;
  bool stay = false;  ///< go on when the client is gone
  FrontStats& stats;
  std::ostream& out;  ///< gets the device's path

  bool was_left = false;

  /// Whether to serve on after `cycles` bus cycles; `left`: the client that used the device is
  /// gone. For the next one it is renewed.
  [[nodiscard]] bool goes_on(std::int64_t cycles, bool left) {
    if (was_left && !left) device.renew();
    was_left = left;
    stats.cycles = cycles;
    return (stay || !left) && !limits.reached(cycles);
  }
};

/// The start of a device's idle time, by the clock: its own time stands still then.
class Unused {
 public:
  [[nodiscard]] bool for_longer_than(std::int64_t ns, bool in_use) noexcept {
    const std::int64_t now_ns = monotonic_ns();
    if (in_use) since_ns_ = now_ns;
    return now_ns - since_ns_ > ns;
  }

 private:
  std::int64_t since_ns_ = monotonic_ns();
};

/// Serves `node` as `mount`/`name`, and the other nodes of `folder`; `cycles()` since the start.
template <class Node, class Cycles>
void serve_node(BusService& service, FuseMount& folder, const std::string& mount,
                const char* device, const std::string& name, Node& node, Cycles cycles) {
  folder.add(name, node);
  service.out << "kerf-emulator: " << device << " at " << escaped(mount) << '/' << name
              << std::endl;
  Unused unused;
  folder.serve([&] {
    return service.goes_on(cycles(), node.left()) &&
           !unused.for_longer_than(service.limits.left_ns(cycles()), node.in_use());
  });
  service.stats.wake = folder.lateness();
}

// `--front fuse`: the device node of a device in the folder `mount`. Each throws `HilError` if
// nothing can be mounted.
void serve_fuse(BusService& service, const std::string& mount, const FirewireSettings& omni) {
  FirewireNode node(omni, service.device);
  FuseMount folder(mount);
  folder.add("fw0", node, FirewireNode::kHostFile);
  serve_node(service, folder, mount, "omni", "fw1", node,
             [&] { return node.bus().cycle() - kFirstCycle; });
  service.stats.sent = node.bus().stats().reports;
  service.stats.dropped = node.bus().stats().undelivered;
}

void serve_fuse(BusService& service, const std::string& mount, const FtdiFalcon::Settings& falcon,
                std::vector<ScriptedUsbFault> script) {
  UsbfsNode node(falcon, std::move(script), service.device);
  FuseMount folder(mount);
  serve_node(service, folder, mount, "falcon", "usb", node,
             [&] { return node.chip().time().cycle(); });
  service.stats.sent = node.chip().reports();
  service.stats.dropped = node.chip().lost();
}

void serve_fuse(BusService& service, const std::string& mount, const WoodenHid::Settings& wooden) {
  HidrawNode node(wooden, service.device);
  FuseMount folder(mount);
  serve_node(service, folder, mount, "woodenhaptics", "hidraw0", node,
             [&] { return node.arm().time().cycle(); });
  service.stats.sent = node.arm().reports();
  service.stats.dropped = node.lost();
}

/// `--front usbip`: the Falcon at a virtual USB port of this machine's kernel. It stays until it is
/// stopped or its time is over, because USB/IP does not report that a program closes the device.
/// Throws `HilError` if the kernel cannot.
void serve_usbip(BusService& service, const FtdiFalcon::Settings& falcon,
                 std::vector<ScriptedUsbFault> script) {
  UsbipFalcon device(falcon, std::move(script), service.device, plug_into_vhci);
  service.out << "kerf-emulator: falcon at a port of vhci_hcd" << std::endl;
  const auto goes_on = [&] {  // a kernel that let go does not come back, even to one that stays
    return !device.left() && service.goes_on(device.chip().time().cycle(), false);
  };
  serve_kernel(device, goes_on, service.stats.wake);
  service.stats.sent = device.chip().reports();
  service.stats.dropped = device.chip().lost();
}

/// `--front uhid`: the WoodenHaptics arm in this machine's HID stack. Throws `HilError`.
void serve_uhid(BusService& service, const WoodenHid::Settings& wooden) {
  UhidArm device(open_uhid(), wooden, service.device);
  service.out << "kerf-emulator: woodenhaptics at /dev/uhid" << std::endl;
  const auto goes_on = [&] { return service.goes_on(device.arm().time().cycle(), device.left()); };
  serve_kernel(device, goes_on, service.stats.wake);
  service.stats.sent = device.arm().reports();
  service.stats.dropped = device.lost();
}

FtdiFalcon::Settings falcon_settings(const EmulatorOptions& o) {
  return {.firmware_runs = o.bus.firmware_runs};
}

WoodenHid::Settings wooden_settings(const EmulatorOptions& o) {
  return {.packet_bytes = o.packet_bytes, .script = usb_script(o.bus)};
}

/// The node that the device's port has in /dev. Others have none that is public: check() has
/// refused them.
void serve_on_fuse(const EmulatorOptions& o, BusService& service) {
  const std::string_view port = kind_of(o.personality).port;
  if (port == "fw") {
    serve_fuse(service, o.bus.mount, firewire_settings(o.bus, o.lockstep ? o.rate_hz : 0));
  } else if (port == "usb") {
    serve_fuse(service, o.bus.mount, falcon_settings(o), usb_script(o.bus));
  } else if (port == "hid") {
    serve_fuse(service, o.bus.mount, wooden_settings(o));
  }
}

#ifdef KERF_HAS_WS
/// `--front websocket`: the Inverse3 behind an emulated service of its vendor.
void serve_websocket(const EmulatorOptions& o, EmulatedDevice& device, const ServeLimits& limits,
                     FrontStats& stats, std::ostream& out) {
  ServicePlace place{o.service.where, {}};
  if (!o.service.event_port.empty()) {
    const auto port = number_in(o.service.event_port);
    if (!port || *port < 0 || *port > 65535 || *port != std::floor(*port)) {
      throw HilError("--ws-events: " + o.service.event_port + " is no port from 0 to 65535");
    }
    place.event_port = static_cast<std::uint16_t>(*port);
  }
  ServiceFront front(place, service_settings(o.service, o.bus.faults, o.lockstep ? o.rate_hz : 0),
                     device, [&device] { device.renew(); });
  out << "kerf-emulator: inverse3 at ws port " << front.port();
  if (front.event_port()) out << ", events at port " << *front.event_port();
  out << std::endl;
  front.serve(limits, o.stay, stats);
}
#else
void serve_websocket(const EmulatorOptions&, EmulatedDevice&, const ServeLimits&, FrontStats&,
                     std::ostream&) {
  throw HilError(
      "--front websocket: left out of this build; install libboost-dev, then ./kerf "
      "setup");
}
#endif

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
  } else if (o.front == "websocket") {
    serve_websocket(o, device, limits, stats, out);
  } else if (o.front == "udp") {
    UdpServer server(o.udp);
    const std::string location = "udp port " + std::to_string(server.port());
    serve_clients(o, server, location, device, stats, limits, out, err);
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
