// SPDX-License-Identifier: Apache-2.0
#include "controller/shell/probe/probe.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <unistd.h>

#include "controller/device/driver/device_driver.hpp"
#include "controller/device/port/open_port.hpp"
#include "controller/scene/scene_file.hpp"
#include "controller/shell/clock.hpp"
#include "controller/shell/guard/motor_guard.hpp"
#include "controller/shell/late_note.hpp"
#include "controller/shell/probe/probe_advice.hpp"
#include "controller/shell/probe/probe_nodes.hpp"
#include "controller/shell/probe/probe_view.hpp"
#include "controller/shell/real_time.hpp"
#include "controller/shell/waiting.hpp"
#include "shared/posix/new_file.hpp"
#include "shared/posix/run_files.hpp"
#include "shared/posix/stop_signals.hpp"
#include "shared/text/json.hpp"

namespace kerf {
namespace {

constexpr int kPatienceMs = 2000;
constexpr int kDefaultRateHz = 1000;

std::string word_of(Personality personality) {
  return std::string(kPersonalityWords[static_cast<std::size_t>(personality)]);
}

/// The device as the scene describes it; without a scene, with the defaults of its kind.
DeviceSettings device_of(const ControllerOptions& options) {
  DeviceSettings device;
  if (!options.scene.empty()) device = parse_scene_file(options.scene).device;
  if (const auto kind = options.overrides.personality; kind && *kind != device.personality) {
    device.personality = *kind;
    device.torque_scale.reset();  // was measured on the other one
  }
  if (options.overrides.torque_scale) device.torque_scale = options.overrides.torque_scale;
  return device;
}

/// What the device itself still waits for, in the order in which a user does it.
void add_lacks_of_device(const DeviceSettings& device, const ProbeView::Seen& seen,
                         std::vector<Lack>& lacks) {
  const std::string name = word_of(device.personality);
  const auto lacks_deed = [&](const char* what, Waiting waiting) {
    lacks.push_back({name + what, deed_for(device.personality, waiting)});
  };
  if (seen.reports == 0) {
    lacks_deed(": not one report", Waiting::report);
    return;
  }
  if (!seen.homed) {
    lacks_deed(": not homed", Waiting::homing);
  } else if (!seen.calibrated) {
    lacks_deed(": not calibrated", Waiting::parked);
  }
  if (device.personality == Personality::woodenhaptics && !device.encoder_sign) {
    lacks.push_back({name + ": device.encoder_sign is not set; the makers' branches differ in it",
                     "push the tip to the right, up, towards you: x, y, z must rise, else turn a "
                     "sign: docs/devices.md"});
  }
  if (!device.torque_scale) {
    lacks.push_back({name + ": device.torque_scale is not set, so its motors will stay off",
                     "measure it: docs/devices.md"});
  }
}

/// One line that is drawn again on a terminal; line by line elsewhere.
class LiveLine {
 public:
  void show(const std::string& text) const {
    std::printf(terminal_ ? "\r\033[K%s" : "%s\n", text.c_str());
    std::fflush(stdout);
  }
  void end() const {
    if (terminal_) std::fputs("\n", stdout);
  }
  [[nodiscard]] int per_second() const noexcept { return terminal_ ? 10 : 1; }

