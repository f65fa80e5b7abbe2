// SPDX-License-Identifier: Apache-2.0
// The arm against the emulated service, with the controller's port behind it: names, versions,
// forces and the end.
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <arpa/inet.h>
#include <doctest/doctest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "controller/device/open_port.hpp"
#include "hil/front/inverse3/service_device.hpp"
#include "tests/inverse3/served.hpp"
#include "tests/support/errors.hpp"

namespace kerf::service_arm_test {
namespace {

using namespace kerf::test;

}  // namespace

// ---- its name ----

TEST_CASE("--service: that of this machine by itself, or another place") {
  CHECK(parse_service("").host == "127.0.0.1");
  CHECK(parse_service("").port == 10001);
  CHECK(parse_service("10.0.0.2:12").host == "10.0.0.2");
  CHECK(parse_service("10.0.0.2:12").port == 12);
  CHECK(parse_service("65535").port == 65535);
  CHECK(parse_service("5000").host == "127.0.0.1");
  CHECK(parse_service("[::1]:5000").host == "::1");
  for (const char* wrong : {":", "0", "65536", "x", ":5000", "host:", "1,", "1 ", "-1"}) {
    CAPTURE(wrong);
    CHECK(has(error_of([&] { static_cast<void>(parse_service(wrong)); }),
              "--service " + std::string(wrong) + ": not [HOST:]PORT"));
  }
}

TEST_CASE("the port of a service is kerf-arm's: --port arm, and what ws was is refused in a line") {
  CHECK(resolve_port("auto", Personality::inverse3) == "arm");
  for (const char* former : {"ws", "ws:5000,park=a"}) {
    CHECK(error_of([&] { check_port(former); })
              .starts_with("--port " + std::string(former) +
                           ": the Inverse3's service is kerf-arm's; take --port arm, "));
  }
}

// ---- versions ----

TEST_CASE("each version of the service is understood: pose, parking button, force and echo" *
          doctest::test_suite("network")) {
  for (const ServiceProfile profile :
       {ServiceProfile::v3_4, ServiceProfile::v3_5, ServiceProfile::v3_5_wireless}) {
    CAPTURE(static_cast<int>(profile));
    ServedService service({.profile = profile});
    const auto port = open(service.options(profile == ServiceProfile::v3_5 ? kWireless : ""));
    const CartesianReport armed = until_armed(*port);
    CHECK(armed.position_um == std::array<std::int32_t, 3>{0, 80'000, 0});
    CHECK(armed.orientation == std::array<std::int16_t, 4>{0, 0, 0, 32767});
    CHECK(armed.parked);
    CHECK(armed.powered);
    if (profile == ServiceProfile::v3_4) continue;  // it gives no echo
    for (const std::int16_t force_mn : std::array<std::int16_t, 4>{1000, -1003, 20, 7}) {
      const auto echo = until(*port, force_mn, [&](const CartesianReport& report) {
        return std::abs(report.force_mn[0] - force_mn) <= 14;
      });
      CHECK(echo.homed);
      CHECK(std::abs(echo.force_mn[1]) <= 14);
    }
  }
}

TEST_CASE("a force acts along the axis that it has in kerf's frame" *
          doctest::test_suite("network")) {
  ServedService service;
  const auto port = open(service.options());
  until_armed(*port);
  CartesianCommand command;
  command.force_on = true;
  command.force_mn = {280, -560, 840};  // whole steps
  const std::int64_t give_up_ns = monotonic_ns() + 10 * kNsPerSecond;
  std::optional<CartesianReport> report;
  while ((!report || report->force_mn != command.force_mn) && monotonic_ns() < give_up_ns) {
    port->send(encode(command));
    static_cast<void>(port->wait(10));
    report = newest(*port);
  }
  REQUIRE(report);
  CHECK(report->force_mn == command.force_mn);
}

TEST_CASE("a service before 3.1, or one that obeys other words than its version's, is refused" *
          doctest::test_suite("network")) {
  ServedService old({.profile = ServiceProfile::v3_0});
  CHECK(has(error_of([&] { open(old.options()); }),
            "version 3.0.7.0; needs the vendor's Inverse Service 3.1 or newer"));
  ServedService changed({.profile = ServiceProfile::v3_5, .claims = ServiceProfile::v3_4});
  CHECK(has(error_of([&] { open(changed.options(kWireless)); }),
            "stays idle under the force command"));
  ServedService changed_back({.profile = ServiceProfile::v3_4, .claims = ServiceProfile::v3_5});
  CHECK(has(error_of([&] { open(changed_back.options()); }), "stays idle under the force command"));
}

TEST_CASE("a service whose forces are scaled or damped is refused at the start" *
          doctest::test_suite("network")) {
  ServedService service({.script = {{0, ServiceFault::reconfigure}}});
  // The settings change with the first client, so the second one finds them.
  static_cast<void>(error_of([&] { open(service.options()); }));
  CHECK(has(error_of([&] { open(service.options()); }), "scales every force by 0.5"));
}

TEST_CASE("a device that another program drives is refused, also if the force word is not obeyed" *
          doctest::test_suite("network")) {
  ServedService driven({.script = {{0, ServiceFault::driven}}});
  CHECK(has(error_of([&] { open(driven.options()); }), "device 0A1C is not idle (force) before"));
  ServedService deaf({.profile = ServiceProfile::v3_5_wireless,
                      .claims = ServiceProfile::v3_4,
                      .script = {{0, ServiceFault::driven}}});
  CHECK(has(error_of([&] { open(deaf.options()); }), "is not idle"));
}

TEST_CASE("several handles are listed and refused without a name" *
          doctest::test_suite("network")) {
  ServedService both({.profile = ServiceProfile::v3_5});
  CHECK(has(error_of([&] { open(both.options()); }),
            "several handles are there: 51877, 40213; name the one of this device with handle=ID"));
  ServedService third({.script = {{0, ServiceFault::third_handle}}});
  CHECK(has(error_of([&] { open(third.options()); }), "several handles are there: 40999, 40213; "));
  CHECK(until_armed(*open(third.options(kWireless))).parked);
}

TEST_CASE("what is wrong with the replies at the start is the line, not the connection" *
          doctest::test_suite("network")) {
  ServedService millimetres({.position_scale = 1000});
  const std::string line = error_of([&] { open(millimetres.options()); });
  CHECK(has(line,
            "3 replies of the service in a row cannot be read: its position of the device is "
            "280 m away, and no arm reaches 1 m: is it in millimetres?"));
  CHECK_FALSE(has(line, "closed"));
  // The list of the devices is not broken, and takes the first one.
  constexpr ScriptedServiceFault kMalformed{1, ServiceFault::malformed};
  ServedService broken({.script = {kMalformed, kMalformed, kMalformed, kMalformed}});
  const std::string cut = error_of([&] { open(broken.options()); });
  CHECK(
      has(cut, "3 replies of the service in a row cannot be read: they are no JSON of a state; "));
}

// ---- other programs ----

namespace {

/// A program at a port that says `greeting` and nothing else.
class Stranger {
 public:
  explicit Stranger(std::string greeting) : greeting_(std::move(greeting)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    REQUIRE(bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
    REQUIRE(listen(fd_, 8) == 0);
    thread_ = std::thread([this] {
      for (int client = accept(fd_, nullptr, nullptr); client >= 0;
           client = accept(fd_, nullptr, nullptr)) {
        clients_.push_back(client);
        if (!greeting_.empty()) {
          static_cast<void>(send(client, greeting_.data(), greeting_.size(), MSG_NOSIGNAL));
        }
      }
    });
  }
  ~Stranger() {
    shutdown(fd_, SHUT_RDWR);
    thread_.join();
    for (const int client : clients_) close(client);
    close(fd_);
  }
  Stranger(const Stranger&) = delete;
  Stranger& operator=(const Stranger&) = delete;

  [[nodiscard]] std::uint16_t port() const {
    sockaddr_in own{};
    socklen_t bytes = sizeof own;
    REQUIRE(getsockname(fd_, reinterpret_cast<sockaddr*>(&own), &bytes) == 0);
    return ntohs(own.sin_port);
  }

 private:
  std::string greeting_;
  int fd_ = socket(AF_INET, SOCK_STREAM, 0);
  std::vector<int> clients_;
  std::thread thread_;
};

std::string refusal_of(std::uint16_t port) {
  ServiceArm::Options options;
  options.service.port = port;
  options.patience_ms = 0;
  return error_of([&] { open(options); });
}

}  // namespace

TEST_CASE("nobody, a silent program and one that speaks otherwise: one line, and the way out") {
  std::uint16_t free_port = 0;
  {
    const Stranger ended("");
    free_port = ended.port();
  }
  const Stranger silent(""), banner("SSH-2.0-OpenSSH_9.2\r\n"),
      page("HTTP/1.1 200 OK\r\nContent-Length: 5\r\n\r\nhello"),
      other("HTTP/1.1 200 OK\r\nContent-Length: 26\r\n\r\n{\"project_version\": \"9\"   }"),
      huge("HTTP/1.1 200 OK\r\nContent-Length: 999999999\r\n\r\nx");
  for (const std::uint16_t port :
       {free_port, silent.port(), banner.port(), page.port(), other.port(), huge.port()}) {
    CAPTURE(port);
    const std::string line = refusal_of(port);
    CHECK(line.starts_with("--service 127.0.0.1:" + std::to_string(port) + ": "));
    CHECK(has(line, "needs the vendor's Inverse Service 3.1 or newer"));
    CHECK_FALSE(has(line, "\n"));
  }
}

TEST_CASE("each status of an answer has the remedy of its own") {
  struct Case {
    const char* status;
    const char* says;
  };
  for (const auto& [status, says] :
       {Case{
            "503 Service Unavailable",
            "the service is in use (HTTP 503: in use); end the other program that uses the device"},
        Case{"429 Too Many Requests", "takes no more requests now (HTTP 429: in use); end other"},
        Case{"401 Unauthorized", "asks for a login (HTTP 401: in use), as no Inverse Service does"},
        Case{"403 Forbidden", "asks for a login (HTTP 403: in use), as no Inverse Service does"},
        Case{"407 Proxy Authentication Required", "asks for a login (HTTP 407: in use)"},
        Case{"404 Not Found", "has no such address (HTTP 404: in use); needs the vendor's"},
        Case{"302 Found", "sends elsewhere (HTTP 302: in use), so another program answers there"},
        Case{"500 Internal Server Error", "has an error (HTTP 500: in use); systemctl"},
        Case{"502 Bad Gateway", "has an error (HTTP 502: in use); systemctl"},
        Case{"400 Bad Request", "does not take the request (HTTP 400: in use); needs the"}}) {
    CAPTURE(status);
    const std::string body = R"({"ok":false,"error":"in use"})";
    const Stranger stranger(std::string("HTTP/1.1 ") + status + "\r\nContent-Length: " +
                            std::to_string(body.size()) + "\r\n\r\n" + body);
    const std::string line = refusal_of(stranger.port());
    CAPTURE(line);
    CHECK(has(line, says));
    CHECK_FALSE(has(line, "\n"));
    CHECK(has(line, "needs the vendor's") ==
          (std::string(says).find("needs the") != std::string::npos));
  }
  // Of the upgrade, after a version that is one.
  ServedService none({.profile = ServiceProfile::v3_0, .claims = ServiceProfile::v3_5});
  CHECK(has(error_of([&] { open(none.options()); }),
            "the service has no such address (HTTP 404: not found); needs the vendor's"));
}

TEST_CASE("a port that is taken is the fault of the option that named it") {
  const Stranger there("");
  Emulator emulator(std::make_unique<CartesianModel>(ServedService::as_service()), std::nullopt);
  const FaultScript no_faults;
  FaultyDevice device(emulator, no_faults);
  const auto line = [&](const ServicePlace& place) {
    return error_of([&] { ServiceFront(place, {}, device, [] {}); });
  };
  const std::string taken = std::to_string(there.port());
  CHECK(line({taken, std::nullopt}).starts_with("--ws: " + taken + ": Address already in use"));
  CHECK(
      line({"0", there.port()}).starts_with("--ws-events: " + taken + ": Address already in use"));
  CHECK(line({"0", std::uint16_t{0}}).empty());
}

TEST_CASE("an attempt to connect ends when it is asked to, however long it may take" *
          doctest::test_suite("network")) {
  const Stranger silent("");
  constexpr int kVeryLongMs = 3'600'000;
  const std::atomic<bool> stop{true};
  const inverse3::HostPort where{"127.0.0.1", silent.port()};
  CHECK(has(error_of([&] {
              static_cast<void>(inverse3::http_get(where, "/version", kVeryLongMs, stop));
            }),
            "asked to end before an answer to GET"));
  CHECK(has(error_of([&] { inverse3::WebSocket(where, kVeryLongMs, stop); }),
            "asked to end before an answer to the upgrade"));
}

TEST_CASE("a second client is turned away, and the first one goes on" *
          doctest::test_suite("network")) {
  ServedService service;
  const auto port = open(service.options());
  until_armed(*port);
  const std::string line = error_of([&] { open(service.options()); });
  CHECK(has(line, "the service is in use (HTTP 503: in use); end the other program"));
  CHECK_FALSE(has(line, "needs the vendor's"));
  const std::uint64_t before = counter(*port, "packets");
  until_counted(*port, "packets", before + 20);
  CHECK_FALSE(port->closed());
}

// ---- lock-step ----

namespace {

/// The reports of a run in lock-step, in which each command is one report.
std::vector<CartesianReport> lock_step_run(ServiceProfile profile) {
  ServedService service({.profile = profile, .lockstep = true});
  const auto port = open(service.options(profile == ServiceProfile::v3_5 ? kWireless : ""), true);
  std::vector<CartesianReport> reports;
  for (int tick = 0; tick < 300; ++tick) {
    REQUIRE(port->wait(5000));  // the first report is there before the first command
    std::array<std::uint8_t, 65> packet;
    const std::size_t size = port->receive(packet);
    const auto report = decode_cartesian_report(std::span(packet).first(size));
    REQUIRE(report);
    CHECK(port->receive(packet) == 0);
    reports.push_back(*report);
    command(*port, static_cast<std::int16_t>(10 * tick));
  }
  return reports;
}

}  // namespace

TEST_CASE("in lock-step a command is a report, the same in each run" *
          doctest::test_suite("network")) {
  const auto first = lock_step_run(ServiceProfile::v3_5_wireless);
  CHECK(first == lock_step_run(ServiceProfile::v3_5_wireless));
  CHECK(first == lock_step_run(ServiceProfile::v3_5));
  CHECK(first[0].number == static_cast<std::uint32_t>(inverse3::Session::kProofTurns));
  CHECK(first.back().force_mn[0] > 0);
  auto old = lock_step_run(ServiceProfile::v3_4);
  REQUIRE(old.size() == first.size());
  for (std::size_t i = 0; i < old.size(); ++i) {
    old[i].force_mn = first[i].force_mn;  // it gives no echo
  }
  CHECK(old == first);
}

TEST_CASE("a port that ends takes its force back by its last message" *
          doctest::test_suite("network")) {
  ServedService service({.lockstep = true});
  auto port = open(service.options(), true);
  std::optional<CartesianReport> report;
  for (int tick = 0; tick < 300; ++tick) {
    command(*port, 1000);
    REQUIRE(port->wait(5000));
    report = newest(*port);
  }
  REQUIRE(report);
  CHECK(report->force_mn[0] > 900);
  port.reset();
  CHECK(norm(service.end().motor_force_n()) == 0.0);
}

TEST_CASE("a port by the clock and a service in lock-step do not fit, nor the other way round" *
          doctest::test_suite("network")) {
  ServedService lockstep({.lockstep = true});
  CHECK(has(error_of([&] { open(lockstep.options()); }), "the emulator runs in lock-step"));
  ServedService real;
  CHECK(has(error_of([&] { open(real.options(), true); }), "the controller runs in lock-step"));
}

}  // namespace kerf::service_arm_test
