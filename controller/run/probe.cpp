// SPDX-License-Identifier: Apache-2.0
#include "controller/run/probe.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <unistd.h>

#include "controller/device/device_driver.hpp"
#include "controller/device/open_port.hpp"
#include "controller/loop/motor_guard.hpp"
#include "controller/loop/real_time.hpp"
#include "controller/loop/tick_source.hpp"
#include "controller/loop/wait_state.hpp"
#include "controller/plan/plan_device.hpp"
#include "controller/scene/scene_file.hpp"
#include "shared/arm/arm_page.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/posix/stop_signals.hpp"
#include "shared/text/json.hpp"

namespace kerf {

ProbeView::ProbeView(const DeviceSettings& device, int rate_hz) {
  LoadedScene scene;
  scene.device = device;
  scene.servo.rate_hz = rate_hz;
  ServoPlan<DoubleNumbers> plan;
  plan_device(device, plan);
  plan_limits(scene, plan);
  plan_ = plan.device;
  timing_ = plan.timing;
}

void ProbeView::take(const DeviceReport& report, std::int64_t now_ns) noexcept {
  if (follow_encoders(report, plan_, timing_, encoders_) == Rest::docked) {
    seen_.calibrated = true;
  }
  if (!report.fresh) {
    seen_.ticks += seen_.reports > 0 ? 1 : 0;
    return;
  }
  if (seen_.reports > 0) {
    for (std::size_t i = 0; i < 3; ++i) {
      travelled_[i] += static_cast<std::int16_t>(report.counts[i] - last_.counts[i]);
      seen_.lowest[i] = std::min(seen_.lowest[i], travelled_[i]);
      seen_.highest[i] = std::max(seen_.highest[i], travelled_[i]);
    }
    const double gap_ms = static_cast<double>(now_ns - last_ns_) / 1e6;
    seen_.longest_gap_ms = std::max(seen_.longest_gap_ms, gap_ms);
  }
  ++seen_.ticks;
  ++seen_.reports;
  last_ = report;
  last_ns_ = now_ns;
  seen_.pressed[0] = seen_.pressed[0] || report.button1;
  seen_.pressed[1] = seen_.pressed[1] || report.button2;
  seen_.parked = seen_.parked || report.parked;
  seen_.homed = seen_.homed || report.homed;
}

std::array<double, 3> ProbeView::tip_mm() const noexcept {
  const auto tip = device_pose(plan_, encoders_, {}).arm.tip_mm;
  return {tip.x, tip.y, tip.z};
}

std::string ProbeView::line() const {
  char tip[48] = "unknown until parked at rest";
  if (seen_.calibrated) {
    const auto mm = tip_mm();
    std::snprintf(tip, sizeof tip, "%+7.1f %+7.1f %+7.1f mm", mm[0], mm[1], mm[2]);
  }
  char text[128];
  std::snprintf(text, sizeof text, "counts %6d %6d %6d  tip %s  buttons %c%c  %s%s",
                last_.counts[0], last_.counts[1], last_.counts[2], tip, last_.button1 ? '1' : '-',
                last_.button2 ? '2' : '-', last_.parked ? "parked" : "in hand",
                last_.homed ? "" : ", not homed");
  return text;
}

namespace {

constexpr int kPatienceMs = 2000;
constexpr int kDefaultRateHz = 1000;

/// The device as the scene describes it; without a scene, with the defaults of its kind.
DeviceSettings device_of(const ControllerOptions& options) {
  DeviceSettings device;
  if (!options.scene.empty()) device = parse_scene_file(options.scene).device;
  if (const auto kind = options.overrides.personality; kind && *kind != device.personality) {
    device.personality = *kind;
    device.torque_scale.reset();  // measured on the other one
  }
  if (options.overrides.torque_scale) device.torque_scale = options.overrides.torque_scale;
  return device;
}

/// Adds the next steps of a start that the device itself still needs.
void add_lacks_of_device(const DeviceSettings& device, const ProbeView::Seen& seen,
                         std::uint64_t refused, std::vector<SetupProblem>& lacks) {
  const std::string name(word_of(device.personality));
  if (seen.reports == 0 && refused > 0) {
    lacks.push_back({name + ": not one of " + std::to_string(refused) + " packets is its report",
                     "check --device and the firmware; docs/wire.md has the bytes"});
    return;
  }
  const auto lacks_deed = [&](const char* what, Waiting waiting) {
    lacks.push_back({name + what, action_for(device.personality, waiting)});
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
  if (kind_of(device.personality).needs_encoder_sign && !device.encoder_sign) {
    lacks.push_back({name + ": device.encoder_sign is not set; the makers' branches differ in it",
                     "push the tip to the right, up, towards you: x, y, z must rise, else turn a "
                     "sign: docs/first-hour.md"});
  }
  if (!device.torque_scale) {
    lacks.push_back({name + ": device.torque_scale is not set, so its motors will stay off",
                     "measure it: docs/first-hour.md"});
  }
}

/// One line that is redrawn on a terminal; a new line each time elsewhere.
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

/// Reads and prints until the end; every sent packet is the neutral one of the driver.
void watch(DeviceDriver& driver, const PacketPort& port, ProbeView& view, std::uint64_t ticks,
           int rate_hz, const std::atomic<bool>& stop) {
  const LiveLine live;
  const MotorGuard guard(driver);
  static_cast<void>(driver.release_for_good());  // no torque from any later command
  DeadlineClock clock(kNsPerSecond / rate_hz, 0);
  const auto show_every = static_cast<std::uint64_t>(rate_hz / live.per_second());
  std::uint64_t shown_reports = 0;
  for (std::uint64_t tick = 1; tick <= ticks && !stop && !port.closed(); ++tick) {
    clock.wait_next();
    view.take(driver.read(), monotonic_ns());
    ServoOutput output;  // requests homing, and sets the lights of a waiting device
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

Json json_of(const std::vector<SetupProblem>& lacks) {
  Json list = Json::List{};
  for (const SetupProblem& lack : lacks) list.push_back({{"what", lack.what}, {"cure", lack.cure}});
  return list;
}

void print(const std::vector<SetupProblem>& lacks) {
  for (const SetupProblem& lack : lacks) {
    std::printf("missing  %s\n         %s\n", lack.what.c_str(), lack.cure.c_str());
  }
}

/// Opens the port; if that fails on a real bus, prints the possible reasons.
std::unique_ptr<PacketPort> open_or_explain(const ControllerOptions& options, Personality kind,
                                            int rate_hz, const std::atomic<bool>& stop) {
  const std::string port = resolve_port(options.ports.front(), kind);
  try {
    const LateNote waits(text_before_device(port));
    return open_port(port, {kind, false, rate_hz}, kPatienceMs, stop, {}, true);
  } catch (const std::runtime_error&) {
    const bool is_emulated = port.starts_with("socket:") || port.starts_with("udp:");
    if (!is_emulated && !stop) print(lacks_of_nodes(kind, list_device_nodes()));
    throw;
  }
}

/// The end by a signal before a device has answered.
int stopped_early(const ControllerOptions& options, Personality kind) {
  const std::string waiting = text_before_device(options.ports.front());
  tell_stopped_early(waiting);
  if (!options.report.empty()) {
    const Json json{{"program", "kerf-controller --probe"},
                    {"version", KERF_VERSION},
                    {"device", word_of(kind)},
                    {"port", options.ports.front()},
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
    std::printf("found    %s at %s\n", std::string(word_of(node.personality)).c_str(),
                node.path.c_str());
    devices.push_back({{"device", word_of(node.personality)},
                       {"node", node.path},
                       {"usable", node.open_error == 0}});
  }
  if (nodes.empty()) std::puts("found    no device; ./kerf demo needs none");
  for (const std::string& name : running_arms()) {
    std::printf("found    kerf-arm at --port arm:%s\n", name.c_str());
  }
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
          {"port", options.ports.front()},
          {"seconds", seconds},
          {"reports", seen.reports},
          {"fresh_per_s", seconds > 0 ? static_cast<double>(seen.reports) / seconds : 0},
          {"longest_gap_ms", seen.longest_gap_ms},
          {"lost_packets", driver.lost()},
          {"refused_packets", driver.refused()},
          {"link", link},
          {"counts", view.last().counts},
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
  if (options.ports.empty()) return look_around(options);
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
  const auto driver = make_driver(device.personality, *port, device.encoder_sign, rate_hz);
  driver->start();
  static_cast<void>(become_real_time(options.real_time));  // missing rights are printed at the end

  ProbeView view(device, rate_hz);
  const auto ticks = options.seconds
                         ? static_cast<std::uint64_t>(std::llround(*options.seconds * rate_hz))
                         : UINT64_MAX;
  watch(*driver, *port, view, ticks, rate_hz, stop);

  std::vector<SetupProblem> lacks;
  add_lacks_of_device(device, view.seen(), driver->refused(), lacks);
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
