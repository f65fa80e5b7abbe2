// SPDX-License-Identifier: Apache-2.0
#include "hil/program/program.hpp"

#include <atomic>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <doctest/doctest.h>

#include "tests/hil/fake_host.hpp"

namespace {

using kerf::OmniCommand;
using kerf::test::FakeHost;
using kerf::test::SocketPath;

struct Outcome {
  int exit_code = -1;
  std::string out;
  std::string err;
};

Outcome run(std::vector<std::string> arguments, const std::atomic<bool>& stop) {
  arguments.insert(arguments.begin(), "kerf-emulator");
  std::vector<const char*> argv;
  for (const auto& argument : arguments) argv.push_back(argument.c_str());
  std::ostringstream out;
  std::ostringstream err;
  Outcome outcome;
  outcome.exit_code =
      kerf::run_emulator(static_cast<int>(argv.size()), argv.data(), stop, out, err);
  outcome.out = out.str();
  outcome.err = err.str();
  return outcome;
}

Outcome run(const std::vector<std::string>& arguments) {
  const std::atomic<bool> stop{false};
  return run(arguments, stop);
}

std::string text_of(const std::string& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace

TEST_CASE("bad input is one line that names place, value and way out, and exit code 2") {
  const std::string socket = SocketPath("unused").text();
  struct Bad {
    std::vector<std::string> arguments;
    std::string place;
  };
  for (const auto& [arguments, place] : {
           Bad{{}, "--socket"},
           Bad{{"--socket", socket, "--wrong"}, "--wrong"},
           Bad{{"--socket", socket, "--hand-socket", socket + "-hand", "--hand", "x.toml"},
               "--hand-socket: the hand of --hand"},
           Bad{{"--socket", socket, "--hand-socket", socket + "-hand", "--lockstep"},
               "--hand-socket: a user has no lock-step"},
           Bad{{"--socket", socket, "--hand-socket", socket}, "--hand-socket: " + socket},
           Bad{{"--socket", socket, "--hand-socket", "/nowhere/hand"}, "--hand-socket: /nowhere"},
           Bad{{"--socket", socket, "--personality", "touch"}, "--personality: touch"},
           Bad{{"--socket", socket, "--front", "pigeon"}, "--front: pigeon"},
           Bad{{"--socket", socket, "--rate", "3000"}, "--rate: 3000"},
           Bad{{"--socket", socket, "--rate", "0"}, "--rate: 0"},
           Bad{{"--socket", socket, "--rate", "500"}, "--rate: the device runs by its own clock"},
           Bad{{"--socket", socket, "--lockstep", "--packet-cycles", "8"},
               "--packet-cycles: lock-step"},
           Bad{{"--front", "fuse", "--mount", "/nowhere", "--packet-cycles", "8"},
               "--packet-cycles: front fuse has no"},
           Bad{{"--socket", socket, "--personality", "woodenhaptics", "--packet-bytes", "64"},
               "--packet-bytes: front socket has no"},
           Bad{{"--socket", socket, "--seconds", "-1"}, "--seconds"},
           Bad{{"--socket", socket, "--unit-mm", "nan"}, "--unit-mm"},
           Bad{{"--socket", socket, "--unit-mm", "big"}, "--unit-mm"},
           Bad{{"--socket", socket, "--priority", "100"}, "--priority"},
           Bad{{"--socket", socket, "--hand", "/nowhere.toml"}, "/nowhere.toml"},
           Bad{{"--front", "fuse", "--mount", "/tmp", "--lockstep", "--fault",
                KERF_FAULTS_DIR "/silence.toml"},
               "--fault: in lock-step"},
           Bad{{"--socket", socket, "--lockstep", "--fault", KERF_FAULTS_DIR "/late_host.toml"},
               "late_host.toml: host_late: no device"},
           Bad{{"--socket", socket, "--fault", KERF_FAULTS_DIR "/late_host.toml"},
               "late_host.toml: host_late: no device"},
           Bad{{"--socket", "/nowhere/socket"}, "--socket: /nowhere/socket"},
           Bad{{"--front", "udp"}, "--udp"},
           Bad{{"--front", "udp", "--udp", "harbour"}, "--udp: harbour"},
           Bad{{"--front", "usbip"}, "--front usbip: not for omni; use --personality falcon"},
           Bad{{"--front", "uhid", "--personality", "falcon"}, "--front uhid: not for falcon"},
           Bad{{"--front", "uhid", "--personality", "woodenhaptics", "--lockstep"}, "--lockstep"},
           Bad{{"--socket", socket, "--bus-fault", "1:vanish"}, "--bus-fault: front socket has no"},
           Bad{{"--front", "udp", "--udp", "0", "--bus-fault", "1:vanish"}, "--bus-fault"},
           Bad{{"--socket", socket, "--mount", "/tmp"}, "--mount: front socket has no"},
           Bad{{"--socket", socket, "--drift-ppm", "5"}, "--drift-ppm"},
           Bad{{"--socket", socket, "--packet-hz", "1000"}, "--packet-hz"},
           Bad{{"--socket", socket, "--reset-stops-stream"}, "--reset-stops-stream"},
           Bad{{"--socket", socket, "--personality", "falcon", "--firmware-runs"},
               "--firmware-runs: front socket"},
           Bad{{"--socket", socket, "--udp", "5000"}, "--udp: front socket"},
           Bad{{"--front", "udp", "--udp", "0", "--socket", socket}, "--socket: front udp"},
           Bad{{"--socket", socket, "--mode-hz", "80"}, "--mode-hz"},
           Bad{{"--socket", socket, "--joint-inertia", "-1"}, "--joint-inertia"},
           Bad{{"--socket", socket, "--tip-mass", "0"}, "--tip-mass"},
           Bad{{"--socket", socket, "--hand-mass", "nan"}, "--hand-mass"},
           Bad{{"--socket", socket, "--hand-stiffness", "11"}, "--hand-stiffness"},
           Bad{{"--socket", socket, "--output-delay", "65"}, "--output-delay"},
           Bad{{"--socket", socket, "--input-delay", "1.5"}, "--input-delay: 1.5 is not whole"},
           Bad{{"--socket", socket, "--personality", "falcon", "--rate", "2000"}, "--rate: 2000"},
           Bad{{"--socket", socket, "--personality", "falcon", "--pot-noise"}, "--pot-noise"},
           Bad{{"--socket", socket, "--wireless-button"}, "--wireless-button"},
           Bad{{"--socket", socket, "--packet-bytes", "64"}, "--packet-bytes"},
           Bad{{"--socket", socket, "--personality", "woodenhaptics", "--packet-bytes", "8"},
               "--packet-bytes: 8"},
           Bad{{"--socket", socket, "--personality", "woodenhaptics", "--drop-torque"},
               "--drop-torque"},
       }) {
    CAPTURE(place);
    const Outcome outcome = run(arguments);
    CAPTURE(outcome.err);
    CHECK(outcome.exit_code == 2);
    CHECK(outcome.err.find("kerf-emulator: ") == 0);
    CHECK(outcome.err.find(place) != std::string::npos);
    CHECK(outcome.err.find(';') != std::string::npos);
    CHECK(outcome.err.find('\n') == outcome.err.size() - 1);
    CHECK_FALSE(std::filesystem::exists(socket));
  }
}

TEST_CASE("help and version print and end well") {
  CHECK(run({"--help"}).exit_code == 0);
  CHECK(run({"--help"}).out.find("--lockstep") != std::string::npos);
  CHECK(run({"--version"}).exit_code == 0);
  CHECK(run({"--version"}).out == "kerf-emulator " KERF_VERSION "\n");
}

TEST_CASE("a lock-step run ends with its client and leaves the same report twice") {
  const SocketPath path("program");
  const SocketPath report("program-report.json");
  std::vector<std::string> reports;
  for (int round = 0; round < 2; ++round) {
    Outcome outcome;
    std::thread emulator([&] {
      outcome = run({"--socket", path.text(), "--hand", KERF_HANDS "/slide.toml", "--lockstep",
                     "--unit-mm", "2", "--report", report.text()});
    });
    FakeHost host(path.text());
    for (int tick = 0; tick < 3000 && host.receive(); ++tick) {
      host.send({{}, true, OmniCommand::Light::steady});
    }
    CHECK(host.receive().has_value());
    host.leave();
    emulator.join();
    CHECK(outcome.exit_code == 0);
    CHECK(outcome.err == "");
    CHECK_FALSE(std::filesystem::exists(path.text()));
    reports.push_back(text_of(report.text()));
  }
  CHECK(reports[0].find("\"packets_sent\": 3001") != std::string::npos);
  CHECK(reports[0].find("\"undocked_at_s\": 0.05") != std::string::npos);
  CHECK(reports[0] == reports[1]);
}

TEST_CASE("a real-time run ends after its seconds, and a stop request ends a waiting one") {
  const SocketPath path("seconds");
  const SocketPath report("seconds-report.json");
  const SocketPath faults("seconds-faults.toml");
  std::ofstream(faults.text())
      << "clock = \"start\"\n[[fault]]\nkind = \"lose\"\nfor_s = 1\nevery = 10\n";
  Outcome outcome;
  std::thread emulator([&] {
    outcome = run({"--socket", path.text(), "--seconds", "0.2", "--priority", "0", "--stay",
                   "--fault", faults.text(), "--report", report.text()});
  });
  FakeHost host(path.text());
  int received = 0;
  while (host.receive()) ++received;
  CHECK(host.ended());
  emulator.join();
  CHECK(outcome.exit_code == 0);
  CHECK(received <= 360);  // 2 kHz, each tenth lost
  CHECK(received >= 100);  // more would be luck on a machine under load
  for (const char* const part :
       {"\"packets_withheld\": 40", "\"kind\": \"lose\"", "\"changed\": 40"}) {
    CHECK(text_of(report.text()).find(part) != std::string::npos);
  }

  std::atomic<bool> stop{false};
  std::thread waiting([&] { outcome = run({"--socket", path.text(), "--priority", "0"}, stop); });
  while (!std::filesystem::exists(path.text())) std::this_thread::yield();
  stop = true;
  waiting.join();
  CHECK(outcome.exit_code == 0);
  CHECK_FALSE(std::filesystem::exists(path.text()));
}

TEST_CASE("a report never takes the place of a script") {
  const SocketPath path("script-report"), hand("hand"), fault("fault");
  for (const SocketPath* script : {&hand, &fault}) std::ofstream(script->text()) << "mine";
  std::atomic<bool> stop{true};
  for (const SocketPath* script : {&hand, &fault}) {
    const Outcome outcome = run({"--socket", path.text(), "--hand", hand.text(), "--fault",
                                 fault.text(), "--report", script->text()},
                                stop);
    CHECK(outcome.exit_code == 2);
    CHECK(outcome.err.find("is a file of this run itself") != std::string::npos);
    CHECK(text_of(script->text()) == "mine");
  }
}

TEST_CASE("a report that cannot be written is exit code 2") {
  const SocketPath path("no-report");
  std::atomic<bool> stop{true};
  const Outcome outcome =
      run({"--socket", path.text(), "--priority", "0", "--report", "/nowhere/report.json"}, stop);
  CHECK(outcome.exit_code == 2);
  CHECK(outcome.err.find("kerf-emulator: /nowhere/report.json") != std::string::npos);
}
