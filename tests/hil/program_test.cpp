// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <chrono>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include <doctest/doctest.h>

#include "hil/program/emulator_options.hpp"
#include "tests/hil/fake_host.hpp"
#include "tests/hil/run_emulator.hpp"
#include "tests/support/errors.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temporary_folder.hpp"

namespace kerf::program_test {
namespace {

using kerf::test::EmulatorRun;
using kerf::test::eventually;
using kerf::test::FakeHost;
using kerf::test::has;
using kerf::test::run_emulator;
using kerf::test::TemporaryFolder;
using kerf::test::text_of;

/// `line` with each `$` as the folder.
std::string in(const TemporaryFolder& folder, std::string line) {
  for (auto at = line.find('$'); at != std::string::npos; at = line.find('$')) {
    line.replace(at, 1, folder.path().string());
  }
  return line;
}

}  // namespace

TEST_CASE("bad input is one line that names location, value and way out, and exit code 2") {
  const TemporaryFolder folder;
  struct Bad {
    std::string line, part;
  };
  const std::string late_host = KERF_FAULTS_DIR "/late_host.toml";
  const std::string wooden = "--personality woodenhaptics ", falcon = "--personality falcon ";
  const std::string fuse = "--front fuse --priority 0 ";
  for (const auto& [line, part] : {
           Bad{"", "--socket"},
           Bad{"--socket $/s --wrong", "--wrong"},
           Bad{"--socket $/s --hand-socket $/h --hand x.toml", "--hand-socket: the hand of --hand"},
           Bad{"--socket $/s --hand-socket $/h --lockstep", "--hand-socket: a user has no lock-"},
           Bad{"--socket $/s --hand-socket $/s", "--hand-socket: $/s"},
           Bad{"--socket $/s --hand-socket /nowhere/hand", "--hand-socket: /nowhere"},
           Bad{"--socket $/s --rate 0", "--rate: 0"},
           Bad{"--socket $/s --rate 500", "--rate: the device runs by its own clock"},
           Bad{"--socket $/s --lockstep --packet-cycles 8", "--packet-cycles: lock-step"},
           Bad{"--socket $/s --seconds -1", "--seconds"},
           Bad{"--socket $/s --unit-mm nan", "--unit-mm"},
           Bad{"--socket $/s --priority 100", "--priority"},
           Bad{"--socket $/s --lockstep --fault " + late_host, "late_host.toml: host_late: no"},
           Bad{"--socket $/s --fault " + late_host, "late_host.toml: host_late: no device"},
           Bad{"--socket $/s --bus-fault 1:vanish", "--bus-fault: front socket has no"},
           Bad{"--socket $/s --mount /tmp", "--mount: front socket has no"},
           Bad{"--socket $/s --drift-ppm 5", "--drift-ppm"},
           Bad{"--socket $/s --reset-stops-stream", "--reset-stops-stream"},
           Bad{"--socket $/s --udp 5000", "--udp: front socket"},
           Bad{"--socket $/s --mode-hz 80", "--mode-hz"},
           Bad{"--socket $/s --identified $/no.toml", "no.toml: not a file"},
           Bad{"--socket $/s --identified $", ": not a file"},
           Bad{"--socket $/s --joint-inertia -1", "--joint-inertia"},
           Bad{"--socket $/s --tip-mass 0", "--tip-mass"},
           Bad{"--socket $/s --hand-mass nan", "--hand-mass"},
           Bad{"--socket $/s --hand-stiffness 11", "--hand-stiffness"},
           Bad{"--socket $/s --output-delay 65", "--output-delay"},
           Bad{"--socket $/s --input-delay 1.5", "--input-delay: 1.5 is not whole"},
           Bad{"--socket $/s --packet-bytes 64", "--packet-bytes"},
           Bad{falcon + "--socket $/s --rate 2000", "--rate: 2000"},
           Bad{falcon + "--socket $/s --pot-noise", "--pot-noise"},
           Bad{falcon + "--socket $/s --firmware-runs", "--firmware-runs: front socket"},
           Bad{wooden + "--socket $/s --packet-bytes 64", "--packet-bytes: front socket has no"},
           Bad{wooden + "--socket $/s --drop-torque", "--drop-torque"},
           Bad{"--front udp --udp 0 --bus-fault 1:vanish", "--bus-fault"},
           Bad{"--front udp --udp 0 --socket $/s", "--socket: front udp"},
           Bad{falcon + "--front uhid", "--front uhid: not for falcon"},
           Bad{wooden + "--front uhid --lockstep", "--lockstep"},
           Bad{fuse, "--mount: missing; name an empty folder"},
           Bad{fuse + "--mount /nowhere --packet-cycles 8", "--packet-cycles: front fuse has no"},
           Bad{fuse + "--mount $ --lockstep --fault " KERF_FAULTS_DIR "/silence.toml",
               "--fault: in lock-step"},
           Bad{fuse + "--mount $ --bus-fault 1:stall", "one of reset, device-reset"},
           Bad{fuse + "--mount $ --packet-hz 3", "--packet-hz"},
           Bad{fuse + "--mount $ --firmware-runs", "--firmware-runs: omni has no such thing"},
           Bad{falcon + fuse + "--mount $ --bus-fault 1:steal", "one of stall, split, deaf"},
           Bad{wooden + fuse + "--mount $ --lockstep", "--lockstep: the USB front runs by its own"},
       }) {
    CAPTURE(line);
    const EmulatorRun run = run_emulator(in(folder, line));
    CAPTURE(run.err);
    CHECK(run.code == 2);
    CHECK(run.err.starts_with("kerf-emulator: "));
    CHECK(has(run.err, in(folder, part)));
    CHECK((has(run.err, ";") || has(run.err, " with one of ")));
    CHECK(run.err.find('\n') == run.err.size() - 1);
    CHECK(folder.count() == 0);
  }
}

TEST_CASE("help, version and the torque of a motor count are printed") {
  CHECK(run_emulator("--help").code == 0);
  CHECK(has(run_emulator("--help").out, "--lockstep"));
  CHECK(run_emulator("--version").code == 0);
  CHECK(run_emulator("--version").out == "kerf-emulator " KERF_VERSION "\n");
  CHECK(run_emulator("--describe").out == "torque_scale=0.342,0.342,0.342\n");
  CHECK(run_emulator("--personality falcon --describe").out == "torque_scale=0.1,0.1,0.1\n");
  CHECK(run_emulator("--personality woodenhaptics --describe").out ==
        "torque_scale=0.4144,0.3108,0.3108\n");
}

TEST_CASE("a lock-step run ends with its client and leaves the same report twice") {
  const TemporaryFolder folder;
  std::vector<std::string> reports;
  for (int round = 0; round < 2; ++round) {
    EmulatorRun run;
    std::thread emulator([&] {
      run = run_emulator(in(folder, "--socket $/s --hand " KERF_HANDS
                                    "/slide.toml --lockstep --unit-mm 2 --report $/report.json"));
    });
    FakeHost host((folder / "s").string());
    for (int tick = 0; tick < 3000 && host.receive(); ++tick) {
      host.send({{}, true, OmniCommand::Light::steady});
    }
    CHECK(host.receive().has_value());
    host.leave();
    emulator.join();
    CHECK(run.code == 0);
    CHECK(run.err == "");
    CHECK_FALSE(std::filesystem::exists(folder / "s"));
    reports.push_back(text_of(folder / "report.json"));
  }
  CHECK(has(reports[0], "\"packets_sent\": 3001"));
  CHECK(has(reports[0], "\"undocked_at_s\": 0.05"));
  CHECK(reports[0] == reports[1]);
}

TEST_CASE("a real-time run ends after its seconds, and a stop request ends a waiting one") {
  const TemporaryFolder folder;
  folder.write("faults.toml",
               "clock = \"start\"\n[[fault]]\nkind = \"lose\"\nfor_s = 1\nevery = 10\n");
  EmulatorRun run;
  // A machine that is busy for all of the 0.2 s shows nothing but their end.
  const auto had_time = [&] {
    std::filesystem::remove(folder / "report.json");
    std::thread emulator([&] {
      run = run_emulator(in(folder,
                            "--socket $/s --seconds 0.2 --priority 0 --stay --fault "
                            "$/faults.toml --report $/report.json"));
    });
    FakeHost host((folder / "s").string());
    int received = 0;
    while (host.receive()) ++received;
    CHECK(host.ended());
    emulator.join();
    CHECK(run.code == 0);
    CHECK(received <= 360);  // 2 kHz, each tenth lost
    const std::string report = text_of(folder / "report.json");
    return received >= 100 && has(report, "\"packets_withheld\": 40") &&
           has(report, "\"kind\": \"lose\"") && has(report, "\"changed\": 40");
  };
  CHECK(eventually(had_time, std::chrono::seconds(120)));

  std::atomic<bool> stop{false};
  std::thread waiting([&] { run = run_emulator(in(folder, "--socket $/s --priority 0"), stop); });
  while (!std::filesystem::exists(folder / "s")) std::this_thread::yield();
  stop = true;
  waiting.join();
  CHECK(run.code == 0);
  CHECK_FALSE(std::filesystem::exists(folder / "s"));
}

TEST_CASE("a report that would replace a script, or cannot be written, is exit code 2") {
  const TemporaryFolder folder;
  const std::atomic<bool> stop{true};
  for (const char* script : {"hand", "fault"}) {
    folder.write("hand", "mine");
    folder.write("fault", "mine");
    const EmulatorRun run = run_emulator(
        in(folder, std::string("--socket $/s --hand $/hand --fault $/fault --report $/") + script),
        stop);
    CHECK(run.code == 2);
    CHECK(has(run.err, "is a file of this run itself"));
    CHECK(text_of(folder / script) == "mine");
  }
  const EmulatorRun run =
      run_emulator(in(folder, "--socket $/s --priority 0 --report /nowhere/report.json"), stop);
  CHECK(run.code == 2);
  CHECK(has(run.err, "kerf-emulator: /nowhere/report.json"));
}

}  // namespace kerf::program_test
