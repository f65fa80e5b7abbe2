// SPDX-License-Identifier: Apache-2.0
// kerf-arm as a program: libraries that misbehave, and ends of it and of its controllers. Forces
// are judged by what the library was given, in its ticks.
#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <random>
#include <span>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <doctest/doctest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "controller/device/arm/arm_port.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "shared/text/json.hpp"
#include "shared/wire/cartesian.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temporary_folder.hpp"

namespace kerf::arm_program_test {

using kerf::test::eventually;
using kerf::test::Process;
using kerf::test::RuntimeFolder;
using kerf::test::text_of;
using namespace std::chrono_literals;

namespace {

const std::string kBin = KERF_TEST_BIN;
const std::string kTouchLibrary = std::string(KERF_TEST_LIBRARIES) + "/mock_hd/libHD.so";
const std::string kOmegaLibrary = std::string(KERF_TEST_LIBRARIES) + "/mock_drd/libdrd.so.3";
// A busy machine may stop any thread for longer than a real stall takes; the tests of stalls give
// their own.
constexpr const char* kPatientMs = "5000";

/// A frame that the library has recorded.
struct Frame {
  std::int64_t at_ns = 0;
  long tick = 0;
  bool is_forced = false;
};

struct Bench {
  Bench() { setenv("KERF_MOCK_RECORD", record.c_str(), 1); }
  ~Bench() {
    unsetenv("KERF_MOCK_RECORD");
    unsetenv("KERF_MOCK");
    unsetenv("KERF_MOCK_POSES");
  }

  /// kerf-arm of a device, whose library behaves so.
  [[nodiscard]] std::unique_ptr<Process> arm(const std::string& device,
                                             const std::string& behaviour,
                                             std::vector<std::string> more = {}) {
    setenv("KERF_MOCK", behaviour.c_str(), 1);
    std::vector<std::string> words{kBin + "/kerf-arm", "--device", device};
    if (std::ranges::find(more, "--library") == more.end()) {
      words.insert(words.end(), {"--library", device == "touch" ? kTouchLibrary : kOmegaLibrary});
    }
    if (std::ranges::find(more, "--stall-ms") == more.end()) {
      words.insert(words.end(), {"--stall-ms", kPatientMs});
    }
    words.insert(words.end(), more.begin(), more.end());
    return std::make_unique<Process>(words, folder / ("log" + std::to_string(++logs)));
  }

  [[nodiscard]] std::vector<Frame> frames() const {
    std::vector<Frame> all;
    std::ifstream lines(record);
    for (std::string line; std::getline(lines, line);) {
      std::istringstream words(line);
      Frame frame;
      std::string kind;
      std::array<double, 3> force{};
      words >> frame.at_ns >> kind >> frame.tick >> force[0] >> force[1] >> force[2];
      if (!words || (kind != "frame" && kind != "force")) continue;
      frame.is_forced = force != std::array<double, 3>{};
      all.push_back(frame);
    }
    return all;
  }
  [[nodiscard]] std::string last_call() const {
    std::ifstream lines(record);
    std::string last;
    for (std::string line; std::getline(lines, line);) last = line.substr(line.find(' ') + 1);
    return last;
  }

