// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <chrono>
#include <csignal>
#include <thread>

#include <sys/wait.h>
#include <unistd.h>

#include "record/recorder.hpp"
#include "record/tick_log.hpp"
#include "shared/segment/server.hpp"
#include "tests/json.hpp"
#include "tests/record/record_support.hpp"

using namespace kerf;
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
  const RuntimeFolder folder;
  std::array<int, 2> last{};  // the child tells the last tick that it published
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
  const std::atomic<bool> stop{false};
  std::thread killer([child] {
    std::this_thread::sleep_for(std::chrono::milliseconds(700));
    kill(child, SIGKILL);
  });
  const int code = run_recorder(options_for(folder), stop);
  killer.join();
  REQUIRE(waitpid(child, nullptr, 0) == child);
  close(last[1]);
  Tick told = 0;
  for (Tick tick = 0; read(last[0], &tick, sizeof tick) == sizeof tick;) told = tick;
  close(last[0]);
  CHECK(code == 0);
  CHECK(told > 100);
  CHECK(contiguous_rows(folder / "log/ticks.npy") >= told);
  CHECK(kerf::test::read_json_file(folder / "log/manifest.json")["end_reason"] ==
        "controller gone");
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
