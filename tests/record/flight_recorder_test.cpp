// SPDX-License-Identifier: Apache-2.0
#include "record/run/flight_recorder.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <string>
#include <thread>
#include <vector>

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "controller/servo/servo.hpp"
#include "record/recording.hpp"
#include "record/run/flight_notice.hpp"
#include "record/run/tick_window.hpp"
#include "shared/segment/server.hpp"
#include "tests/record/record_support.hpp"
#include "tests/support/process.hpp"

namespace kerf::flight_recorder_test {

using namespace kerf::test;
using namespace std::chrono_literals;

namespace {

/// A controller at 1 kHz that applies commands, in a thread, beside a flight recorder of 0.5 s.
class Flight {
 public:
  Flight() {
    recorder_ = std::thread([this] {
      RecorderOptions options;
      options.name = "demo";
      options.out = out();
      options.flight_s = 0.5;
      code_ = run_flight_recorder(options, stop_);
    });
    controller_ = std::thread([this] { control(); });
  }
  ~Flight() { end(Lifecycle::clean_end); }

  void end(Lifecycle lifecycle) {
    if (!controller_.joinable()) return;
    leave_ = true;
    controller_.join();
    writer_.set_lifecycle(lifecycle);
    recorder_.join();
  }
  void wait_for(Tick tick) const {
    while (tick_ < tick) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  void fault(Fault fault) { fault_ = static_cast<std::uint32_t>(fault); }
  [[nodiscard]] std::filesystem::path out() const { return folder_ / "flight"; }
  /// The recordings, in the order of their ticks, by their reasons.
  [[nodiscard]] std::vector<std::string> kept() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(out())) {
      const std::string name = entry.path().filename().string();
      if (!name.starts_with('.'))
        names.push_back(name);  // the start of the run, as long as it lasts
    }
    std::ranges::sort(names);
    for (std::string& name : names) name = name.substr(name.find('-') + 1);
    return names;
  }
  [[nodiscard]] Tick now() const { return tick_; }