  RuntimeFolder folder;
  std::filesystem::path record = folder / "record";
  int logs = 0;
};

/// Kills the process that has the library, which is the child of kerf-arm, or kerf-arm if it has
/// none yet.
void kill_library(const Process& arm) {
  const pid_t child = arm.child();
  kill(child > 0 ? child : arm.pid(), SIGKILL);
}

[[nodiscard]] bool runs(const Process& arm) {
  return arm.output().find(" at arm:") != std::string::npos;
}

std::vector<std::uint8_t> pushing() {
  const auto bytes = encode(kerf::CartesianCommand{.force_mn = {500, 0, 0},
                                                   .force_on = true,
                                                   .light = kerf::CartesianCommand::Light::ready,
                                                   .answers = 0});
  return {bytes.begin(), bytes.end()};
}

/// A controller that pushes in every millisecond until it is killed.
class PushingChild {
 public:
  explicit PushingChild(Personality device) : pid_(fork()) {
    if (pid_ != 0) return;
    for (const int number : {SIGSEGV, SIGTERM}) std::signal(number, SIG_DFL);  // not doctest's
    const std::atomic<bool> stop{false};
    ArmPort port(std::string(word_of(device)), {device}, 5000, stop);
    for (;;) {
      std::array<std::uint8_t, kerf::cartesian::kReportBytes> packet;
      while (port.receive(packet) > 0) {
      }
      port.send(pushing());
      kerf::sleep_until_ns(kerf::monotonic_ns() + 1'000'000);
    }
  }
  ~PushingChild() { end(SIGKILL); }
  void end(int number) {
    if (pid_ <= 0) return;
    kill(pid_, number);
    waitpid(pid_, nullptr, WUNTRACED);
    if (number == SIGSTOP) return;
    pid_ = -1;
  }

