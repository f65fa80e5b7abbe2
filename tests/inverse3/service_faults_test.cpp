// SPDX-License-Identifier: Apache-2.0
// The arm while the emulated service, its link or its device goes wrong, and when it ends itself.
// By the machine's clock: a label keeps them from busy machines.
#include <array>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <doctest/doctest.h>
#include <sys/mman.h>
#include <unistd.h>

#include "hil/front/inverse3/service_device.hpp"
#include "tests/inverse3/served.hpp"
#include "tests/support/process.hpp"

namespace kerf::service_faults_test {
namespace {

using namespace kerf::test;

/// Of the device, from the first client on: after the device is armed.
constexpr std::int64_t kSoon = kCyclesPerSecond / 2;

ServiceSettings with(ServiceFault fault, ServiceProfile profile = ServiceProfile::v3_5_wireless) {
  return {.profile = profile, .script = {{kSoon, fault}}};
}

FaultScript script(FaultKind kind, double for_s, double ms = 0) {
  FaultScript script;
  script.clock = FaultClock::start;
  DeviceFault fault;
  fault.kind = kind;
  fault.at_s = 0.5;
  fault.for_s = for_s;
  fault.ms = ms;
  script.faults = {fault};
  return script;
}

/// A device that is armed and pushes along x, until the fault bars it. On a busy machine a stall
/// may bar it before, so `wanted` says what else the report of this fault has.
template <class Wanted>
CartesianReport pushed_until(PacketPort& port, const Wanted& wanted) {
  until_armed(port);
  return until(port, 1000, [&](const CartesianReport& r) { return !r.homed && wanted(r); });
}
bool is_dead(const CartesianReport& report) {
  return !report.powered;
}

/// What this process says on its error stream, for as long as this stands.
class SaidOnErrorStream {
 public:
  SaidOnErrorStream() : kept_(dup(STDERR_FILENO)), file_(memfd_create("said", MFD_CLOEXEC)) {
    REQUIRE(dup2(file_, STDERR_FILENO) == STDERR_FILENO);
  }
  ~SaidOnErrorStream() {
    dup2(kept_, STDERR_FILENO);
    close(kept_);
    close(file_);
  }
  SaidOnErrorStream(const SaidOnErrorStream&) = delete;
  SaidOnErrorStream& operator=(const SaidOnErrorStream&) = delete;

  [[nodiscard]] bool has(std::string_view words) const {
    std::array<char, 4096> text;
    const ssize_t size = pread(file_, text.data(), text.size(), 0);
    return size > 0 && std::string_view(text.data(), static_cast<std::size_t>(size)).find(words) !=
                           std::string_view::npos;
  }