 private:
  void control() {
    std::uint32_t last_command = 0;
    while (!leave_) {
      TickRecord record = made_up_tick(tick_ + 1, 10'000);
      record.fault = fault_;
      if (const auto command = server_.take_command()) {
        record.command = command->kind == CommandKind::mark ? kCommandMark : 0;
        last_command = command->index;
      }
      record.last_command = last_command;
      publish_tick(writer_, record);
      ++tick_;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }

  RuntimeFolder folder_;
  NoiseVolume volume_{{8, 8, 8}};
  SegmentWriter writer_ = SegmentWriter::create(spec_of(volume_));
  SegmentServer server_{"demo", writer_};
  std::atomic<bool> stop_{false}, leave_{false};
  std::atomic<Tick> tick_{0};
  std::atomic<std::uint32_t> fault_{0};
  std::atomic<int> code_{-1};
  std::thread recorder_, controller_;
};

}  // namespace

TEST_CASE("a flight recorder keeps the ticks before a fault, a mark and a signal, each once") {
  Flight flight;
  flight.wait_for(700);
  const std::filesystem::path marked = grab("demo");
  const RecordSummary summary = summarise(marked);
  CHECK(summary.rows == 500);
  CHECK(summary.lost_ticks == 0);
  CHECK(summary.missed_before_start == summary.first_tick - 1);
  const std::string tick = std::to_string(std::stoul(marked.filename().string()));
  CHECK(summary.end_reason == "kept at tick " + tick + ": mark");
  CHECK(kept_summary(marked).has_value());

  flight.fault(Fault::overspeed);
  CHECK(eventually([&] { return flight.kept().size() >= 2; }, 20s));
  std::raise(SIGUSR1);
  CHECK(eventually([&] { return flight.kept().size() >= 3; }, 20s));
  flight.wait_for(flight.now() + 50);
  CHECK(flight.kept() == std::vector<std::string>{"mark", "overspeed", "signal"});
  flight.fault(Fault::none);
  flight.end(Lifecycle::clean_end);  // as it was asked to: nothing more
  CHECK(flight.kept().size() == 3);
}

TEST_CASE("a flight recorder keeps the end of a run that nobody asked for; a short one whole") {
  Flight flight;
  flight.wait_for(100);
  flight.end(Lifecycle::fault);
  REQUIRE(flight.kept() == std::vector<std::string>{"end"});
  for (const auto& entry : std::filesystem::directory_iterator(flight.out())) {
    const RecordSummary summary = summarise(entry.path());
    CHECK(summary.rows == flight.now());
    CHECK(summary.missed_before_start == 0);
  }
}

TEST_CASE("a flight recorder that could not keep a recording says so again at its end, and fails") {
  const RuntimeFolder folder;
  const NoiseVolume volume({8, 8, 8});
  SegmentWriter writer = SegmentWriter::create(spec_of(volume));
  const SegmentServer server("demo", writer);
  const auto said = folder / "said";
  const pid_t recorder = fork();
  if (recorder == 0) {
    const rlimit room{.rlim_cur = 64 << 10, .rlim_max = 64 << 10};  // of a file: as a full disk
    std::signal(SIGXFSZ, SIG_IGN);
    if (freopen(said.c_str(), "w", stderr) != nullptr && setrlimit(RLIMIT_FSIZE, &room) == 0) {
      execl(KERF_TEST_BIN "/kerf-recorder", "kerf-recorder", "--name", "demo", "--flight", "1",
            "--out", (folder / "flight").c_str(), nullptr);
    }
    _exit(127);
  }
  CHECK(eventually([&] { return std::filesystem::exists(folder / "flight/.run-demo"); }, 20s));
  for (Tick tick = 1; tick <= 600; ++tick) {
    TickRecord record = made_up_tick(tick, 600);
    record.fault = tick == 500 ? static_cast<std::uint32_t>(Fault::overspeed) : 0;
    publish_tick(writer, record);
  }
  CHECK(eventually([&] { return file_text(said).ends_with('\n'); }, 20s));
  const std::string line = file_text(said);
  CHECK(line.ends_with("cannot be written (File too large); make room or choose another --out\n"));
  writer.set_lifecycle(Lifecycle::clean_end);
  int status = -1;
  REQUIRE(waitpid(recorder, &status, 0) == recorder);
  CHECK(WIFEXITED(status));
  CHECK(WEXITSTATUS(status) == 1);
  CHECK(file_text(said) == line + line);
}

TEST_CASE("each mark and each fault is an event of its own, the oldest first") {
  TickWindow window(8);
  const auto add = [&](Tick tick, std::uint32_t command, Fault fault) {
    TickRecord record{};
    record.tick = tick;
    record.command = command;
    record.fault = static_cast<std::uint32_t>(fault);
    window.append(record);
  };
  const auto next = [&] {
    const TickWindow::Event event = window.take_event();
    return event.reason + " " + std::to_string(event.tick);
  };
  CHECK(next() == " 0");
  add(1, kCommandMark, Fault::none);
  add(2, kCommandMark, Fault::none);
  add(3, kCommandMark, Fault::overspeed);
  add(4, 0, Fault::overspeed);
  for (const char* event : {"mark 1", "mark 2", "overspeed 3", "mark 3", " 0"}) {
    CHECK(next() == event);
  }
  for (Tick tick = 5; tick < 2000; ++tick) add(tick, kCommandMark, Fault::none);
  for (int i = 0; i < kMostKept; ++i) CHECK(next() == "mark " + std::to_string(5 + i));
  CHECK(next() == " 0");
}

TEST_CASE("grab says what lacks: no controller, no flight recorder") {
  const RuntimeFolder folder;
  const auto error = [] { return error_of([] { static_cast<void>(grab("demo")); }); };
  CHECK(error().find("start kerf-controller") != std::string::npos);
  const NoiseVolume volume({8, 8, 8});
  const SegmentWriter writer = SegmentWriter::create(spec_of(volume));
  const SegmentServer server("demo", writer);
  CHECK(error().find("no flight recorder runs") != std::string::npos);
}

TEST_CASE("a flight recorder does not pass over a recording of another run that has its name") {
  for (const bool is_taken : {false, true}) {
    CAPTURE(is_taken);
    const RuntimeFolder folder;
    const std::filesystem::path kept = folder / "flight/000000000500-overspeed";
    if (is_taken) std::filesystem::create_directories(kept);
    const NoiseVolume volume({8, 8, 8});
    SegmentWriter writer = SegmentWriter::create(spec_of(volume));
    const SegmentServer server("demo", writer);
    const std::atomic<bool> stop{false};
    int code = -1;
    std::thread recorder([&] {
      RecorderOptions options;
      options.name = "demo";
      options.out = folder / "flight";
      options.flight_s = 0.2;
      code = run_flight_recorder(options, stop);
    });
    CHECK(eventually([&] { return std::filesystem::exists(folder / "flight/.run-demo"); }, 20s));
    for (Tick tick = 1; tick <= 600; ++tick) {
      TickRecord record = made_up_tick(tick, 600);
      record.fault = tick == 500 ? static_cast<std::uint32_t>(Fault::overspeed) : 0;
      publish_tick(writer, record);
    }
    writer.set_lifecycle(Lifecycle::clean_end);
    recorder.join();
    CHECK(code == (is_taken ? 1 : 0));
    CHECK(std::filesystem::exists(kept / kTickLogName) == !is_taken);
  }
}

}  // namespace kerf::flight_recorder_test
