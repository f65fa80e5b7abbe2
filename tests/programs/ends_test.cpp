// SPDX-License-Identifier: Apache-2.0
// What ends or holds up a controller that pushes: signals, a standstill, the death of its device.
#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <filesystem>
#include <thread>

#include <doctest/doctest.h>

#include "record/check/recording_check.hpp"
#include "record/recording.hpp"
#include "tests/json.hpp"
#include "tests/programs/pair.hpp"

namespace kerf::ends_test {

using kerf::test::eventually;
using kerf::test::Pair;
using namespace std::chrono_literals;

TEST_CASE("kill -9 of the emulator: fault in the report, exit 1 after 2000 ticks") {
  Pair pair;
  pair.start("touch.toml", {"--seconds", "60"});
  REQUIRE(eventually(
      [&] {
        try {
          const auto connection = kerf::connect_segment(pair.name);
          const auto latest = connection.reader().latest();
          return latest && (latest->flags & kerf::kFlagMotorsOn) != 0;
        } catch (const kerf::SegmentError&) {
          return false;
        }
      },
      20s));
  const auto connection = kerf::connect_segment(pair.name);
  kerf::test::Process recorder({kerf::test::kBin + "/kerf-recorder", "--name", pair.name, "--out",
                                (pair.folder / "log").string()},
                               pair.folder / "recorder.log");
  REQUIRE(
      eventually([&] { return std::filesystem::exists(pair.folder / "log/manifest.json"); }, 20s));
  pair.emulator->signal(SIGKILL);
  CHECK(pair.controller->wait() == 1);
  CHECK(recorder.wait() == 0);
  const auto report = pair.report();
  const auto met = [&](const char* name) {
    return std::ranges::any_of(report["faults"],
                               [&](const kerf::test::ReadJson& f) { return f["name"] == name; });
  };
  CHECK(met("stale_input"));
  CHECK(met("device_gone"));
  CHECK(report["stale_ticks"] < 2000);  // without the silence after its end
  CHECK(report["stale_ticks"] == kerf::summarise(pair.folder / "log").stale_ticks);

  // The segment outlives the controller: in it, from 20 silent ticks on there is no force.
  const kerf::SegmentReader& reader = connection.reader();
  const std::uint64_t head = reader.state_head();
  int silent = 0;
  for (std::uint64_t i = head > 3000 ? head - 3000 : 0; i < head; ++i) {
    kerf::TickRecord record{};
    REQUIRE(reader.state_at(i, record) == kerf::ReadState::ok);
    silent = record.stale != 0 ? silent + 1 : 0;
    if (silent < 20) continue;
    REQUIRE(record.commanded_force_n[0] == 0);
    REQUIRE(record.commanded_force_n[1] == 0);
    REQUIRE(record.commanded_force_n[2] == 0);
    REQUIRE((record.flags & kerf::kFlagMotorsOn) == 0);
  }
  CHECK(silent > 1900);
  CHECK_FALSE(connection.alive());
}

TEST_CASE("late reports of an emulator: the warning names its busy machine, not a cable") {
  Pair pair;
  pair.scene = kerf::test::small_scene(pair.folder);
  pair.start("touch.toml", {"--virtual", "--seconds", "2"},
             {"--lockstep", "--fault", kerf::test::kScenes + "/../hil/faults/sparse_reports.toml"});
  CHECK(pair.controller->wait() == 1);
  const std::string said = pair.controller->output();
  CAPTURE(said);
  CHECK(said.find("warning: sparse_input at tick") != std::string::npos);
  CHECK(said.find("its machine is too busy for real time") != std::string::npos);
  CHECK(said.find("cable") == std::string::npos);
}

TEST_CASE("SIGINT, SIGTERM and SIGHUP end in order: exit 0, a report, no socket left") {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    Pair pair;
    const auto report_of = [&](const char* name) { return (pair.folder / name).string(); };
    pair.start("touch.toml", {}, {"--report", report_of("emulator.json")});
    kerf::test::Process recorder(
        {kerf::test::kBin + "/kerf-recorder", "--name", pair.name, "--out",
         (pair.folder / "recording").string(), "--report", report_of("recorder.json")},
        pair.folder / "recorder.log");
    REQUIRE(pair.ticks_within(20s));
    REQUIRE(eventually(
        [&] { return std::filesystem::exists(pair.folder / "recording/manifest.json"); }, 20s));
    for (kerf::test::Process* program : {&recorder, &*pair.controller, &*pair.emulator}) {
      program->signal(signal);
      CHECK(program->wait() == 0);
    }
    CHECK(pair.report()["end"] == "stopped");
    CHECK(std::filesystem::exists(pair.folder / "emulator.json"));
    CHECK(kerf::test::text_of(pair.folder / "recorder.json").find("\"stopped\"") !=
          std::string::npos);
    CHECK_FALSE(std::filesystem::exists(kerf::segment_socket(pair.name)));
  }
}

TEST_CASE("a controller that stood still with all its threads pushes again only by the ramp") {
  Pair pair;
  pair.start("touch.toml", {});
  REQUIRE(pair.ticks_within(20s));
  const auto connection = kerf::connect_segment(pair.name);
  const kerf::SegmentReader& reader = connection.reader();
  const auto force_n = [](const kerf::TickRecord& record) {
    return std::hypot(record.commanded_force_n[0], record.commanded_force_n[1],
                      record.commanded_force_n[2]);
  };
  const auto pushes = [&] {
    const auto latest = reader.latest();
    return latest && force_n(*latest) > 0.3;
  };
  REQUIRE(eventually(pushes, 20s));
  pair.controller->signal(SIGSTOP);
  std::this_thread::sleep_for(60ms);
  pair.controller->signal(SIGCONT);
  const std::uint64_t stopped_at = reader.state_head();
  CHECK(eventually([&] { return reader.state_head() > stopped_at + 10 && pushes(); }, 20s));
  pair.controller->signal(SIGTERM);
  CHECK(pair.controller->wait() == 0);

  // However deep the hand is by then, the ramp bounds its force: a hundredth more in each tick.
  constexpr double kPeakN = 3.3;
  constexpr int kFadeTicks = 100;
  int standstills = 0;
  int fade_ticks = kFadeTicks;
  const std::uint64_t head = reader.state_head();
  kerf::TickRecord last{};
  for (std::uint64_t i = head > 3000 ? head - 3000 : 0; i < head; ++i) {
    kerf::TickRecord record{};
    REQUIRE(reader.state_at(i, record) == kerf::ReadState::ok);
    if (last.tick != 0 && record.start_ns > last.start_ns + 40'000'000) {
      if (force_n(last) > 0.3) ++standstills;
      fade_ticks = 0;
    }
    if (fade_ticks < kFadeTicks) {
      ++fade_ticks;
      CHECK(force_n(record) <= kPeakN * fade_ticks / kFadeTicks);
    }
    last = record;
  }
  CHECK(standstills >= 1);
  const auto events = pair.report()["events"];
  CHECK(std::ranges::any_of(events, [](const kerf::test::ReadJson& event) {
    return event["name"] == "watchdog" || event["name"] == "stood_still";
  }));
}

}  // namespace kerf::ends_test
