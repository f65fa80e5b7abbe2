// SPDX-License-Identifier: Apache-2.0
// Programs where the system gives less than they need, or would give away more than they want.
#include <algorithm>
#include <csignal>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include <doctest/doctest.h>
#include <sys/stat.h>

#include "tests/json.hpp"
#include "tests/programs/pair.hpp"

namespace kerf::limits_test {

using kerf::test::eventually;
using kerf::test::kBin;
using kerf::test::kScenes;
using kerf::test::kTorqueScale;
using kerf::test::Process;
using kerf::test::TemporaryFolder;
using namespace std::chrono_literals;

namespace {

/// `arguments` as a shell runs them after `before`, in the same process.
std::vector<std::string> after(const std::string& before, const std::vector<std::string>& program) {
  std::vector<std::string> arguments{"/bin/bash", "-c", before + "; exec \"$@\"", "sh"};
  arguments.insert(arguments.end(), program.begin(), program.end());
  return arguments;
}

/// Ends by itself or by SIGTERM; false where neither. Before it catches that, the system would end
/// it without a word.
bool ends_on_term(Process& process) {
  const auto ready = [&] { return process.ends_within(0ms) || process.catches(SIGTERM); };
  if (!kerf::test::eventually(ready, 120s)) return false;
  std::this_thread::sleep_for(300ms);
  process.signal(SIGTERM);
  return process.ends_within(60s);
}

std::vector<std::string> controller_at(const TemporaryFolder& folder, const std::string& port,
                                       const std::string& name) {
  return {kBin + "/kerf-controller",
          "--scene",
          kerf::test::small_scene(folder),
          "--torque-scale",
          kTorqueScale,
          "--port",
          port,
          "--name",
          name};
}

mode_t rights_of(const std::filesystem::path& path) {
  struct stat status {};
  REQUIRE(lstat(path.c_str(), &status) == 0);
  return status.st_mode & 07777;
}

/// The system's loader had too few files for the program's libraries.
constexpr int kNotLoaded = 127;

}  // namespace

TEST_CASE("few open files: one line that names the way out and exit 2, and SIGTERM always ends") {
  for (const int files : {4, 5, 6, 7, 8, 10}) {
    CAPTURE(files);
    const TemporaryFolder folder;
    const std::string few = "ulimit -n " + std::to_string(files);
    const std::string name = kerf::test::unique_name();
    Process controller(
        after(few, controller_at(folder, "socket:" + (folder / "none").string(), name)),
        folder / "log");
    // The first limits are met at once; where there are files enough it waits for its device.
    REQUIRE(((files <= 7 && controller.ends_within(60s)) || ends_on_term(controller)));
    const std::string line = controller.output();
    CAPTURE(line);
    CHECK(std::count(line.begin(), line.end(), '\n') <= 1);
    const int code = controller.wait();
    // Had all it needs, and was asked to end while it waited.
    if (files > 7 && line.starts_with("kerf: stopped before there was a device; ")) {
      CHECK(code == 0);
      continue;
    }
    if (code == kNotLoaded) continue;  // a test may be given more open files than its own three
    CHECK(code == 2);
    CHECK(line.find("Too many open files") != std::string::npos);
    CHECK(line.find("; raise ulimit -n\n") != std::string::npos);
    CHECK_FALSE(std::filesystem::exists(kerf::segment_socket(name)));
  }
}

TEST_CASE("little memory: one line that names the way out and exit 2") {
  const TemporaryFolder folder;
  [[maybe_unused]] int refusals = 0;
  for (const int mib : {60, 70}) {
    CAPTURE(mib);
    std::vector<std::string> servo =
        controller_at(folder, "socket:" + (folder / "none").string(), kerf::test::unique_name());
    servo[2] = kScenes + "/touch.toml";  // a tooth of ten million voxels
    Process controller(after("ulimit -v " + std::to_string(mib * 1024), servo), folder / "log");
    REQUIRE((controller.ends_within(20s) || ends_on_term(controller)));
    const int code = controller.wait();
    const std::string line = controller.output();
    CAPTURE(line);
    if (code == 127) continue;  // not even its libraries fit
    CHECK(std::count(line.begin(), line.end(), '\n') <= 1);
    if (code == 0) continue;  // had enough, and was asked to end
    CHECK(code == 2);
    CHECK(line.find("raise ulimit -v") != std::string::npos);
    ++refusals;
  }
#ifndef KERF_SANITIZED  // needs far more than that for itself
  CHECK(refusals >= 1);
#endif
}

TEST_CASE("no thread left: one line that names the way out and exit 2, never a hang" *
          doctest::test_suite("network")) {
  if (geteuid() != 0) {
    MESSAGE("skipped: a limit of threads needs a user with no other process; run as root");
    return;
  }
  const TemporaryFolder folder;
  const TemporaryFolder runtime;
  constexpr uid_t kNobodyElse = 54321;
  REQUIRE(chmod(folder.path().c_str(), 0755) == 0);  // the scene is read there
  REQUIRE(chown(runtime.path().c_str(), kNobodyElse, kNobodyElse) == 0);
  const std::string port = std::to_string(20'000 + getpid() % 40'000);
  int refusals = 0, runs = 0;
  for (int threads = 1; threads <= 6; ++threads) {
    CAPTURE(threads);
    const Process emulator({kBin + "/kerf-emulator", "--front", "udp", "--udp", port, "--hand",
                            kScenes + "/hands/touch.toml"},
                           folder / "emulator.log");
    const std::string few = "export XDG_RUNTIME_DIR=" + runtime.path().string() +
                            " KERF_DATA=/nonexistent; ulimit -u " + std::to_string(threads);
    std::vector<std::string> servo =
        controller_at(folder, "udp:" + port, kerf::test::unique_name());
    servo.insert(servo.begin(),
                 {"/usr/bin/setpriv", "--reuid", std::to_string(kNobodyElse), "--clear-groups"});
    servo.insert(servo.end(), {"--seconds", "0.05"});
    Process controller(after(few, servo), folder / "log");
    const bool ends = controller.ends_within(60s);
    REQUIRE((ends || ends_on_term(controller)));
    const std::string text = controller.output();
    CAPTURE(text);
    if (controller.wait() == 2) {
      ++refusals;
      CHECK(text.find("threads: Resource temporarily unavailable; raise ulimit -u") !=
            std::string::npos);
    } else {
      ++runs;
    }
  }
  CHECK(refusals >= 2);
  CHECK(runs >= 1);
}

#ifndef KERF_SANITIZED  // whose frames are larger, and which runs before main
TEST_CASE("a small stack: each program says so, one line and exit 2, instead of a crash") {
  const TemporaryFolder folder;
  for (const auto& entry : std::filesystem::directory_iterator(kBin)) {
    const std::string program = entry.path().filename().string();
    if (!program.starts_with("kerf-")) continue;
    CAPTURE(program);
    Process small(after("ulimit -s 64", {entry.path().string(), "--help"}), folder / "log");
    CHECK(small.wait() == 2);
    CHECK(small.output() == program + ": stack: 64 KiB are too few; raise ulimit -s to 1024\n");
    Process enough(after("ulimit -s 1024", {entry.path().string(), "--help"}), folder / "log");
    CHECK(enough.wait() == 0);
  }
}

TEST_CASE("a stack that is just enough loads a scene, runs and reports") {
  const TemporaryFolder folder;
  const std::string socket = (folder / "port").string();
  Process emulator(after("ulimit -s 1024", {kBin + "/kerf-emulator", "--socket", socket, "--hand",
                                            kScenes + "/hands/touch.toml"}),
                   folder / "emulator.log");
  auto servo = controller_at(folder, "socket:" + socket, kerf::test::unique_name());
  servo.insert(servo.end(), {"--seconds", "0.3", "--report", (folder / "report.json").string()});
  Process controller(after("ulimit -s 1024", servo), folder / "controller.log");
  CHECK(kerf::test::ended_well(controller, folder / "report.json"));
  CHECK(kerf::test::read_json_file(folder / "report.json")["ticks"] == 300);
}
#endif

TEST_CASE("no file may grow: each program says so of its standard output, and is not killed") {
  const TemporaryFolder folder;
  const std::string log = (folder / "log").string();
  for (const auto& entry : std::filesystem::directory_iterator(kBin)) {
    const std::string program = entry.path().filename().string();
    if (!program.starts_with("kerf-")) continue;
    CAPTURE(program);
    const std::string before =
        "exec 2> >(exec cat >'" + log + "') >'" + (folder / "out").string() + "'; ulimit -f 0";
    Process help(after(before, {entry.path().string(), "--help"}), folder / "shell.log");
    CHECK(help.wait() == 2);
    const std::string line = program + ": standard output: File too large; raise ulimit -f\n";
    CHECK(eventually([&] { return kerf::test::text_of(log) == line; }, 5s));
  }
}

TEST_CASE("without standard descriptors nothing else takes their numbers, and all runs") {
  const TemporaryFolder folder;
  const std::string closed = "exec <&- >&- 2>&-";
  const std::string socket = (folder / "port").string();
  const std::string name = kerf::test::unique_name();
  Process emulator(after(closed, {kBin + "/kerf-emulator", "--socket", socket, "--hand",
                                  kScenes + "/hands/touch.toml"}),
                   folder / "emulator.log");
  auto servo = controller_at(folder, "socket:" + socket, name);
  servo.insert(servo.end(), {"--report", (folder / "report.json").string()});
  Process controller(after(closed, servo), folder / "controller.log");
  REQUIRE(eventually([&] { return std::filesystem::exists(kerf::segment_socket(name)); }, 20s));
  Process recorder(after(closed, {kBin + "/kerf-recorder", "--name", name, "--out",
                                  (folder / "recording").string()}),
                   folder / "recorder.log");
  REQUIRE(
      eventually([&] { return std::filesystem::exists(folder / "recording/manifest.json"); }, 10s));
  for (const Process* program : {&emulator, &controller, &recorder}) {
    for (const int number : {0, 1, 2}) CHECK(program->descriptor(number) == "/dev/null");
  }
  for (Process* program : {&recorder, &controller, &emulator}) {
    program->signal(SIGTERM);
    CHECK(program->wait() == 2);  // what it had to tell is lost
  }
  const auto report = kerf::test::read_json_file(folder / "report.json");
  CHECK(report["end"] == "stopped");
  CHECK(report["refused_packets"] == 0);
}

TEST_CASE("files have the rights that the umask leaves, sockets belong to their user alone") {
  struct Mask {
    const char* command;
    mode_t file, folder;
  };
  // A mask never takes from users what is their own.
  for (const auto& [mask, file_rights, folder_rights] :
       {Mask{"umask 000", 0666, 0777}, Mask{"umask 022", 0644, 0755},
        Mask{"umask 777", 0600, 0700}}) {
    CAPTURE(mask);
    const TemporaryFolder folder;
    const std::string socket = (folder / "port").string();
    const std::string name = kerf::test::unique_name();
    Process emulator(after(mask, {kBin + "/kerf-emulator", "--socket", socket, "--hand",
                                  kScenes + "/hands/touch.toml", "--report",
                                  (folder / "emulator.json").string()}),
                     folder / "emulator.log");
    REQUIRE(eventually([&] { return std::filesystem::exists(socket); }, 10s));
    CHECK(rights_of(socket) == 0600);
    auto servo = controller_at(folder, "socket:" + socket, name);
    servo.insert(servo.end(), {"--report", (folder / "report.json").string()});
    Process controller(after(mask, servo), folder / "controller.log");
    REQUIRE(eventually([&] { return std::filesystem::exists(kerf::segment_socket(name)); }, 10s));
    CHECK(rights_of(kerf::segment_socket(name)) == 0600);
    Process recorder(after(mask, {kBin + "/kerf-recorder", "--name", name, "--out",
                                  (folder / "recording").string()}),
                     folder / "recorder.log");
    REQUIRE(eventually([&] { return std::filesystem::exists(folder / "recording/manifest.json"); },
                       10s));
    for (Process* program : {&recorder, &controller, &emulator}) {
      program->signal(SIGTERM);
      CHECK(program->wait() == 0);
    }
    for (const char* const file : {"report.json", "emulator.json", "recording/ticks.npy",
                                   "recording/scene.json", "recording/manifest.json"}) {
      CAPTURE(file);
      CHECK(rights_of(folder / file) == file_rights);
    }
    CHECK(rights_of(folder / "recording") == folder_rights);
  }
}

TEST_CASE("an emulator's socket refuses another user in one line, and serves on") {
  if (geteuid() != 0) {
    MESSAGE("skipped: another user is needed; run as root");
    return;
  }
  const TemporaryFolder folder;
  const std::string socket = (folder / "port").string();
  Process emulator({kBin + "/kerf-emulator", "--socket", socket, "--hand",
                    kScenes + "/hands/touch.toml", "--seconds", "20", "--priority", "0"},
                   folder / "emulator.log");
  REQUIRE(eventually([&] { return std::filesystem::exists(socket); }, 10s));
  // Rights that somebody has loosened.
  REQUIRE(chmod(folder.path().c_str(), 0755) == 0);
  REQUIRE(chmod(socket.c_str(), 0666) == 0);
  auto probe = std::vector<std::string>{
      "/usr/bin/setpriv", "--reuid",  "54321", "--clear-groups", kBin + "/kerf-controller",
      "--probe",          "--device", "omni",  "--port",         "socket:" + socket,
      "--seconds",        "0.3"};
  Process stranger(probe, folder / "stranger.log");
  CHECK(stranger.wait() == 2);
  const std::string told = emulator.output();
  CAPTURE(told);
  CHECK(told.find("a client of user 54321 was refused; be user 0 or root\n") != std::string::npos);
  CHECK(std::count(told.begin(), told.end(), '\n') == 2);
  probe.erase(probe.begin(), probe.begin() + 4);
  Process own(probe, folder / "own.log");
  CHECK(own.wait() == 0);
}

TEST_CASE("--seconds ends an emulator that nobody uses") {
  for (const bool lockstep : {false, true}) {
    for (const bool stays : {false, true}) {
      const TemporaryFolder folder;
      for (const std::string front : {"socket", "udp"}) {
        CAPTURE(front);
        std::vector<std::string> options{kBin + "/kerf-emulator",
                                         "--front",
                                         front,
                                         "--seconds",
                                         "0.2",
                                         "--" + front,
                                         front == "udp" ? "0" : (folder / "port").string()};
        if (lockstep) options.emplace_back("--lockstep");
        if (stays) options.emplace_back("--stay");
        Process emulator(options, folder / "log");
        REQUIRE(emulator.ends_within(60s));
        CHECK(emulator.wait() == 0);
        CHECK_FALSE(std::filesystem::exists(folder / "port"));
      }
    }
  }
}

TEST_CASE("--probe for a device that is not there ends with 1") {
  const TemporaryFolder folder;
  Process probe({kBin + "/kerf-controller", "--probe", "--device", "woodenhaptics", "--report",
                 (folder / "r.json").string()},
                folder / "log");
  const int code = probe.wait();
  const auto devices = kerf::test::read_json_file(folder / "r.json")["devices"];
  const bool is_there = std::ranges::any_of(devices, [](const kerf::test::ReadJson& device) {
    return device["device"] == "woodenhaptics";
  });
  CHECK(code == (is_there ? 0 : 1));
}

}  // namespace kerf::limits_test