 private:
  pid_t pid_;
};

}  // namespace

TEST_CASE("arm: every bad library is one line and exit code 2") {
  struct Case {
    const char* device;
    const char* behaviour;
    std::vector<std::string> more;
    const char* says;
  };
  const std::string lacking = std::string(KERF_TEST_LIBRARIES);
  const std::vector<std::string> soon{"--opening-s", "0.4"};
  const std::vector<std::string> stalls{"--stall-ms", "200"};
  const Case cases[] = {
      {"touch", "", {"--library", "/nowhere/libHD.so"}, "/nowhere/libHD.so: cannot open"},
      {"touch", "", {"--library", "/etc/passwd"}, "/etc/passwd: "},
      {"touch", "", {"--library", lacking + "/mock_hd_lacking/libHD.so"}, "lacks hdBeginFrame"},
      {"touch", "", {"--library", kOmegaLibrary}, "lacks hdInitDevice, "},
      {"touch", "hang_open", soon, "does not return from opening"},
      {"touch", "crash_open", {}, "has crashed (SIGSEGV); unplug"},
      {"touch", "overflow_open", {}, "has crashed (SIGSEGV); unplug"},
      {"touch", "overflow=50", {}, "has crashed (SIGSEGV); unplug"},
      {"touch", "resets_crash,crash_open", {}, "has crashed (SIGSEGV); unplug"},
      {"touch", "resets_crash,crash=50", {}, "has crashed (SIGSEGV); unplug"},
      {"touch", "overflow_elsewhere=50", {}, "has crashed (SIGSEGV); unplug"},
      {"touch", "leave=50", {}, "has ended the program by _exit(7); unplug"},
      {"omega", "resets_crash,crash_open", {}, "has crashed (SIGSEGV); unplug"},
      {"omega", "resets_crash,overflow_elsewhere=50", {}, "has crashed (SIGSEGV); unplug"},
      {"omega", "leave=50", {}, "has ended the program by _exit(7); unplug"},
      {"touch", "exit_open", {}, "has ended the program by exit(0); unplug"},
      {"touch", "exit=50", {}, "has ended the program by exit(7); unplug"},
      {"touch", "quick_exit=50", {}, "has ended the program by quick_exit(); unplug"},
      {"omega", "overflow=50", {}, "has crashed (SIGSEGV); unplug"},
      {"omega", "exit_open", {}, "has ended the program by exit(0); unplug"},
      {"omega", "exit=50", {}, "has ended the program by exit(7); unplug"},
      {"omega", "type=60", {}, "device of type 60, Falcon: no omega"},
      {"omega", "", {"--peak", "nan"}, "--peak"},
      {"omega", "", {"--peak", "13"}, "--peak"},
      {"touch", "", {"--peak", "2"}, "--peak: of an omega; "},
      {"touch", "init_error", {}, "cannot be opened (error 300"},
      {"touch", "garbage_handle", {}, "an invalid handle"},
      {"touch", "", {"--rate", "700"}, "--rate 700: not taken by the library (error 101"},
      {"touch", "start_error", {}, "hdStartScheduler: error 304"},
      {"touch", "no_ticks", soon, "has started no frame"},
      {"touch", "unset=100000", {}, "error 401"},
      {"touch", "hang_callback=50", stalls, "callback has stopped"},
      {"touch", "crash=50", {}, "has crashed"},
      {"touch", "error=302@50", {}, "error 302: communication error; check"},
      {"touch", "vanish=50", {}, "error 302"},
      {"touch", "vanish=50,back=60", {}, "error 302"},
      {"touch", "error=204@50,crash_close", {}, "has crashed"},
      {"touch", "error=204@50,hang_close", {}, "error 204"},
      {"omega",
       "",
       {"--library", lacking + "/mock_drd_lacking/libdrd.so.3"},
       "lacks dhdEnableForce"},
      {"omega", "version=4", {}, "SDK 4.17.5.0"},
      {"omega", "hang_open", soon, "does not return from opening"},
      {"omega", "crash_open", {}, "has crashed"},
      {"omega", "init_error", {}, "cannot be opened (error 5"},
      {"omega", "nan=1,vanish=2", {}, "cannot be read any more (error 2"},
      {"omega", "hang_callback=50", stalls, "has not returned"},
      {"omega", "crash=50", {}, "has crashed"},
      {"omega", "vanish=50", {}, "cannot be read any more (error 2"},
  };
  // Each waits for a time of its own, so some of them run side by side.
  constexpr std::size_t kTogether = 16;
  for (std::span<const Case> left(cases); !left.empty();) {
    const std::span<const Case> now = left.first(std::min(kTogether, left.size()));
    left = left.subspan(now.size());
    std::vector<std::unique_ptr<Bench>> benches;
    std::vector<std::unique_ptr<Process>> arms;
    for (const Case& bad : now) {
      benches.push_back(std::make_unique<Bench>());
      arms.push_back(benches.back()->arm(bad.device, bad.behaviour, bad.more));
    }
    for (std::size_t i = 0; i < now.size(); ++i) {
      const Case& bad = now[i];
      CAPTURE(bad.device);
      CAPTURE(bad.behaviour);
      REQUIRE(arms[i]->ends_within(20s));
      CHECK(arms[i]->wait() == 2);
      std::string said = arms[i]->output();
      CAPTURE(said);
      // What it opened, and that this machine gives no real time, may stand before.
      if (said.starts_with("kerf-arm: warning: no right to SCHED_FIFO"))
        said.erase(0, said.find('\n') + 1);
      if (runs(*arms[i])) said.erase(0, said.find('\n') + 1);
      CHECK(said.starts_with("kerf-arm: "));
      CHECK(std::ranges::count(said, '\n') == 1);
      CHECK(said.find(bad.says) != std::string::npos);
    }
  }
}

TEST_CASE("arm: without --library the loader's own search finds it, or names it") {
  Bench bench;
  setenv("KERF_MOCK", "", 1);
  setenv("LD_LIBRARY_PATH", (std::string(KERF_TEST_LIBRARIES) + "/mock_drd").c_str(), 1);
  Process omega({kBin + "/kerf-arm", "--device", "omega", "--seconds", "0.2", "--report",
                 (bench.folder / "omega.json").string()},
                bench.folder / "omega.log");
  CHECK(omega.wait() == 0);
  Process touch({kBin + "/kerf-arm", "--device", "touch"}, bench.folder / "touch.log");
  CHECK(touch.wait() == 2);
  unsetenv("LD_LIBRARY_PATH");
  CHECK(touch.output().starts_with("kerf-arm: libHD.so: "));
  CHECK(touch.output().find("install OpenHaptics") != std::string::npos);
  const auto report = kerf::Json::parse(text_of(bench.folder / "omega.json"));
  CHECK(report.at("facts").at("model").get<std::string>() == "mock omega.3");
  CHECK(report.at("failure").is_null());
}

namespace {

/// Ends a kerf-arm under force by `end`, and checks that the library got zero force for 20 ms and
/// then closed the device.
template <class End>
void check_orderly_end(const std::string& device, const std::string& behaviour, const End& end) {
  CAPTURE(device);
  CAPTURE(behaviour);
  const bool is_touch = device == "touch";
  Bench bench;
  const auto arm = bench.arm(device, behaviour, {"--rate", "1000"});
  REQUIRE(eventually([&] { return runs(*arm); }, 10s));
  PushingChild controller(is_touch ? Personality::touch : Personality::omega);
  REQUIRE(eventually([&] { return std::ranges::count_if(bench.frames(), &Frame::is_forced) > 20; },
                     10s));
  end(*arm);
  const std::string last = is_touch ? "hdDisableDevice" : "drdClose";
  REQUIRE(eventually([&] { return bench.last_call() == last; }, 10s));
  const auto frames = bench.frames();
  const auto last_force = std::ranges::find_if(frames.rbegin(), frames.rend(), &Frame::is_forced);
  REQUIRE(last_force != frames.rend());
  CHECK(frames.back().at_ns - last_force->at_ns >= 20'000'000);
  CHECK(last_force - frames.rbegin() >= 3);
}

}  // namespace

TEST_CASE(
    "arm: asked to end it gives zero force for 20 ms, then closes, whatever the library does with "
    "signals") {
  struct Case {
    const char* device;
    const char* behaviour;
  };
  for (const auto& [device, behaviour] :
       {Case{"touch", ""}, Case{"touch", "sets_signals"}, Case{"touch", "ignores_signals"},
        Case{"touch", "blocks_signals"}, Case{"touch", "sets_signals,unblocks_signals"},
        Case{"touch", "ignores_signals,unblocks_signals"}, Case{"omega", ""},
        Case{"omega", "sets_signals,unblocks_signals"},
        Case{"omega", "ignores_signals,blocks_signals"}}) {
    for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGQUIT}) {
      CAPTURE(number);
      check_orderly_end(device, behaviour, [&](Process& arm) {
        arm.signal(number);
        CHECK(arm.wait() == 0);
      });
    }
  }
}

