// SPDX-License-Identifier: Apache-2.0
#include "record/run/recorder_run.hpp"

#include <array>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <random>
#include <thread>

#include <sys/wait.h>
#include <unistd.h>

#include "record/recording.hpp"
#include "record/tick_log.hpp"
#include "shared/segment/server.hpp"
#include "tests/json.hpp"
#include "tests/record/record_support.hpp"

namespace kerf::recorder_run_test {

using namespace kerf::test;

namespace {

RecorderOptions options_for(const RuntimeFolder& folder) {
  RecorderOptions options;
  options.name = "demo";
  options.out = folder / "log";
  options.report = folder / "report.json";
  return options;
}

std::uint64_t contiguous_rows(const std::filesystem::path& path) {
  Tick expected = 1;
  TickLogReader(path).for_each([&](const TickRecord& record) {
    CHECK(record.tick == expected);
    ++expected;
  });
  return expected - 1;
}

/// How many times the tests of SIGKILL kill: KERF_KILLS, else 3.
int kills() {
  const char* const text = std::getenv("KERF_KILLS");  // NOLINT(concurrency-mt-unsafe): start
  return text == nullptr ? 3 : std::atoi(text);
}

}  // namespace

TEST_CASE("a session is recorded whole and says how it ended") {
  const RuntimeFolder folder;
  const NoiseVolume volume({8, 8, 8});
  SegmentWriter writer = SegmentWriter::create(spec_of(volume));
  const SegmentServer server("demo", writer);
  constexpr Tick kTicks = 600;
  const std::atomic<bool> stop{false};
  int code = -1;
  std::thread recorder([&] { code = run_recorder(options_for(folder), stop); });
  for (Tick tick = 1; tick <= kTicks; ++tick) {
    publish_tick(writer, made_up_tick(tick, kTicks));
    if (tick % 10 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  writer.set_lifecycle(Lifecycle::clean_end);
  recorder.join();
  CHECK(code == 0);
  CHECK(contiguous_rows(folder / "log/ticks.npy") == kTicks);
  CHECK(file_text(folder / "log/scene.json") == R"({"tools":[]})");
  const auto manifest = kerf::test::read_json_file(folder / "log/manifest.json");
  CHECK(manifest["rows"] == kTicks);
  CHECK(manifest["lost_ticks"] == 0);
  CHECK(manifest["end_reason"] == "clean end");
  CHECK(manifest["config_hash"] == "0000000000001234");
  CHECK(manifest["volumes"][0]["size_vox"] == kerf::test::ReadJson(kerf::Json::List{8, 8, 8}));
  CHECK(kerf::test::read_json_file(folder / "report.json")["rows"] == kTicks);
}

TEST_CASE("SIGKILL of the controller loses none of its published ticks") {
  std::mt19937 random(11);
  for (int kill_count = kills(); kill_count > 0; --kill_count) {
    const RuntimeFolder folder;
    const auto life = std::chrono::microseconds(100'000 + random() % 400'000);
    CAPTURE(life.count());
    std::array<int, 2> last{};  // the child writes each tick that it published
    REQUIRE(pipe(last.data()) == 0);
    const pid_t child = fork();
    REQUIRE(child >= 0);
    if (child == 0) {
      const NoiseVolume volume({8, 8, 8});
      SegmentWriter writer = SegmentWriter::create(spec_of(volume));
      const SegmentServer server("demo", writer);
      for (Tick tick = 1;; ++tick) {
        publish_tick(writer, made_up_tick(tick, 1000));
        if (write(last[1], &tick, sizeof tick) != sizeof tick) _exit(1);
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
    }
    close(last[1]);
    const std::atomic<bool> stop{false};
    std::thread killer([child, life] {
      std::this_thread::sleep_for(life);
      kill(child, SIGKILL);
    });
    int code = -1;
    const std::string error = error_of([&] { code = run_recorder(options_for(folder), stop); });
    killer.join();
    REQUIRE(waitpid(child, nullptr, 0) == child);
    Tick published = 0;
    for (Tick tick = 0; read(last[0], &tick, sizeof tick) == sizeof tick;) published = tick;
    close(last[0]);
    if (error.find("start kerf-controller") != std::string::npos)
      continue;  // killed before its start
    CHECK(code == 0);
    CHECK(contiguous_rows(folder / "log/ticks.npy") >= published);
    CHECK(kerf::test::read_json_file(folder / "log/manifest.json")["end_reason"] ==
          "controller gone");
  }
}

TEST_CASE("SIGKILL of the recorder: its successor goes on, and no tick is missing") {
  const RuntimeFolder folder;
  const std::string out = (folder / "log").string();
  const NoiseVolume volume({8, 8, 8});
  SegmentWriter writer = SegmentWriter::create(spec_of(volume));
  const SegmentServer server("demo", writer);
  std::mt19937 random(12);
  Tick tick = 0;
  const auto publish_for = [&](std::chrono::microseconds time) {
    const auto end = std::chrono::steady_clock::now() + time;
    while (std::chrono::steady_clock::now() < end) {
      publish_tick(writer, made_up_tick(++tick, 1000));
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  };
  const auto start = [&] {
    const pid_t child = fork();
    if (child != 0) return child;
    execl(KERF_TEST_BIN "/kerf-recorder", "kerf-recorder", "--name", "demo", "--resume", "--out",
          out.c_str(), nullptr);
    _exit(127);
  };
  for (int kill_count = kills(); kill_count > 0; --kill_count) {
    const pid_t recorder = start();
    publish_for(std::chrono::microseconds(random() % 300'000));
    kill(recorder, SIGKILL);
    REQUIRE(waitpid(recorder, nullptr, 0) == recorder);
    // Without a recorder, for less than the ring holds.
    publish_for(std::chrono::microseconds(random() % 100'000));
  }
  const pid_t last = start();
  publish_for(std::chrono::milliseconds(300));
  writer.set_lifecycle(Lifecycle::clean_end);
  int status = -1;
  REQUIRE(waitpid(last, &status, 0) == last);
  CHECK(status == 0);
  CHECK(contiguous_rows(folder / "log/ticks.npy") == tick);
  const auto manifest = kerf::test::read_json_file(folder / "log/manifest.json");
  CHECK(manifest["lost_ticks"] == 0);
  CHECK(manifest["rows"] == tick);
  CHECK(manifest["end_reason"] == "clean end");
}

TEST_CASE(
    "a recorder goes on with its own run only, alone, and counts what the ring lost meanwhile") {
  const RuntimeFolder folder;
  const NoiseVolume volume({8, 8, 8});
  const std::atomic<bool> stop{true};  // one poll and a manifest
  RecorderOptions options = options_for(folder);
  options.resume = true;  // of nothing yet: begins
  {
    SegmentWriter writer = SegmentWriter::create(spec_of(volume));
    const SegmentServer server("demo", writer);
    Tick tick = 0;
    const auto publish = [&](int count) {
      for (; count > 0; --count) publish_tick(writer, made_up_tick(++tick, 1000));
    };
    publish(100);
    // Killed before its header, which has no manifest beside it.
    std::filesystem::create_directory(options.out);
    std::ofstream(options.out / kTickLogName) << "\x93NUMPY";
    CHECK(run_recorder(options, stop) == 0);
    // Cut in a row, as by a crash of the machine: that row is read from the ring again.
    std::filesystem::resize_file(folder / "log/ticks.npy",
                                 std::filesystem::file_size(folder / "log/ticks.npy") - 7);
    publish(100);
    CHECK(run_recorder(options, stop) == 0);
    CHECK(contiguous_rows(folder / "log/ticks.npy") == 200);
    publish(static_cast<int>(kStateSlots) + 50);
    CHECK(run_recorder(options, stop) == 0);
    const auto manifest = kerf::test::read_json_file(folder / "log/manifest.json");
    CHECK(manifest["lost_ticks"] == 50);
    CHECK(manifest["gaps"][0]["first_index"] == 200);
    CHECK(manifest["gaps"][0]["count"] == 50);
    CHECK(summarise(folder / "log").lost_ticks == 50);
    // Killed between the rows behind the gap and the manifest: the rows say it.
    Json before_gap = Json::parse(file_text(folder / "log/manifest.json"));
    before_gap["lost_ticks"] = 0;
    before_gap["gaps"] = Json::List{};
    std::ofstream(folder / "log/manifest.json") << before_gap.document();
    publish(10);
    CHECK(run_recorder(options, stop) == 0);
    CHECK(kerf::test::read_json_file(folder / "log/manifest.json")["lost_ticks"] == 50);
    CHECK(kerf::test::read_json_file(folder / "log/manifest.json")["gaps"][0]["first_index"] ==
          200);
    const TickLogWriter other(folder / "log/ticks.npy", TickLogWriter::Begin::after_last);
    CHECK(error_of([&] {
            static_cast<void>(run_recorder(options, stop));
          }).find("another recorder writes it") != std::string::npos);
  }
  const SegmentWriter writer = SegmentWriter::create(spec_of(volume));
  const SegmentServer server("demo", writer);
  CHECK(error_of([&] {
          static_cast<void>(run_recorder(options, stop));
        }).find("choose another --out") != std::string::npos);
}

TEST_CASE("a recorder without a controller waits as long as it was told, then says what to start") {
  const RuntimeFolder folder;
  RecorderOptions options = options_for(folder);
  options.wait_s = 0.1;
  const std::atomic<bool> stop{false};
  const std::string error = error_of([&] { static_cast<void>(run_recorder(options, stop)); });
  CHECK(error.find("start kerf-controller") != std::string::npos);
  CHECK(!std::filesystem::exists(options.out));
  options.name = "a/b";
  CHECK(error_of([&] { static_cast<void>(run_recorder(options, stop)); }).find("'a/b'") !=
        std::string::npos);
}

}  // namespace kerf::recorder_run_test
