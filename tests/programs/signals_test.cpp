// SPDX-License-Identifier: Apache-2.0
// Every signal that asks for the end, in every program: it ends in order and leaves nothing behind.
#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include <doctest/doctest.h>

#include "tests/json.hpp"
#include "tests/programs/pair.hpp"

namespace kerf::signals_test {

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

/// Of a controller that loads a tooth of ten million voxels, and finds no device.
std::vector<std::string> without_device(const TemporaryFolder& folder, const std::string& name) {
  return {kBin + "/kerf-controller",
          "--scene",
          kScenes + "/touch.toml",
          "--torque-scale",
          kerf::test::kTorqueScale,
          "--port",
          "socket:" + (folder / "none").string(),
          "--name",
          name};
}

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

TEST_CASE("before there is a device: exit 0, one line and a report of what was under way") {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    for (const bool loaded : {false, true}) {
      CAPTURE(signal);
      CAPTURE(loaded);
      const TemporaryFolder folder;
      const std::string name = kerf::test::unique_name();
      auto line = without_device(folder, name);
      line.insert(line.end(), {"--report", (folder / "report.json").string()});
      Process controller(line, folder / "log");
      REQUIRE(eventually([&] { return controller.catches(signal); }, 10s));
      if (loaded) {
        REQUIRE(
            eventually([&] { return std::filesystem::exists(kerf::segment_socket(name)); }, 20s));
      }
      controller.signal(signal);
      CHECK(controller.wait() == 0);
      const std::string waiting = loaded ? "waiting for a device that answers at --port socket:" +
                                               (folder / "none").string()
                                         : "loading " + kScenes + "/touch.toml";
      CHECK(controller.output() == "kerf: stopped before there was a device; " + waiting + "\n");
      const auto report = kerf::test::read_json_file(folder / "report.json");
      CHECK(report["end"] == "stopped");
      CHECK(report["waiting"] == waiting);
      CHECK(report["ticks"] == 0);
      CHECK(report["device"] == (loaded ? "omni" : ""));
      CHECK_FALSE(std::filesystem::exists(kerf::segment_socket(name)));
      CHECK_FALSE(holds_unfinished_files(folder.path()));
    }
  }
}

TEST_CASE("a probe that is stopped before its device answers has seen none: one line and exit 1") {
  const TemporaryFolder folder;
  const std::string port = "socket:" + (folder / "none").string();
  Process probe({kBin + "/kerf-controller", "--probe", "--device", "omni", "--port", port,
                 "--report", (folder / "probe.json").string()},
                folder / "log");
  REQUIRE(eventually([&] { return probe.catches(SIGINT); }, 10s));
  probe.signal(SIGINT);
  CHECK(probe.wait() == 1);
  const std::string waiting = "waiting for a device that answers at --port " + port;
  CHECK(probe.output() == "kerf: stopped before there was a device; " + waiting + "\n");
  const auto report = kerf::test::read_json_file(folder / "probe.json");
  CHECK(report["waiting"] == waiting);
  CHECK(report["device"] == "omni");
}

TEST_CASE("a path with control characters is told on one line, and moves no cursor") {
  const TemporaryFolder folder;
  const std::string socket = (folder / "a\nb\x1b[31m").string();
  const std::string told = (folder / "a\\nb\\x1b[31m").string();
  {
    Process emulator({kBin + "/kerf-emulator", "--socket", socket, "--priority", "0"},
                     folder / "log");
    REQUIRE(eventually([&] { return std::filesystem::exists(socket); }, 10s));
    emulator.signal(SIGTERM);
    CHECK(emulator.wait() == 0);
    CHECK(emulator.output() == "kerf-emulator: omni at " + told + "\n");
  }
  {
    Process nowhere(
        {kBin + "/kerf-emulator", "--socket", (folder / "no\n/port").string(), "--priority", "0"},
        folder / "log");
    CHECK(nowhere.wait() == 2);
    CHECK(nowhere.output().starts_with(
        "kerf-emulator: --socket: " + (folder / "no\\n/port").string() + ": "));
  }
  auto line = without_device(folder, kerf::test::unique_name());
  *std::ranges::find(line, "socket:" + (folder / "none").string()) = "socket:" + socket;
  Process controller(line, folder / "log");
  const std::string waits = "waiting for a device that answers at --port socket:" + told;
  REQUIRE(eventually([&] { return controller.output().find(waits) != std::string::npos; }, 20s));
  controller.signal(SIGTERM);
  CHECK(controller.wait() == 0);
  CHECK(controller.output() ==
        "kerf-controller: " + waits + "\nkerf: stopped before there was a device; " + waits + "\n");
}

TEST_CASE("readers of a controller that is stopped before its device see a clean end") {
  const TemporaryFolder folder;
  const std::string name = kerf::test::unique_name();
  Process controller(without_device(folder, name), folder / "log");
  REQUIRE(eventually([&] { return std::filesystem::exists(kerf::segment_socket(name)); }, 20s));
  const auto connection = kerf::connect_segment(name);
  controller.signal(SIGTERM);
  CHECK(controller.wait() == 0);
  CHECK(connection.reader().lifecycle() == kerf::Lifecycle::clean_end);
}

TEST_CASE("a check that is stopped has checked nothing: one line and exit 2") {
  for (const char* const look : {"--check", "--explain"}) {
    CAPTURE(look);
    const TemporaryFolder folder;
    auto line = without_device(folder, kerf::test::unique_name());
    line.emplace_back(look);
    Process controller(line, folder / "log");
    REQUIRE(eventually([&] { return controller.catches(SIGTERM); }, 10s));
    controller.signal(SIGTERM);
    CHECK(controller.wait() == 2);
    CHECK(controller.output().ends_with(": reading it was stopped by a signal; start again\n"));
  }
}

TEST_CASE("a report is looked at before anything is loaded: it is also that of an early end") {
  const TemporaryFolder folder;
  const std::string scene = (folder / "scene.json").string();
  std::ofstream(scene) << "[[volume]]\nfile = \"none.nrrd\"\n[[tool]]\nname = \"a\"\n"
                          "shape = \"ball\"\nsize_vox = 8\n";
  auto line = without_device(folder, kerf::test::unique_name());
  line[2] = scene;
  line.insert(line.end(), {"--report", scene});
  Process controller(line, folder / "log");
  CHECK(controller.wait() == 2);
  CHECK(controller.output().find("is a file of this run itself") != std::string::npos);
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
    REQUIRE(eventually([&] { return viewer.catches(signal); }, 60s));
    REQUIRE(eventually([&] { return std::filesystem::exists(pair.folder / "frames"); }, 60s));
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

}  // namespace kerf::signals_test
