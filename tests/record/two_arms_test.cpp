// SPDX-License-Identifier: Apache-2.0
// A run with two devices: both are recorded, of each tick both or none, and each can be looked at.
#include <atomic>
#include <chrono>
#include <fstream>
#include <sstream>
#include <thread>

#include "controller/servo/servo.hpp"
#include "record/earlier_inputs.hpp"
#include "record/export/live_json.hpp"
#include "record/export/mcap_export.hpp"
#include "record/force_plot.hpp"
#include "record/recorder.hpp"
#include "record/recording.hpp"
#include "record/run/flight_recorder.hpp"
#include "record/run/recorder_run.hpp"
#include "record/run/tick_window.hpp"
#include "shared/posix/report_tool.hpp"
#include "shared/segment/server.hpp"
#include "tests/json.hpp"
#include "tests/record/record_support.hpp"

namespace kerf::two_arms_test {

using namespace kerf::test;

namespace {

/// The second arm's tick beside `made_up_tick`: half the force, the other tool, other inputs.
TickRecord second_tick(const TickRecord& first) {
  TickRecord out = first;
  for (float& n : out.commanded_force_n) n /= 2;
  out.active_tool = 1;
  out.raw[0] = -static_cast<std::int32_t>(first.tick);
  return out;
}

void publish_pair(SegmentWriter& writer, const TickRecord& first, const TickRecord& second) {
  writer.begin_tick(first.tick);
  writer.publish_state(second, 1);
  writer.publish_state(first);
  writer.end_tick(first.tick * 1'000'000);
}

SegmentSpec two_arms_of(const NoiseVolume& volume) {
  SegmentSpec spec = spec_of(volume);
  spec.arms = 2;
  return spec;
}

struct TwoArms {
  void publish(std::uint64_t count) {
    for (; count > 0; --count) {
      const TickRecord first = made_up_tick(++tick, 1000);
      publish_pair(writer, first, second_tick(first));
    }
  }
  RuntimeFolder folder;
  NoiseVolume volume{{8, 8, 8}};
  SegmentWriter writer = SegmentWriter::create(two_arms_of(volume));
  SegmentReader reader = SegmentReader::map(writer.fd());
  SegmentServer server{"demo", writer, CommandLimits{.tools = 2, .arms = 2}};
  Tick tick = 0;
};

RecorderOptions options_for(const RuntimeFolder& folder) {
  RecorderOptions options;
  options.name = "demo";
  options.out = folder / "log";
  options.resume = true;
  return options;
}

/// Records what `run` has now into its folder log, as kerf-recorder does.
void record(TwoArms& run) {
  const std::atomic<bool> stop{true};  // one poll and a manifest
  CHECK(run_recorder(options_for(run.folder), stop) == 0);
}

/// Both logs have these ticks and no others, and the same rows.
void check_logs(const std::filesystem::path& folder, std::uint64_t rows) {
  TickLogReader first(folder / "ticks.npy"), second(folder / "ticks-2.npy");
  CHECK(first.rows() == rows);
  CHECK(second.rows() == rows);
  std::uint64_t row = 0;
  for_each_tick(folder, read_manifest(folder), {},
                [&](const TickRecord& one, const TickRecord* other) {
                  REQUIRE(other != nullptr);
                  CHECK(other->tick == one.tick);
                  CHECK(one.active_tool == 0);
                  CHECK(other->active_tool == 1);
                  ++row;
                });
  CHECK(row == rows);
}

void cut(const std::filesystem::path& log, std::uint64_t rows) {
  std::filesystem::resize_file(log, kTickLogHeaderBytes + rows * sizeof(TickRecord) + 7);
}

}  // namespace

TEST_CASE("two arms are two logs of the same rows, and a gap in either is a gap of both") {
  TwoArms run;
  run.publish(kStateSlots + 5);
  record(run);
  check_logs(run.folder / "log", kStateSlots);
  CHECK(read_manifest(run.folder / "log").arms == 2);
  const auto manifest = read_json_file(run.folder / "log/manifest.json");
  CHECK(manifest["arms"] == 2);
  CHECK(manifest["missed_before_start"] == 5);
  const auto peak_n = manifest["summary"]["peak_force_n"].get<double>();
  CHECK(peak_n > 1);
  CHECK(manifest["summary_2"]["peak_force_n"].get<double>() == doctest::Approx(peak_n / 2));
  run.publish(kStateSlots + 9);
  record(run);
  check_logs(run.folder / "log", 2 * std::uint64_t{kStateSlots});
  CHECK(read_json_file(run.folder / "log/manifest.json")["lost_ticks"] == 9);
}

TEST_CASE("a tick of which another machine brought one arm only is in no log") {
  ReplicaWriter mirror = ReplicaWriter::create(mirror_spec(2));
  for (std::uint64_t index = 20; index < 30; ++index) {
    const TickRecord first = made_up_tick(index + 1, 1000);
    if (index != 20 && index != 24) mirror.put_record(index, second_tick(first), 1);
    if (index != 26) mirror.put_record(index, first);
  }
  const SegmentReader reader = SegmentReader::map(mirror.fd());
  struct Ticks final : TickSink {
    void append_second(const TickRecord& record) override { second.push_back(record.tick); }
    void append(const TickRecord& record) override { first.push_back(record.tick); }
    std::vector<Tick> first, second;
  } ticks;
  Recorder recorder(reader, ticks);
  recorder.drain();
  CHECK(ticks.first == std::vector<Tick>{22, 23, 24, 26, 28, 29, 30});
  CHECK(ticks.second == ticks.first);
  CHECK(recorder.losses().missed_before_start == 21);
  CHECK(recorder.losses().lost == 2);
  CHECK(recorder.losses().gaps.size() == 2);
}

TEST_CASE("a recorder that was killed anywhere is gone on with in both logs") {
  TwoArms run;
  const std::filesystem::path log = run.folder / "log";
  SUBCASE("between the files") {
    std::filesystem::create_directory(log);
    const TickLogWriter second(log / "ticks-2.npy");
  }
  SUBCASE("before any row") {
    std::filesystem::create_directory(log);
    { const TickLogWriter second(log / "ticks-2.npy"); }
    std::ofstream(log / "ticks.npy") << "\x93NUMPY";
  }
  SUBCASE("with more rows of the second") {
    run.publish(300);
    record(run);
    cut(log / "ticks.npy", 200);
    run.publish(64);
  }
  SUBCASE("with more rows of the first, after a crash of the machine") {
    run.publish(300);
    record(run);
    cut(log / "ticks-2.npy", 123);
    run.publish(64);
  }
  run.publish(100);
  record(run);
  check_logs(log, run.tick);
  CHECK(read_json_file(log / "manifest.json")["lost_ticks"] == 0);
}

TEST_CASE("a recording of two arms is looked at arm by arm") {
  TwoArms run;
  run.publish(1500);
  record(run);
  const std::filesystem::path log = run.folder / "log";
  const double peak_n = summarise(log).peak_force_n;
  CHECK(peak_n > 1);
  CHECK(summarise(log, {}, 1).peak_force_n == doctest::Approx(peak_n / 2));
  CHECK(kept_summary(log, 1)->peak_force_n == doctest::Approx(peak_n / 2));

  export_csv(log, run.folder / "1.csv");
  export_csv(log, run.folder / "2.csv", {}, 1);
  const std::string second = file_text(run.folder / "2.csv");
  CHECK(std::count(second.begin(), second.end(), '\n') == 1501);
  CHECK(second != file_text(run.folder / "1.csv"));

  export_mcap(log, run.folder / "run.mcap", McapWriter::Packing::none, {});
  const std::string mcap = file_text(run.folder / "run.mcap");
  for (const std::string part : {"/kerf/2/tick", "/kerf/2/tip", "/kerf/2/force", "device_2"}) {
    CAPTURE(part);
    CHECK(mcap.find(part) != std::string::npos);
  }
  std::uint64_t rows = 0;
  for_each_tick(log, read_manifest(log), {.from = 1100, .until = 1300},
                [&](const TickRecord& one, const TickRecord* other) {
                  CHECK(one.tick == 1100 + rows++);
                  REQUIRE(other != nullptr);
                  CHECK(other->tick == one.tick);
                });
  CHECK(rows == 201);
  try {
    plot_forces(log, run.folder / "forces.svg");
    CHECK(file_text(run.folder / "forces.svg").find(">commanded, second arm<") !=
          std::string::npos);
    plot_forces(log, run.folder / "second.svg", {}, 1);
    CHECK(file_text(run.folder / "second.svg").find("second arm") == std::string::npos);
  } catch (const ReportError& lack) {
    MESSAGE("no plot: ", lack.what());
  }
}

TEST_CASE("logs of two arms that do not belong together are refused; a cut second one ends early") {
  TwoArms run;
  run.publish(200);
  record(run);
  const std::filesystem::path log = run.folder / "log";
  const Manifest manifest = read_manifest(log);
  std::uint64_t both = 0;
  const auto count = [&](const TickRecord&, const TickRecord* other) { both += other != nullptr; };
  cut(log / "ticks-2.npy", 150);
  for_each_tick(log, manifest, {}, count);
  CHECK(both == 150);
  std::filesystem::remove(log / "ticks-2.npy");
  {
    TickLogWriter other(log / "ticks-2.npy");
    TickLogReader(log / "ticks.npy").for_each([&](const TickRecord& row) {
      if (row.tick != 100) other.append(row);
    });
    other.sync();
  }
  CHECK(error_of([&] { for_each_tick(log, manifest, {}, count); }) ==
        (log / "ticks-2.npy").string() +
            ": row 99 is not of the tick of ticks.npy; copy the recording again");
}

TEST_CASE("a run of one device has no second arm, and its recording is as it always was") {
  const RuntimeFolder folder;
  const NoiseVolume volume({8, 8, 8});
  SegmentWriter writer = SegmentWriter::create(spec_of(volume));
  const SegmentServer server("demo", writer);
  publish_tick(writer, made_up_tick(1, 1000));
  const std::atomic<bool> stop{true};
  CHECK(run_recorder(options_for(folder), stop) == 0);
  CHECK(!std::filesystem::exists(folder / "log/ticks-2.npy"));
  const std::string manifest = file_text(folder / "log/manifest.json");
  CHECK(manifest.find("arms") == std::string::npos);
  CHECK(manifest.find("summary_2") == std::string::npos);
  const std::string why = (folder / "log").string() + ": has no arm 2, the run had one device; ";
  const std::filesystem::path log = folder / "log";
  CHECK(error_of([&] { static_cast<void>(summarise(log, {}, 1)); }).starts_with(why));
  CHECK(error_of([&] { static_cast<void>(kept_summary(log, 1)); }).starts_with(why));
  CHECK(error_of([&] { export_csv(log, folder / "x.csv", {}, 1); }).starts_with(why));
  CHECK(error_of([&] { plot_forces(log, folder / "x.svg", {}, 1); }).starts_with(why));
  CHECK(!std::filesystem::exists(folder / "x.csv"));
}

TEST_CASE("a flight recorder keeps both arms, and a fault of the second by its name") {
  TwoArms run;
  std::atomic<bool> stop{false};
  std::thread recorder([&] {
    RecorderOptions options = options_for(run.folder);
    options.flight_s = 0.2;
    CHECK(run_flight_recorder(options, stop) == 0);
  });
  const auto publish = [&](std::uint32_t fault) {
    const TickRecord first = made_up_tick(++run.tick, 10'000);
    TickRecord second = second_tick(first);
    second.fault = fault;
    publish_pair(run.writer, first, second);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  };
  for (int i = 0; i < 400; ++i) publish(0);
  const std::string name = "000000000401-arm-2-overspeed";
  const std::filesystem::path kept = run.folder / "log" / name;
  while (!std::filesystem::exists(kept) && run.tick < 20'000) {
    publish(static_cast<std::uint32_t>(Fault::overspeed));
  }
  run.writer.set_lifecycle(Lifecycle::clean_end);
  recorder.join();
  REQUIRE(std::filesystem::exists(kept));
  const Manifest manifest = read_manifest(kept);
  CHECK(manifest.arms == 2);
  REQUIRE(manifest.summaries.size() == 2);
  CHECK(manifest.summaries[0].faults == 0);
  CHECK(manifest.summaries[1].faults == 1);
  check_logs(kept, manifest.summaries[0].rows);
  const Tick missed = manifest.losses.missed_before_start;
  CHECK(missed > 0);
  Tick tick = 0;
  for_each_input(kept, missed, 2, [&](std::span<const TickRecord> inputs) {
    ++tick;
    CHECK(inputs[0].raw[0] == 0);
    CHECK(inputs[1].raw[0] == -static_cast<std::int32_t>(tick));
  });
  CHECK(tick == missed);
  std::filesystem::create_directory(run.folder / "copy");
  copy_inputs(kept, run.folder / "copy", missed);
  CHECK(std::filesystem::exists(run.folder / "copy/inputs-2/000000000001.npy.gz"));
}

TEST_CASE("a datagram has the second arm's columns beside the first's") {
  const TickRecord first = made_up_tick(7, 1000);
  const auto both = read_json(tick_json(first, &first));
  CHECK(both["kerf"]["tick"] == 7);
  CHECK(both["kerf_2"]["tick"] == 7);
  const std::string one = tick_json(first);
  CHECK(one.find("kerf_2") == std::string::npos);
  CHECK(tick_json(first, &first).starts_with(one.substr(0, one.size() - 1)));
}

namespace {

/// What a reader gets of one arm of a recording.
struct ArmViews {
  std::string log, csv, kept, scanned;
};

/// Records a run whose arms make these ticks.
template <class First, class Second>
std::array<ArmViews, 2> views_of(const First& first, const Second& second, std::string& live) {
  TwoArms run;
  for (Tick tick = 1; tick <= 1200; ++tick) publish_pair(run.writer, first(tick), second(tick));
  record(run);
  const std::filesystem::path folder = run.folder / "log";
  std::array<ArmViews, 2> views;
  for (std::size_t arm = 0; arm < 2; ++arm) {
    const auto text = [](const RecordSummary& summary) {
      std::ostringstream out;
      out << summary.peak_force_n << ' ' << summary.faults << ' ' << summary.contact_ticks << ' '
          << summary.rows << ' ' << summary.stale_ticks;
      return out.str();
    };
    views[arm].log = file_text(folder / tick_log_name(arm));
    export_csv(folder, run.folder / "arm.csv", {}, arm);
    views[arm].csv = file_text(run.folder / "arm.csv");
    views[arm].kept = text(*kept_summary(folder, arm));
    views[arm].scanned = text(summarise(folder, {}, arm));
  }
  const TickRecord one = first(77), other = second(77);
  live = tick_json(one, &other);
  return views;
}

}  // namespace

TEST_CASE("of arms that are exchanged each has the same log, summary, table and datagram") {
  // One works and faults twice; the other is idle, lost, parked and held in turn.
  const auto works = [](Tick tick) {
    TickRecord record = made_up_tick(tick, 1200);
    record.flags |= kFlagStarted;
    record.fault = tick % 500 > 470 ? static_cast<std::uint32_t>(Fault::overspeed) : 0;
    return record;
  };
  const auto idles = [](Tick tick) {
    TickRecord record{};
    record.tick = tick;
    record.start_ns = 0;
    record.stale = tick > 300 && tick < 600 ? 1 : 0;
    record.flags = tick > 700 ? kFlagParked : 0;
    record.phase = static_cast<std::uint16_t>(tick / 300);
    record.raw[0] = static_cast<std::int32_t>(tick);
    record.active_tool = 1;
    return record;
  };
  std::string live, crossed_live;
  const auto ahead = views_of(works, idles, live), crossed = views_of(idles, works, crossed_live);
  for (std::size_t arm = 0; arm < 2; ++arm) {
    CAPTURE(arm);
    CHECK(ahead[arm].log.size() > 1200 * sizeof(TickRecord));
    CHECK(ahead[arm].log == crossed[1 - arm].log);
    CHECK(ahead[arm].csv == crossed[1 - arm].csv);
    CHECK(ahead[arm].kept == crossed[1 - arm].kept);
    CHECK(ahead[arm].scanned == crossed[1 - arm].scanned);
    CHECK(ahead[arm].kept == ahead[arm].scanned);
  }
  CHECK(ahead[0].kept != ahead[1].kept);
  const auto read_live = read_json(live), read_crossed = read_json(crossed_live);
  CHECK(read_live["kerf"] == read_crossed["kerf_2"]);
  CHECK(read_live["kerf_2"] == read_crossed["kerf"]);
  CHECK(read_live["kerf"] != read_live["kerf_2"]);
}

TEST_CASE("a window of ticks finds each fault of either arm, and each again after it was cleared") {
  for (const bool in_second : {false, true}) {
    CAPTURE(in_second);
    TickWindow window(4096, 2);
    for (Tick tick = 1; tick <= 100; ++tick) {
      TickRecord at_fault = made_up_tick(tick, 1000), well = at_fault;
      const bool has_fault = (tick >= 10 && tick < 20) || (tick >= 50 && tick < 60);
      at_fault.fault = has_fault ? static_cast<std::uint32_t>(Fault::overspeed) : 0;
      if (tick >= 55 && tick < 60) at_fault.fault = static_cast<std::uint32_t>(Fault::wrong_dock);
      window.append_second(in_second ? at_fault : well);
      window.append(in_second ? well : at_fault);
    }
    std::string events;
    for (auto event = window.take_event(); !event.reason.empty(); event = window.take_event()) {
      events += std::to_string(event.tick) + " " + event.reason + " ";
    }
    const std::string arm = in_second ? "arm-2-" : "";
    CHECK(events == "10 " + arm + "overspeed 50 " + arm + "overspeed 55 " + arm + "wrong_dock ");
  }
}

}  // namespace kerf::two_arms_test
