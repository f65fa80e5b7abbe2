// SPDX-License-Identifier: Apache-2.0
// Every signal that asks for the end, in every program: it ends in order and leaves nothing behind.
#include <chrono>
#include <csignal>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include <doctest/doctest.h>

#include "tests/programs/pair.hpp"

using kerf::test::eventually;
using kerf::test::kBin;
using kerf::test::kScenes;
using kerf::test::Pair;
using kerf::test::Process;
using kerf::test::TemporaryFolder;
using namespace std::chrono_literals;

namespace {

/// All that ask; of the real-time signals both ends and one between.
const std::vector<int> kAsking{SIGINT,  SIGTERM,   SIGHUP,    SIGALRM,      SIGUSR1,
                               SIGUSR2, SIGXCPU,   SIGVTALRM, SIGPROF,      SIGIO,
                               SIGPWR,  SIGSTKFLT, SIGRTMIN,  SIGRTMIN + 7, SIGRTMAX};

bool holds_unfinished_files(const std::filesystem::path& folder) {
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.path().string().find(".new") != std::string::npos) return true;
  }
  return false;
}

}  // namespace

TEST_CASE("each of them ends an emulator: exit 0, its report, no socket") {
  for (const int signal : kAsking) {
    CAPTURE(signal);
    const TemporaryFolder folder;
    const std::string socket = (folder / "port").string();
    Process emulator({kBin + "/kerf-emulator", "--socket", socket, "--report",
                      (folder / "emulator.json").string()},
                     folder / "log");
    REQUIRE(eventually([&] { return std::filesystem::exists(socket); }, 10s));
    emulator.signal(signal);
    CHECK(emulator.wait() == 0);
    CHECK_FALSE(std::filesystem::exists(socket));
    CHECK(std::filesystem::exists(folder / "emulator.json"));
    CHECK_FALSE(holds_unfinished_files(folder.path()));
  }
}

TEST_CASE("each of them ends a recorder: exit 0, a whole recording, its report") {
  Pair pair;
  pair.scene = kerf::test::small_scene(pair.folder);
  pair.start("touch.toml", {});
  REQUIRE(pair.ticks_within(20s));
  for (const int signal : kAsking) {
    CAPTURE(signal);
    const TemporaryFolder folder;
    Process recorder({kBin + "/kerf-recorder", "--name", pair.name, "--out",
                      (folder / "recording").string(), "--report", (folder / "r.json").string()},
                     folder / "log");
    REQUIRE(eventually([&] { return std::filesystem::exists(folder / "recording/manifest.json"); },
                       10s));
    recorder.signal(signal);
    CHECK(recorder.wait() == 0);
    CHECK(kerf::test::text_of(folder / "r.json").find("\"stopped\"") != std::string::npos);
    CHECK(kerf::test::text_of(folder / "recording/manifest.json").find("\"stopped\"") !=
          std::string::npos);
    CHECK_FALSE(holds_unfinished_files(folder.path()));
  }
}

TEST_CASE("each of them ends a controller that pushes: exit 0, a report, no socket") {
  for (const int signal : {SIGVTALRM, SIGIO, SIGRTMAX}) {
    CAPTURE(signal);
    Pair pair;
    pair.scene = kerf::test::small_scene(pair.folder);
    pair.start("touch.toml", {});
    REQUIRE(pair.ticks_within(20s));
    pair.controller->signal(signal);
    CHECK(pair.controller->wait() == 0);
    CHECK(pair.report()["end"] == "stopped");
    CHECK_FALSE(std::filesystem::exists(kerf::segment_socket(pair.name)));
    CHECK_FALSE(holds_unfinished_files(pair.folder.path()));
  }
}

TEST_CASE("some of them end a visualizer without a window: exit 0, whole pictures") {
  if (!std::filesystem::exists(kBin + "/kerf-visualizer")) {
    MESSAGE("skipped: kerf-visualizer was not built (a library is missing)");
    return;
  }
  Pair pair;
  pair.scene = kerf::test::small_scene(pair.folder);
  pair.start("touch.toml", {});
  REQUIRE(pair.ticks_within(20s));
  for (const int signal : {SIGHUP, SIGUSR1, SIGPROF, SIGRTMIN}) {
    CAPTURE(signal);
    Process viewer({kBin + "/kerf-visualizer", "--name", pair.name, "--headless", "--size",
                    "160x120", "--out", (pair.folder / "frames").string()},
                   pair.folder / "viewer.log");
    REQUIRE(eventually([&] { return std::filesystem::exists(pair.folder / "frames"); }, 20s));
    std::this_thread::sleep_for(300ms);
    viewer.signal(signal);
    CHECK(viewer.wait() == 0);
    CHECK_FALSE(holds_unfinished_files(pair.folder / "frames"));
  }
}

TEST_CASE("an emulator without a hand: the controller says within 2 s what it waits for, once") {
  Pair pair;
  const std::string socket = (pair.folder / "port").string();
  pair.emulator.emplace(std::vector<std::string>{kBin + "/kerf-emulator", "--personality", "falcon",
                                                 "--socket", socket},
                        pair.folder / "emulator.log");
  pair.controller.emplace(
      std::vector<std::string>{kBin + "/kerf-controller", "--scene",
                               kerf::test::small_scene(pair.folder), "--device", "falcon",
                               "--torque-scale", "1,1,1", "--port", "socket:" + socket, "--name",
                               pair.name, "--report", (pair.folder / "report.json").string()},
      pair.folder / "controller.log");
  REQUIRE(pair.ticks_within(20s));
  const std::string line =
      "kerf-controller: waiting until homed: pull the grip all the way out, then push it in\n";
  const auto times_told = [&] {
    int times = 0;
    const std::string text = pair.controller->output();
    for (std::size_t at = text.find(line); at != std::string::npos; at = text.find(line, at + 1)) {
      ++times;
    }
    return times;
  };
  CHECK(eventually([&] { return times_told() > 0; }, 10s));
  std::this_thread::sleep_for(1500ms);
  CHECK(times_told() == 1);
  pair.controller->signal(SIGTERM);
  CHECK(pair.controller->wait() == 0);
  CHECK(pair.report()["waiting"] ==
        "waiting until homed: pull the grip all the way out, then push it in");
}