TEST_CASE("arm: kerf-arm killed by its own number still gives zero force and closes the device") {
  for (const char* const device : {"touch", "omega"}) {
    check_orderly_end(device, "", [](Process& arm) {
      arm.signal(SIGKILL);
      CHECK(arm.wait() == 128 + SIGKILL);
    });
  }
}

// KERF_KILLS: of each device, by hand; in ctest each signal once.
TEST_CASE("arm: zero force within 20 ms of a controller's end, stop or crash; the next one works") {
  constexpr std::array kSignals{SIGKILL, SIGSTOP, SIGSEGV, SIGTERM};
  const char* const wanted = std::getenv("KERF_KILLS");
  const std::size_t kills = wanted != nullptr ? std::stoul(wanted) : kSignals.size();
  std::mt19937_64 random(20261128);
  long longest = 0;
  for (const Personality device : {Personality::touch, Personality::omega}) {
    CAPTURE(word_of(device));
    Bench bench;
    const auto arm = bench.arm(std::string(word_of(device)), "", {"--rate", "1000"});
    REQUIRE(eventually([&] { return runs(*arm); }, 10s));
    for (std::size_t i = 0; i < kills; ++i) {
      const int number = kSignals[i % kSignals.size()];
      CAPTURE(number);
      PushingChild controller(device);
      const auto from = bench.frames().back().tick;
      REQUIRE(eventually(
          [&] {
            const auto frames = bench.frames();
            return frames.back().is_forced && frames.back().tick > from + 20;
          },
          10s));
      std::this_thread::sleep_for(std::chrono::microseconds(random() % 20'000));
      controller.end(number);
      const long tick = bench.frames().back().tick;  // later ones run without it
      REQUIRE(eventually([&] { return bench.frames().back().tick > tick + 40; }, 10s));
      const auto frames = bench.frames();
      const auto last = std::ranges::find_if(frames.rbegin(), frames.rend(), &Frame::is_forced);
      REQUIRE(last != frames.rend());
      longest = std::max(longest, last->tick - tick);
      CHECK(last->tick - tick <= 20);
    }
    arm->signal(SIGTERM);
    CHECK(arm->wait() == 0);
  }
  MESSAGE("longest force after an end, in frames of 1 ms: " << longest);
}

TEST_CASE(
    "arm: if the process with the library is killed, the port closes after a second; the next one "
    "is there at once") {
  Bench bench;
  const std::atomic<bool> stop{false};
  auto arm = bench.arm("touch", "");
  auto port = std::make_unique<ArmPort>("touch", kerf::LinkHello{Personality::touch}, 10'000, stop);
  CHECK(port->wait(1000));
  kill_library(*arm);
  CHECK(arm->wait() == 2);
  CHECK(arm->output().find("kerf-arm: killed, so the device was not closed") != std::string::npos);
  std::array<std::uint8_t, kerf::cartesian::kReportBytes> packet;
  while (port->receive(packet) > 0) {
  }
  CHECK_FALSE(port->closed());  // the servo sees no report: stale_input after 20 ms
  CHECK(eventually(
      [&] {
        static_cast<void>(port->receive(packet));
        return port->closed();
      },
      10s));
  arm = bench.arm("touch", "");
  port.reset();  // its controller has ended by now
  port = std::make_unique<ArmPort>("touch", kerf::LinkHello{Personality::touch}, 10'000, stop);
  CHECK(port->wait(1000));
  CHECK_FALSE(port->closed());
  arm->signal(SIGTERM);
  CHECK(arm->wait() == 0);
  CHECK(port->closed());
}

// KERF_KILLS: as above.
TEST_CASE("arm: killed at any moment, the next adapter is there at once") {
  Bench bench;
  const char* const wanted = std::getenv("KERF_KILLS");
  const std::size_t kills = wanted != nullptr ? std::stoul(wanted) : 4;
  std::mt19937_64 random(20261129);
  for (std::size_t i = 0; i < kills; ++i) {
    const auto arm = bench.arm("touch", "");
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 100'000));
    kill_library(*arm);
    CHECK(arm->wait() != 0);
  }
  const auto arm = bench.arm("touch", "");
  const std::atomic<bool> stop{false};
  ArmPort port("touch", {Personality::touch}, 10'000, stop);
  CHECK(port.wait(1000));
  arm->signal(SIGTERM);
  CHECK(arm->wait() == 0);
  CHECK(std::distance(std::filesystem::directory_iterator(bench.folder / "kerf"), {}) == 0);
}

TEST_CASE("arm: a killed adapter is a lost device to a running controller") {
  Bench bench;
  std::ostringstream poses;  // docked, then up by 0.1 mm in each tick
  for (int tick = 0; tick <= 2500; ++tick) {
    const int lifted = std::max(0, tick - 2000);
    poses << tick << " 0 " << -110 + 0.1 * lifted << " -35 1 0 0 0 1 0 0 0 1 0 " << (lifted < 10)
          << '\n';
  }
  bench.folder.write("poses", poses.str());
  setenv("KERF_MOCK_POSES", (bench.folder / "poses").c_str(), 1);
  const auto arm = bench.arm("touch", "");
  Process controller(
      {kBin + "/kerf-controller", "--scene", std::string(KERF_TEST_SCENES) + "/wall.toml",
       "--device", "touch", "--torque-scale", "1,1,1", "--port", "arm", "--guard", "--report",
       (bench.folder / "run.json").string()},
      bench.folder / "controller.log");
  REQUIRE(eventually(
      [&] {
        const auto all = bench.frames();
        return !all.empty() && all.back().tick > 3000;
      },
      30s));
  kill_library(*arm);
  REQUIRE(controller.ends_within(20s));
  CAPTURE(controller.output());
  CHECK(controller.wait() == 1);
  const auto report = kerf::Json::parse(text_of(bench.folder / "run.json"));
  CHECK(report.at("ticks").get<int>() > 0);  // it was picked up
  REQUIRE(report.at("fault_count").get<int>() > 0);
  CHECK(report.at("faults").at(std::size_t{0}).at("name").get<std::string>() == "stale_input");
  CHECK(report.at("lost_packets").get<int>() == 0);
  CHECK(report.at("unexpected_call").get<std::string>().empty());
}

TEST_CASE("arm: a second adapter of one name is refused, another name is another kerf-arm") {
  Bench bench;
  const auto arm = bench.arm("touch", "");
  REQUIRE(eventually([&] { return runs(*arm); }, 10s));
  const auto second = bench.arm("touch", "");
  CHECK(second->wait() == 2);
  CHECK(second->output().find("--name touch: in use by process ") != std::string::npos);
  const auto left = bench.arm("touch", "", {"--name", "left"});
  CHECK(eventually([&] { return runs(*left); }, 10s));
}

TEST_CASE("arm: the probe of a controller reads the arm's position and switches nothing on") {
  for (const char* const device : {"touch", "omega"}) {
    CAPTURE(device);
    Bench bench;
    const std::string report = (bench.folder / "probe.json").string();
    // The omega's button 0, which parks it, is held.
    const bool is_touch = std::string(device) == "touch";
    bench.folder.write("poses", is_touch ? "0 10 -100 -30 1 0 0 0 1 0 0 0 1 0 1\n"
                                         : "0 0.03 0.01 0.05 1 0 0 0 1 0 0 0 1 1 1\n");
    setenv("KERF_MOCK_POSES", (bench.folder / "poses").c_str(), 1);
    const auto arm = bench.arm(device, "");
    Process probe({kBin + "/kerf-controller", "--probe", "--device", device, "--port", "auto",
                   "--seconds", "1", "--report", report},
                  bench.folder / "probe.log");
    CHECK(probe.wait() == 0);
    CAPTURE(probe.output());
    const auto json = kerf::Json::parse(text_of(report));
    CHECK(json.at("reports").get<int>() > 100);
    CHECK(json.at("calibrated").get<bool>());
    CHECK(json.at("lost_packets").get<int>() == 0);
    const auto counts = json.at("counts").get<std::vector<int>>();
    const auto wanted =
        is_touch ? std::vector{1000, -10'000, -3000} : std::vector{2500, 12'500, 7500};
    CHECK(counts == wanted);
    CHECK(std::ranges::count_if(bench.frames(), &Frame::is_forced) == 0);
    arm->signal(SIGTERM);
    CHECK(arm->wait() == 0);
  }
}

TEST_CASE("arm: --port arm starts one if none runs; it ends with its controller, or says why not") {
  const Bench bench;
  setenv("KERF_MOCK", "", 1);
  const auto probe = [&](const std::string& libraries) {
    setenv("LD_LIBRARY_PATH", libraries.c_str(), 1);
    auto controller = std::make_unique<Process>(
        std::vector<std::string>{kBin + "/kerf-controller", "--probe", "--device", "touch",
                                 "--port", "arm", "--seconds", "0.5"},
        bench.folder / "log");
    unsetenv("LD_LIBRARY_PATH");
    return controller;
  };
  const auto none = probe(bench.folder.path().string());
  CHECK(none->wait() == 2);
  CHECK(none->output().find("kerf-arm: libHD.so: cannot open") != std::string::npos);
  CHECK(none->output().find("kerf-controller: ") == std::string::npos);  // one line is enough
  const auto served = probe(std::string(KERF_TEST_LIBRARIES) + "/mock_hd");
  CAPTURE(served->output());
  CHECK(served->wait() == 0);
  CHECK(served->output().find(" at arm:touch") != std::string::npos);
  CHECK(eventually([] { return kerf::running_arms().empty(); }, 20s));
  CHECK(bench.last_call().find("hdDisableDevice") != std::string::npos);
}

}  // namespace kerf::arm_program_test