 private:
  int kept_, file_;
};

}  // namespace

TEST_SUITE_BEGIN("network");

TEST_CASE("a connection that ends is made anew, and the device has to be parked again") {
  for (const ServiceFault fault :
       {ServiceFault::close, ServiceFault::going_away, ServiceFault::half_close, ServiceFault::fin,
        ServiceFault::reset, ServiceFault::half_open, ServiceFault::restart}) {
    CAPTURE(kServiceFaultWords[static_cast<std::size_t>(fault)]);
    ServedService service(with(fault));
    const auto port = open(service.options());
    const CartesianReport barred = pushed_until(*port, is_dead);
    CHECK(barred.position_um == std::array<std::int32_t, 3>{0, 80'000, 0});
    const CartesianReport first =
        until(*port, 1000, [&](const CartesianReport& r) { return r.number > barred.number; });
    CHECK(counter(*port, "reconnections") == 1);
    CHECK_FALSE(first.homed);
    CHECK(first.force_mn[0] == 0);
    CHECK(until_armed(*port).powered);
    CHECK_FALSE(port->closed());
  }
}

namespace {

/// Pushes until the service fails and the port is on a new connection; the record of the first.
ClientRecord record_of(const ServiceSettings& settings) {
  ServedService service(settings);
  auto port =
      open(service.options(settings.profile == ServiceProfile::v3_5 ? kWireless : std::string()));
  until_armed(*port);
  std::int16_t x_mn = 1000;
  const std::int64_t give_up_ns = monotonic_ns() + 10 * kNsPerSecond;
  while (counter(*port, "reconnections") == 0 && monotonic_ns() < give_up_ns) {
    command(*port, x_mn);
    static_cast<void>(newest(*port));
    sleep_until_ns(monotonic_ns() + 1'000'000);
  }
  REQUIRE(counter(*port, "reconnections") >= 1);
  port.reset();
  return service.records().front();
}

}  // namespace

TEST_CASE("zero force is the last message on a connection whose service closes or ends its side") {
  for (const ServiceFault fault :
       {ServiceFault::close, ServiceFault::going_away, ServiceFault::half_close}) {
    for (const ServiceProfile profile :
         {ServiceProfile::v3_4, ServiceProfile::v3_5, ServiceProfile::v3_5_wireless}) {
      CAPTURE(kServiceFaultWords[static_cast<std::size_t>(fault)]);
      CAPTURE(static_cast<int>(profile));
      const ClientRecord record = record_of(with(fault, profile));
      CHECK(record.failed_ns > 0);
      CHECK_FALSE(record.pushes_at_end);
      CHECK(record.let_go_ns > record.failed_ns);
      MESSAGE("from the bad sign to zero force, us: " << (record.let_go_ns - record.failed_ns) /
                                                             1000);
    }
  }
}

TEST_CASE("zero force is the last message after replies that cannot be read, whatever is wrong") {
  for (int way = 0; way < kMalformedWays; ++way) {
    CAPTURE(way);
    const ClientRecord record = record_of(
        {.script = {{kSoon, ServiceFault::unreadable}, {kSoon + 800, ServiceFault::readable}},
         .first_way = way});
    CHECK(record.failed_ns > 0);
    CHECK_FALSE(record.pushes_at_end);
    CHECK(record.let_go_ns > record.failed_ns);
    MESSAGE("from the bad sign to zero force, us: " << (record.let_go_ns - record.failed_ns) /
                                                           1000);
  }
}

TEST_CASE("after a silent service, too, zero force is the last message") {
  ServiceSettings settings;
  ServedService service(settings, script(FaultKind::silence, 0.3));
  auto port = open(service.options());
  pushed_until(*port, is_dead);
  port.reset();
  CHECK_FALSE(service.records().front().pushes_at_end);
}

TEST_CASE("a force that a lost connection left behind is taken back by the next one") {
  for (const ServiceFault fault : {ServiceFault::fin, ServiceFault::reset}) {
    CAPTURE(kServiceFaultWords[static_cast<std::size_t>(fault)]);
    ServedService service(with(fault));
    auto port = open(service.options());
    const CartesianReport barred = pushed_until(*port, is_dead);
    const CartesianReport first =
        until(*port, 1000, [&](const CartesianReport& r) { return r.number > barred.number; });
    CHECK(first.force_mn[0] == 0);
    CHECK_FALSE(first.homed);
    until_armed(*port);  // it is proven anew
    port.reset();
    REQUIRE(service.records().size() == 2);
    CHECK(service.records()[0].pushes_at_end);  // nothing could be carried
  }
}

TEST_CASE("a device that another program drives after a lost connection is not armed") {
  ServedService service(
      {.script = {{kSoon, ServiceFault::driven}, {kSoon + 80, ServiceFault::reset}}});
  const auto port = open(service.options());
  const SaidOnErrorStream said;
  const CartesianReport barred = pushed_until(*port, is_dead);
  until(*port, 0, [&](const CartesianReport& r) {
    CHECK_FALSE(r.homed);
    return r.number > barred.number + 200;
  });
  CHECK(said.has("the device is not idle since the connection was lost"));
}

TEST_CASE("a reply that is late is counted; after 20 ms the force is taken back") {
  ServedService service({}, script(FaultKind::delay, 0.02, 50));
  const auto port = open(service.options());
  until_armed(*port);
  const CartesianReport barred = until_barred(*port, 1000);
  CHECK(counter(*port, "late_replies") >= 1);
  CHECK(barred.powered);
  CHECK(counter(*port, "lost_replies") == 0);
  CHECK(counter(*port, "reconnections") == 0);
  // The device holds its force while the service is silent; the next turn has none.
  until(*port, 1000, [](const CartesianReport& r) { return !r.homed && r.force_mn[0] == 0; });
  until_armed(*port);
}

TEST_CASE("a device that holds its force and one that drops it: both have none after a stall") {
  for (const OnSilence on_silence : {OnSilence::hold_torque, OnSilence::drop_torque}) {
    CAPTURE(static_cast<int>(on_silence));
    CartesianParams params = ServedService::as_service();
    params.on_silence = on_silence;
    params.silence_cycles = 8 * 5;
    ServedService service({}, script(FaultKind::silence, 0.3), params);
    const auto port = open(service.options());
    const CartesianReport barred = pushed_until(*port, is_dead);  // dropped after 100 ms
    CHECK(counter(*port, "lost_replies") == 1);
    const CartesianReport first =
        until(*port, 1000, [&](const CartesianReport& r) { return r.number > barred.number; });
    CHECK_FALSE(first.homed);
    until(*port, 1000, [](const CartesianReport& r) { return !r.homed && r.force_mn[0] == 0; });
  }
}

TEST_CASE("a reply that gets lost ends the connection, and the next one is in step") {
  ServedService service({}, script(FaultKind::lose, 0.02));
  const auto port = open(service.options());
  pushed_until(*port, is_dead);
  until_counted(*port, "reconnections", 1);
  until_armed(*port);
  CHECK(counter(*port, "lost_replies") == 1);
}

TEST_CASE("of two replies to one message the second is dropped, and the game stays in step") {
  FaultScript twice = script(FaultKind::duplicate, 0.05);
  ServedService service({}, twice);
  const auto port = open(service.options());
  until_armed(*port);
  until_counted(*port, "stray_replies", 1);
  const std::uint64_t before = counter(*port, "packets");
  until_counted(*port, "packets", before + 100);
  CHECK(counter(*port, "lost_replies") == 0);
  CHECK(counter(*port, "reconnections") == 0);
  CHECK(until_armed(*port).homed);
}

TEST_CASE("a message that cannot be read is dropped, whatever is wrong with it") {
  ServiceSettings settings;
  for (int way = 0; way < kMalformedText; ++way) {
    settings.script.push_back({kSoon + 400 * way, ServiceFault::malformed});
  }
  ServedService service(settings);
  const auto port = open(service.options());
  until_armed(*port);
  until_counted(*port, "unreadable_replies", kMalformedText);
  CHECK(counter(*port, "reconnections") == 0);
  CHECK(counter(*port, "lost_replies") == 0);
  CHECK(counter(*port, "unreadable_replies") == kMalformedText);
  CHECK(until_armed(*port).homed);
}

TEST_CASE(
    "three messages in a row that cannot be read, or one of no UTF-8 or 1 MiB, end a connection") {
  ServiceSettings three;
  for (int i = 0; i < 3; ++i) three.script.push_back({kSoon, ServiceFault::malformed});
  ServiceSettings others;
  for (int i = 0; i < kMalformedText + 1; ++i) {
    others.script.push_back({kSoon + 400 * i, ServiceFault::malformed});
  }
  others.script.push_back({4 * kCyclesPerSecond, ServiceFault::malformed});
  for (const auto& [settings, ends] : {std::pair(three, 1U), std::pair(others, 2U)}) {
    ServedService service(settings);
    const auto port = open(service.options());
    until_armed(*port);
    until_counted(*port, "reconnections", ends);
    CHECK_FALSE(port->closed());
    until_armed(*port);
  }
}

TEST_CASE("a device that vanishes from the list and comes back has to be parked again") {
  ServedService service(
      {.script = {{kSoon, ServiceFault::vanish}, {kSoon + 800, ServiceFault::back}}});
  const auto port = open(service.options());
  const CartesianReport gone = pushed_until(*port, is_dead);
  const CartesianReport back =
      until(*port, 1000, [&](const CartesianReport& r) { return r.number > gone.number; });
  CHECK_FALSE(back.homed);
  CHECK(back.powered);
  CHECK(back.force_mn[0] == 0);
  until_armed(*port);
  CHECK(counter(*port, "reconnections") == 0);
}

TEST_CASE("a device under another id is not this one") {
  ServedService service(with(ServiceFault::other_id));
  const auto port = open(service.options());
  pushed_until(*port, is_dead);
  // On a busy machine a stall may have ended its reports before, and that comes to an end.
  bool gone = false;
  for (int tries = 0; tries < 20 && !gone; ++tries) {
    const std::uint64_t packets = counter(*port, "packets"), commands = counter(*port, "commands");
    until_counted(*port, "commands", commands + 200);
    gone = counter(*port, "packets") == packets;
  }
  CHECK(gone);
  CHECK(counter(*port, "unreadable_replies") == 0);
  CHECK(norm(service.end().motor_force_n()) == 0.0);
}

TEST_CASE("a second device or handle in the list changes nothing for the first") {
  for (const ServiceFault fault : {ServiceFault::second_arm, ServiceFault::third_handle}) {
    CAPTURE(kServiceFaultWords[static_cast<std::size_t>(fault)]);
    ServedService service(with(fault));  // listed before ours, elsewhere, without power
    const auto port = open(service.options());
    const CartesianReport armed = until_armed(*port);
    const std::uint64_t packets = counter(*port, "packets");
    std::uint64_t pushed = 0;
    until(*port, 500, [&](const CartesianReport& r) {
      CHECK(r.position_um == armed.position_um);
      CHECK(r.powered);
      CHECK(r.parked);
      pushed += r.force_mn[0] > 400 ? 1 : 0;
      return r.number > packets + 700;
    });
    CHECK(pushed > 100);
  }
}

TEST_CASE("without its supply a device has no force, and none when the supply comes back") {
  ServedService service(
      {.script = {{kSoon, ServiceFault::power_off}, {kSoon + 1600, ServiceFault::power_on}}});
  const auto port = open(service.options());
  pushed_until(*port, is_dead);
  const CartesianReport on = until(*port, 1000, [](const CartesianReport& r) { return r.powered; });
  CHECK_FALSE(on.homed);
  CHECK(on.force_mn[0] == 0);
  until_armed(*port);
}

TEST_CASE("a calibration that is lost bars the device while it lasts") {
  ServedService service({}, script(FaultKind::unhome, 0.2));
  const auto port = open(service.options());
  const SaidOnErrorStream said;  // the reason: a busy machine may bar it for another
  pushed_until(*port, [&](const CartesianReport& report) {
    return report.powered && said.has("the device is not calibrated");
  });
  CHECK(counter(*port, "bars") >= 1);
  until_armed(*port);
}

TEST_CASE("a handle that sleeps bars the device until it is awake and its button held") {
  ServedService service(
      {.script = {{kSoon, ServiceFault::grip_sleep}, {kSoon + 1600, ServiceFault::grip_wake}}});
  const auto port = open(service.options());
  pushed_until(*port, [](const CartesianReport& r) { return !r.parked; });
  CHECK(until_armed(*port).parked);
}

TEST_CASE("another session that pushes too is found by the echo") {
  ServedService service(with(ServiceFault::second_client));
  const auto port = open(service.options());
  const CartesianReport barred =
      pushed_until(*port, [](const CartesianReport& r) { return r.force_mn[0] > 1900; });
  CHECK(barred.powered);
  // It lasts for as long as the other one pushes.
  until(*port, 0, [&](const CartesianReport& r) {
    CHECK_FALSE(r.homed);
    return r.number > barred.number + 200;
  });
}

TEST_CASE("a brake that the service reports at its event port bars the device") {
  ServedService service(with(ServiceFault::event));
  const auto port = open(service.options());
  const SaidOnErrorStream said;  // the reason: a busy machine may bar it for another
  pushed_until(*port, [&](const CartesianReport& report) {
    return report.powered && said.has("the service reports a fault");
  });
  CHECK(counter(*port, "bars") >= 1);
  until_armed(*port);
}

TEST_CASE("a session whose frame another client turned is found within 2000 turns, and closed") {
  ServedService service(with(ServiceFault::reconfigure));
  auto port = open(service.options());
  until_armed(*port);
  const std::int64_t give_up_ns = monotonic_ns() + 20 * kNsPerSecond;
  while (!port->closed() && monotonic_ns() < give_up_ns) {
    command(*port, 500);
    static_cast<void>(newest(*port));
    sleep_until_ns(monotonic_ns() + 1'000'000);
  }
  CHECK(port->closed());
  port.reset();
  CHECK(norm(service.end().motor_force_n()) == 0.0);
}

// ---- the end ----

TEST_CASE("the last packet leaves, and a port that ends takes its force back") {
  for (const bool says_so : {true, false}) {
    CAPTURE(says_so);
    ServedService service;
    auto port = open(service.options());
    until_armed(*port);
    until(*port, 2000, [](const CartesianReport& report) { return report.force_mn[0] > 1900; });
    if (says_so) CHECK(port->send_last(encode(CartesianCommand{})));
    port.reset();
    CHECK(norm(service.end().motor_force_n()) == 0.0);
  }
}

TEST_CASE("a servo that stands still loses the force, though its port plays on") {
  ServedService service;
  const auto port = open(service.options());
  until_armed(*port);
  until(*port, 1000, [](const CartesianReport& report) { return report.force_mn[0] > 900; });
  // No command any more.
  const std::int64_t give_up_ns = monotonic_ns() + 10 * kNsPerSecond;
  std::optional<CartesianReport> report;
  while ((!report || report->force_mn[0] != 0) && monotonic_ns() < give_up_ns) {
    static_cast<void>(port->wait(10));
    report = newest(*port);
  }
  REQUIRE(report);
  CHECK(report->force_mn[0] == 0);
}

TEST_CASE(
    "zero force is the last message, whatever ends kerf-arm: a crash, kill -9, a signal, or no "
    "controller") {
  enum class End { crash, kill, kill_guard, ask, controller };
  for (const End end : {End::crash, End::kill, End::kill_guard, End::ask, End::controller}) {
    CAPTURE(static_cast<int>(end));
    const RuntimeFolder folder;
    ServedService service;
    const auto options = service.options();
    Process arm({std::string(KERF_TEST_BIN) + "/kerf-arm", "--device", "inverse3", "--service",
                 std::to_string(options.service.port), "--events", "0", "--priority", "0"},
                folder / "log");
    std::optional<ArmPort> port(std::in_place, "inverse3", LinkHello{Personality::inverse3}, 20'000,
                                kNoStop);
    until_armed(*port);
    until(*port, 2000, [](const CartesianReport& report) { return report.force_mn[0] > 1900; });
    if (end == End::crash) kill(arm.child(), SIGSEGV);
    if (end == End::kill) kill(arm.child(), SIGKILL);
    if (end == End::kill_guard) kill(arm.pid(), SIGKILL);
    if (end == End::ask) kill(arm.pid(), SIGTERM);
    if (end == End::controller) {
      port.reset();  // as one that was killed: no word of its own
      sleep_until_ns(monotonic_ns() + 200'000'000);
      kill(arm.pid(), SIGTERM);
    }
    const int code = arm.wait();
    if (end == End::crash || end == End::kill) CHECK(code == 2);
    if (end == End::ask || end == End::controller) CHECK(code == 0);
    if (end == End::crash)
      CHECK(text_of(folder / "log").find("kerf-arm has crashed (SIGSEGV)") != std::string::npos);
    if (end == End::kill)
      CHECK(text_of(folder / "log").find("killed; the device's service was given zero force") !=
            std::string::npos);
    const auto is_let_go = [&] { return !port || port->closed(); };
    if (end == End::kill_guard) CHECK(eventually(is_let_go, std::chrono::seconds(10)));
    CHECK_FALSE(service.records().front().pushes_at_end);
  }
}

TEST_SUITE_END();

}  // namespace kerf::service_faults_test
