// SPDX-License-Identifier: Apache-2.0
// A controller that is killed at random moments, on each front: what the device heard last, what is
// left, and whether the next one starts at once. Seeded:
//     KERF_KILLS=200 KERF_KILLS_SEED=7 build/release/bin/test_kills [-tc="*on usb"]
#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <doctest/doctest.h>
#include <sys/resource.h>

#include "hil/hil_error.hpp"
#include "tests/programs/pair.hpp"
#include "tests/programs/watched_fronts.hpp"

namespace kerf::kills_test {

using kerf::test::eventually;
using kerf::test::Process;
using kerf::test::TemporaryFolder;
using kerf::test::WatchedDevice;
using kerf::test::WatchedFront;
using namespace std::chrono_literals;

namespace {

int number_of(const char* variable, int otherwise) {
  const char* const text = std::getenv(variable);  // NOLINT(concurrency-mt-unsafe): one thread
  return text != nullptr ? std::atoi(text) : otherwise;
}

const std::vector<int> kAsking{SIGINT,    SIGTERM, SIGHUP, SIGALRM, SIGUSR1,   SIGUSR2,  SIGXCPU,
                               SIGVTALRM, SIGPROF, SIGIO,  SIGPWR,  SIGSTKFLT, SIGRTMIN, SIGRTMAX};
constexpr std::array kCrashing{SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGSYS, SIGTRAP, SIGQUIT};
constexpr std::array kOutOfReach{SIGKILL, SIGSTOP};

/// Seven of twelve ask for the end, four are crashes, one is out of reach.
int random_signal(std::mt19937& random) {
  const auto pick = random();
  const auto kind = random() % 12;
  if (kind < 7) return kAsking[pick % kAsking.size()];
  if (kind < 11) return kCrashing[pick % kCrashing.size()];
  return kOutOfReach[pick % kOutOfReach.size()];
}

bool is_in(const auto& signals, int signal) {
  return std::ranges::count(signals, signal) > 0;
}

/// What a series of kills has shown.
struct Tally {
  int kills = 0;
  int pushing = 0;                 ///< the last packet before the signal asked for torque
  int out_of_reach = 0;            ///< SIGKILL and SIGSTOP
  std::vector<double> asked_ms;    ///< until the motors were off, after a signal that asks
  std::vector<double> crashed_ms;  ///< ... and after one that is a crash
};

/// Files of a run that its end has left, but its sockets and the lock beside one.
std::vector<std::string> left_in(const std::filesystem::path& folder, bool in_order) {
  std::vector<std::string> left;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.is_directory()) continue;
    const std::string name = entry.path().filename().string();
    const bool is_socket = name.ends_with(".sock") || name.ends_with(".lock");
    const bool is_ours = name == "port" || name == "small.toml" || name == "log";
    const bool is_report = name == "report.json";
    if (is_ours || is_report || (is_socket && !in_order)) continue;
    left.push_back(name);
  }
  return left;
}

/// One controller on `front`, killed; what is learned goes into `tally`.
void kill_once(const WatchedFront& front, const TemporaryFolder& folder, std::mt19937& random,
               Tally& tally) {
  const int signal = random_signal(random);
  const bool from_start = random() % 4 == 0;
  const auto delay = std::chrono::microseconds(random() % (from_start ? 1'500'000 : 300'000));
  CAPTURE(tally.kills);
  CAPTURE(signal);
  CAPTURE(from_start);
  WatchedDevice device(front.personality);
  const auto served = kerf::test::serve(front, device, folder.path());
  Process controller(
      {kerf::test::kBin + "/kerf-controller", "--scene", (folder / "small.toml").string(),
       "--device", std::string(kerf::word_of(front.personality)), "--torque-scale", "0.3,0.3,0.3",
       "--port", served->port(), "--name", "killed", "--report", (folder / "report.json").string()},
      folder / "log");
  // Most are killed while they push, which also shows that they start after the last one's end.
  if (!from_start) {
    const bool pushes = eventually([&] { return device.pushed(); }, 20s);
    const std::string log = controller.output();
    CAPTURE(log);
    REQUIRE(pushes);
  }
  std::this_thread::sleep_for(delay);
  const bool pushed = device.pushed();
  const std::int64_t killed_ns = kerf::monotonic_ns();
  controller.signal(signal);
  if (signal == SIGSTOP) {
    std::this_thread::sleep_for(50ms);
    controller.signal(SIGKILL);
  }
  REQUIRE(controller.ends_within(20s));
  std::this_thread::sleep_for(20ms);  // what is under way arrives
  ++tally.kills;
  tally.pushing += pushed ? 1 : 0;
  if (is_in(kOutOfReach, signal)) {
    ++tally.out_of_reach;
  } else {
    CHECK_FALSE(device.pushed());
    const double off_ms = static_cast<double>(device.let_go_ns() - killed_ns) / 1e6;
    if (pushed) (is_in(kAsking, signal) ? tally.asked_ms : tally.crashed_ms).push_back(off_ms);
  }
  // One that was asked before it could listen dies as of a crash, or does not touch what an earlier
  // crash left.
  const int code = controller.wait();
  CAPTURE(code);
  const bool listened = controller.output().find("; loading ") == std::string::npos;
  for (const std::string& left : left_in(folder.path(), code < 128 && listened)) {
    CAPTURE(left);
    CHECK(left.empty());
  }
  std::filesystem::remove(folder / "report.json");
}

void tell(const std::string& how, std::vector<double>& off_ms) {
  if (off_ms.empty()) return;
  std::ranges::sort(off_ms);
  MESSAGE(how << ": motors off after a median of " << off_ms[off_ms.size() / 2] << " ms, 95 % "
              << off_ms[off_ms.size() * 95 / 100] << " ms, max " << off_ms.back() << " ms");
}

void kill_many(const WatchedFront& front) {
  const int kills = number_of("KERF_KILLS", 3);
  const auto seed = static_cast<std::uint32_t>(number_of("KERF_KILLS_SEED", 1));
  constexpr rlimit kNoCores{0, 0};
  setrlimit(RLIMIT_CORE, &kNoCores);
  const TemporaryFolder folder;
  setenv("XDG_RUNTIME_DIR", folder.path().c_str(), 1);
  static_cast<void>(kerf::test::small_scene(folder));
  std::mt19937 random(seed);
  Tally tally;
  try {
    for (int i = 0; i < kills; ++i) kill_once(front, folder, random, tally);
  } catch (const kerf::HilError& error) {
    MESSAGE("skipped: " << error.what());
    return;
  }
  MESSAGE(std::string(front.name) << ": " << tally.kills << " kills, " << tally.pushing
                                  << " while it pushed, " << tally.out_of_reach
                                  << " by SIGKILL or SIGSTOP");
  tell("asked", tally.asked_ms);
  tell("crashed", tally.crashed_ms);
}

}  // namespace

TEST_CASE("killed at random moments, the motors are off and nothing is left: on socket") {
  kill_many(kerf::test::kWatchedFronts[0]);
}
TEST_CASE("killed at random moments, the motors are off and nothing is left: on udp") {
  kill_many(kerf::test::kWatchedFronts[1]);
}
TEST_CASE("killed at random moments, the motors are off and nothing is left: on fw") {
  kill_many(kerf::test::kWatchedFronts[2]);
}
TEST_CASE("killed at random moments, the motors are off and nothing is left: on usb") {
  kill_many(kerf::test::kWatchedFronts[3]);
}
TEST_CASE("killed at random moments, the motors are off and nothing is left: on hid") {
  kill_many(kerf::test::kWatchedFronts[4]);
}

}  // namespace kerf::kills_test