 private:
  bool terminal_ = isatty(STDOUT_FILENO) == 1;
};

/// Reads and shows until the end; every packet sent is the driver's neutral one.
void watch(DeviceDriver& driver, const PacketPort& port, ProbeView& view, std::uint64_t ticks,
           int rate_hz, const std::atomic<bool>& stop) {
  const LiveLine live;
  const MotorGuard guard(driver);
  static_cast<void>(driver.release_for_good());  // whatever is commanded below: no torque
  DeadlineClock clock(kNsPerSecond / rate_hz, 0);
  const auto show_every = static_cast<std::uint64_t>(rate_hz / live.per_second());
  std::uint64_t shown_reports = 0;
  for (std::uint64_t tick = 1; tick <= ticks && !stop && !port.closed(); ++tick) {
    clock.wait_next();
    view.take(driver.read(), monotonic_ns());
    ServoOutput output;  // asks for homing and shows the lights of a device that waits
    output.phase = Phase::calibrating;
    driver.command(output);
    if (tick % show_every != 0) continue;
    const auto rate =
        (view.seen().reports - shown_reports) * static_cast<unsigned>(live.per_second());
    shown_reports = view.seen().reports;
    char head[48];
    std::snprintf(head, sizeof head, "%7.1f s %5llu/s  ", static_cast<double>(tick) / rate_hz,
                  static_cast<unsigned long long>(rate));
    live.show(head + (view.seen().reports > 0 ? view.line() : "no report yet") + "  lost " +
              std::to_string(driver.lost()));
  }
  live.end();
}

Json json_of(const std::vector<Lack>& lacks) {
  Json list = Json::List{};
  for (const Lack& lack : lacks) list.push_back({{"what", lack.what}, {"cure", lack.cure}});
  return list;
}

void print(const std::vector<Lack>& lacks) {
  for (const Lack& lack : lacks) {
    std::printf("missing  %s\n         %s\n", lack.what.c_str(), lack.cure.c_str());
  }
}

/// A port of a real bus that cannot be opened is followed by what may be the reason.
std::unique_ptr<PacketPort> open_or_explain(const ControllerOptions& options, Personality kind,
                                            int rate_hz, const std::atomic<bool>& stop) {
  const std::string port = resolve_port(options.port, kind);
  try {
    const LateNote waits(text_before_device(port));
    return open_port(port, {kind, false, rate_hz}, kPatienceMs, stop);
  } catch (const std::runtime_error&) {
    const bool is_emulated = port.starts_with("socket:") || port.starts_with("udp:");
    if (!is_emulated && !stop) print(lacks_of_nodes(kind, list_device_nodes()));
    throw;
  }
}

/// Asked to end before a device had answered: so none was seen.
int stopped_early(const ControllerOptions& options, Personality kind) {
  const std::string waiting = text_before_device(options.port);
  tell_stopped_early(waiting);
  if (!options.report.empty()) {
    const Json json{{"program", "kerf-controller --probe"},
                    {"version", KERF_VERSION},
                    {"device", word_of(kind)},
                    {"port", options.port},
                    {"waiting", waiting}};
    write_new_file(options.report, json.document());
  }
  return 1;
}

int look_around(const ControllerOptions& options) {
  const auto nodes = list_device_nodes();
  auto lacks = lacks_of_nodes(options.overrides.personality, nodes);
  const auto rights = lacks_of_rights();
  lacks.insert(lacks.end(), rights.begin(), rights.end());
  Json devices = Json::List{};
  for (const DeviceNode& node : nodes) {
    std::printf("found    %s at %s\n", word_of(node.personality).c_str(), node.path.c_str());
    devices.push_back({{"device", word_of(node.personality)},
                       {"node", node.path},
                       {"usable", node.open_error == 0}});
  }
  if (nodes.empty()) std::puts("found    no device; ./kerf demo needs none");
  if (rights.empty()) std::puts("found    real-time priority and locked memory");
  print(lacks);
  if (!options.report.empty()) {
    const Json json{{"program", "kerf-controller --probe"},
                    {"version", KERF_VERSION},
                    {"devices", devices},
                    {"missing", json_of(lacks)}};
    write_new_file(options.report, json.document());
  }
  const auto& sought = options.overrides.personality;
  return !sought || std::ranges::count(nodes, *sought, &DeviceNode::personality) > 0 ? 0 : 1;
}

Json report_of(const ControllerOptions& options, const DeviceSettings& device,
               const PacketPort& port, const DeviceDriver& driver, const ProbeView& view,
               int rate_hz) {
  const ProbeView::Seen& seen = view.seen();
  Json link = Json::Members{};
  for (const LinkCounter& counter : port.counters()) link[counter.name] = counter.value;
  const double seconds = static_cast<double>(seen.ticks) / rate_hz;
  return {{"program", "kerf-controller --probe"},
          {"version", KERF_VERSION},
          {"device", word_of(device.personality)},
          {"port", options.port},
          {"seconds", seconds},
          {"reports", seen.reports},
          {"fresh_per_s", seconds > 0 ? static_cast<double>(seen.reports) / seconds : 0},
          {"longest_gap_ms", seen.longest_gap_ms},
          {"lost_packets", driver.lost()},
          {"refused_packets", driver.refused()},
          {"link", link},
          {"counts", view.last().encoder},
          {"lowest_travel_counts", seen.lowest},
          {"highest_travel_counts", seen.highest},
          {"buttons_pressed", seen.pressed},
          {"parked", seen.parked},
          {"homed", seen.homed},
          {"calibrated", seen.calibrated},
          {"tip_mm", seen.calibrated ? Json(view.tip_mm()) : nullptr}};
}

}  // namespace

int run_probe(const ControllerOptions& options) {
  check_outputs({options.scene}, {{"--report", options.report, ".json"}});
  if (options.port.empty()) return look_around(options);
  const int rate_hz = options.overrides.rate_hz.value_or(kDefaultRateHz);
  const DeviceSettings device = device_of(options);
  std::atomic<bool>& stop = catch_stop_and_pause_signals();
  std::unique_ptr<PacketPort> port;
  try {
    port = open_or_explain(options, device.personality, rate_hz, stop);
  } catch (const std::runtime_error&) {
    if (!stop) throw;
    return stopped_early(options, device.personality);
  }
  const auto driver = make_driver(device.personality, *port, device.encoder_sign);
  driver->start();
  static_cast<void>(become_real_time(options.real_time));  // what lacks is told at the end

  ProbeView view(device, rate_hz);
  const auto ticks = options.seconds
                         ? static_cast<std::uint64_t>(std::llround(*options.seconds * rate_hz))
                         : UINT64_MAX;
  watch(*driver, *port, view, ticks, rate_hz, stop);

  std::vector<Lack> lacks;
  add_lacks_of_device(device, view.seen(), lacks);
  const auto rights = lacks_of_rights();
  lacks.insert(lacks.end(), rights.begin(), rights.end());
  std::printf("kerf: %llu reports, longest gap %.1f ms, %llu lost, %llu refused\n",
              static_cast<unsigned long long>(view.seen().reports), view.seen().longest_gap_ms,
              static_cast<unsigned long long>(driver->lost()),
              static_cast<unsigned long long>(driver->refused()));
  print(lacks);
  if (!options.report.empty()) {
    auto json = report_of(options, device, *port, *driver, view, rate_hz);
    json["missing"] = json_of(lacks);
    write_new_file(options.report, json.document());
  }
  return view.seen().reports > 0 ? 0 : 1;
}

}  // namespace kerf
