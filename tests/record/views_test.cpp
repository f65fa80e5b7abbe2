// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>

#include <sys/stat.h>
#include <unistd.h>

#include "record/force_plot.hpp"
#include "record/recording.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/posix/report_tool.hpp"
#include "tests/json.hpp"
#include "tests/record/record_support.hpp"

namespace kerf::views_test {

using namespace kerf::test;

namespace {

/// Records `ticks` made-up ticks into `folder`; voxels of 0.5 mm.
void record(const std::filesystem::path& folder, Tick ticks) {
  const NoiseVolume volume({8, 8, 8});
  SegmentSpec spec = spec_of(volume);
  spec.volumes[0].spacing_mm = {0.5, 0.5, 0.5};
  SegmentWriter writer = SegmentWriter::create(spec);
  const SegmentReader reader = SegmentReader::map(writer.fd());
  std::filesystem::create_directories(folder);
  TickLogWriter log(folder / kTickLogName);
  Recorder recorder(reader, log);
  for (Tick tick = 1; tick <= ticks; ++tick) {
    publish_tick(writer, made_up_tick(tick, ticks));
    if (tick % 1000 == 0) recorder.poll();
  }
  recorder.drain();
  log.sync();
  write_manifest(folder, reader.info(), recorder.losses(), log.rows(), "clean end");
}

}  // namespace

TEST_CASE("the summary counts what was recorded") {
  const RuntimeFolder folder;
  record(folder / "log", 1000);
  const RecordSummary summary = summarise(folder / "log");
  CHECK(summary.rows == 1000);
  CHECK(summary.first_tick == 1);
  CHECK(summary.last_tick == 1000);
  CHECK(summary.seconds == doctest::Approx(1.0));
  CHECK(summary.lost_ticks == 0);
  CHECK(summary.peak_force_n == doctest::Approx(3.0));
  CHECK(summary.removed_density_mm3 ==
        doctest::Approx(500 * 0.125));  // 500 ticks, one full voxel each
  CHECK(summary.contact_ticks > 900);
  CHECK(summary.port_energy_mj == doctest::Approx(1));
  CHECK(summary.port_minimum_mj == doctest::Approx(-2));
  CHECK(summary.energy_mj[static_cast<std::size_t>(EnergySource::spring)] == doctest::Approx(2));
  CHECK(summary.energy_mj[static_cast<std::size_t>(EnergySource::leak)] == doctest::Approx(-1));
  CHECK(summary.end_reason == "clean end");
  CHECK(to_text(summary).find("rows                1000\n") != std::string::npos);
  CHECK(kerf::test::read_json(to_json(summary))["last_tick"] == 1000);
  CHECK(kerf::test::read_json(to_json(summary))["leak_mj"].get<double>() == doctest::Approx(-1));
}

TEST_CASE("a gap in the sequence shows in the summary without the manifest's help") {
  const RuntimeFolder folder;
  record(folder / "log", 100);
  TickLogReader all(folder / "log/ticks.npy");
  std::filesystem::create_directories(folder / "cut");
  std::filesystem::copy(folder / "log/manifest.json", folder / "cut/manifest.json");
  TickLogWriter log(folder / "cut/ticks.npy");
  all.for_each([&](const TickRecord& row) {
    if (row.tick < 40 || row.tick >= 47) log.append(row);
  });
  log.sync();
  CHECK(summarise(folder / "cut").lost_ticks == 7);
}

TEST_CASE("info and the manifest agree on losses, before the first row and behind the last too") {
  const RuntimeFolder folder;
  const NoiseVolume volume({8, 8, 8});
  SegmentWriter writer = SegmentWriter::create(spec_of(volume));
  const SegmentReader reader = SegmentReader::map(writer.fd());
  std::filesystem::create_directories(folder / "log");
  TickLogWriter log(folder / "log" / std::string(kTickLogName));
  constexpr Tick kMissed = 10, kLost = 25;
  const Tick slots = reader.info().state_slots;
  Tick tick = 0;
  while (tick < slots + kMissed) publish_tick(writer, made_up_tick(++tick, 10000));
  Recorder recorder(reader, log);  // what is overwritten now is not its loss
  for (Tick i = 0; i < kLost; ++i) publish_tick(writer, made_up_tick(++tick, 10000));
  recorder.drain();
  log.sync();
  const auto lost_of = [&](std::string_view end_reason) {
    write_manifest(folder / "log", reader.info(), recorder.losses(), log.rows(), end_reason);
    const RecordSummary summary = summarise(folder / "log");
    CHECK(summary.missed_before_start == kMissed);
    CHECK(summary.first_tick == kMissed + kLost + 1);
    CHECK(summary.rows + summary.lost_ticks + summary.missed_before_start == tick);
    return summary.lost_ticks;
  };
  CHECK(recorder.losses().lost == kLost);
  CHECK(lost_of("clean end") == kLost);
  std::filesystem::remove(folder / "log/manifest.json");
  CHECK(lost_of(kStillRunning) == kLost);  // a killed recorder: by the rows alone
}

TEST_CASE("stale ticks are those of the run, without the silence of a device that has gone") {
  const RuntimeFolder folder;
  const NoiseVolume volume({8, 8, 8});
  SegmentWriter writer = SegmentWriter::create(spec_of(volume));
  const SegmentReader reader = SegmentReader::map(writer.fd());
  std::filesystem::create_directories(folder / "log");
  TickLogWriter log(folder / "log" / std::string(kTickLogName));
  Recorder recorder(reader, log);
  const auto publish = [&](Tick first, Tick last, std::uint32_t flags) {
    for (Tick tick = first; tick <= last; ++tick) {
      TickRecord record = made_up_tick(tick, 100);
      record.flags = flags;
      publish_tick(writer, record);
    }
  };
  publish(1, 10, kFlagStaleInput);  // nobody has taken the device in hand
  publish(11, 13, kFlagStarted | kFlagStaleInput);
  publish(14, 20, kFlagStarted);
  publish(21, 70, kFlagStarted | kFlagStaleInput);
  recorder.drain();
  log.sync();
  const auto stale_of = [&](std::string_view end_reason) {
    std::filesystem::remove(folder / "log/manifest.json");
    write_manifest(folder / "log", reader.info(), recorder.losses(), log.rows(), end_reason);
    return summarise(folder / "log").stale_ticks;
  };
  CHECK(stale_of(kFault) == 3);
  CHECK(stale_of("clean end") == 53);
}

TEST_CASE("the CSV has a line per tick and reads back to the same numbers") {
  const RuntimeFolder folder;
  record(folder / "log", 50);
  export_csv(folder / "log", folder / "ticks.csv");
  std::istringstream text(file_text(folder / "ticks.csv"));
  std::vector<std::string> names;
  std::string line;
  REQUIRE(std::getline(text, line));
  std::istringstream head(line);
  for (std::string name; std::getline(head, name, ',');) names.push_back(name);
  const auto column = std::find(names.begin(), names.end(), "contact_force_n_1");
  REQUIRE(column != names.end());
  Tick tick = 0;
  while (std::getline(text, line)) {
    ++tick;
    std::vector<std::string> cells;
    std::istringstream row(line);
    for (std::string cell; std::getline(row, cell, ',');) cells.push_back(cell);
    REQUIRE(cells.size() == names.size());
    CHECK(cells[1] == std::to_string(tick));
    CHECK(std::stof(cells[static_cast<std::size_t>(column - names.begin())]) ==
          made_up_tick(tick, 50).contact_force_n[1]);
  }
  CHECK(tick == 50);
}

TEST_CASE("views of a folder that is no recording are refused and leave no file") {
  const RuntimeFolder folder;
  std::filesystem::create_directories(folder / "empty");
  CHECK(error_of([&] { static_cast<void>(summarise(folder / "empty")); }).find("manifest.json") !=
        std::string::npos);
  CHECK(error_of([&] { export_csv(folder / "empty", folder / "x.csv"); }).find("manifest.json") !=
        std::string::npos);
  CHECK(!std::filesystem::exists(folder / "x.csv"));
  for (const char* const text : {"", "{}", R"({"tick_ns":0,"end_reason":"","volumes":[]})", "[1"}) {
    std::ofstream(folder / "empty/manifest.json", std::ios::trunc) << text;
    CHECK(error_of([&] { static_cast<void>(read_manifest(folder / "empty")); }).find("recor") !=
          std::string::npos);
  }
}

namespace {

constexpr const char* kSingleFiles[] = {"manifest.json", "ticks.npy", "scene.json", "clock.npy"};

/// With all files of `kSingleFiles`.
void record_with_all(const std::filesystem::path& folder) {
  record(folder, 100);
  write_new_file(folder / "scene.json", "{}");
  const ClockPair pair = sealed({.monotonic_ns = 1, .utc_ns = 2, .within_ns = 3, .crc32c = 0});
  write_clock(folder, std::span(&pair, 1));
}

/// The line about `path` of a check of its recording; empty if there is none.
std::string line_about(const std::filesystem::path& path) {
  std::vector<std::string> lines;
  try {
    lines = check_recording(path.parent_path()).problems;
  } catch (const DamagedRecording& refused) {
    lines.push_back(refused.what());
  } catch (const RecordError& refused) {
    lines.push_back(std::string("bad input: ") + refused.what());
  }
  const auto found = std::ranges::find_if(
      lines, [&](const std::string& line) { return line.find(path.string()) != line.npos; });
  return found == lines.end() ? "" : *found;
}

}  // namespace

TEST_CASE("a pipe or a folder in the place of a recording's file is refused, not waited for") {
  const RuntimeFolder folder;
  record_with_all(folder / "log");
  for (const char* const name : kSingleFiles) {
    CAPTURE(name);
    const std::filesystem::path path = folder / "log" / name;
    CHECK(line_about(path).find("no regular file") == std::string::npos);
    std::filesystem::rename(path, folder / "kept");
    const std::string wanted = path.string() + ": no regular file; copy ";
    REQUIRE(mkfifo(path.c_str(), 0600) == 0);
    CHECK(line_about(path).find(wanted) != std::string::npos);
    std::filesystem::remove(path);
    std::filesystem::create_directory(path);
    CHECK(line_about(path).find(wanted) != std::string::npos);
    std::filesystem::remove(path);
    std::filesystem::rename(folder / "kept", path);
  }
  std::filesystem::remove(folder / "log/scene.json");
  CHECK(
      line_about(folder / "log/scene.json").ends_with("cannot be read; copy the recording again"));
}

TEST_CASE("a file of a recording without the right to read it is bad input, and no damage") {
  const RuntimeFolder folder;
  record_with_all(folder / "log");
  using std::filesystem::perms;
  for (const auto& above : {folder.path(), folder / "log"}) {
    std::filesystem::permissions(above, perms::owner_all | perms::group_exec | perms::others_exec);
  }
  constexpr uid_t kNobody = 65534;
  const bool is_root = geteuid() == 0;  // who may read everything
  for (const char* const name : kSingleFiles) {
    CAPTURE(name);
    const std::filesystem::path path = folder / "log" / name;
    std::filesystem::permissions(path, perms::none);
    if (is_root) REQUIRE(seteuid(kNobody) == 0);
    const std::string line = line_about(path);
    if (is_root) REQUIRE(seteuid(0) == 0);
    CHECK(line ==
          "bad input: " + path.string() + ": cannot be read (Permission denied); check its rights");
    std::filesystem::permissions(path, perms::owner_all | perms::group_read | perms::others_read);
  }
}

TEST_CASE("a file of a recording that is larger than any is refused, not read") {
  const RuntimeFolder folder;
  record_with_all(folder / "log");
  for (const char* const name : {"manifest.json", "scene.json", "clock.npy"}) {
    CAPTURE(name);
    const std::filesystem::path path = folder / "log" / name;
    std::filesystem::copy(path, folder / "kept");
    std::filesystem::resize_file(path, std::uintmax_t{1} << 40);  // on no block of the disk
    CHECK(line_about(path).starts_with(path.string() + ": larger than "));
    std::filesystem::remove(path);
    std::filesystem::rename(folder / "kept", path);
  }
}

TEST_CASE("the plot is an SVG with its panels and every curve that is not zero") {
  try {
    check_can_plot();
  } catch (const ReportError& lack) {
    MESSAGE("skipped: ", lack.what());
    return;
  }
  const RuntimeFolder folder;
  record(folder / "log", 10'000);
  plot_forces(folder / "log", folder / "forces.svg");
  const std::string svg = file_text(folder / "forces.svg");
  for (const std::string part :
       {"</svg>", "force (N)", "penetration (mm)", "removed (mm³)", "time (s)", ">contact<",
        ">modification<", ">commanded<", "work of the hand (mJ)", ">all<", ">spring<", ">leak<"}) {
    CAPTURE(part);
    CHECK(svg.find(part) != std::string::npos);
  }
  CHECK(svg.find(">stabiliser<") == std::string::npos);
  CHECK(svg.size() < 1'000'000);

  // It needs no room for files of its own, and none is left.
  const char* const before = std::getenv("TMPDIR");
  const std::string kept = before != nullptr ? before : "";
  setenv("TMPDIR", (folder / "none").c_str(), 1);
  CHECK_NOTHROW(plot_forces(folder / "log", folder / "again.svg"));
  CHECK_THROWS_WITH_AS(plot_forces(folder / "log", folder / "none/a.svg"),
                       doctest::Contains("none/a.svg: cannot be written"), FileError);
  CHECK_FALSE(std::filesystem::exists(folder / "none"));
  if (before != nullptr) {
    setenv("TMPDIR", kept.c_str(), 1);
  } else {
    unsetenv("TMPDIR");
  }
}

TEST_CASE("a plot and a table leave the recording that they are made from") {
  const RuntimeFolder folder;
  record(folder / "log", 100);
  for (const char* const name : {"ticks.npy", "manifest.json"}) {
    CAPTURE(name);
    CHECK_THROWS_AS(plot_forces(folder / "log", folder / "log" / name), FileError);
    CHECK_THROWS_AS(export_csv(folder / "log", folder / "log" / name), FileError);
  }
  std::filesystem::create_hard_link(folder / "log/ticks.npy", folder / "other");
  CHECK_THROWS_WITH_AS(export_csv(folder / "log", folder / "other"),
                       doctest::Contains("is a file of this run itself"), FileError);
  CHECK(summarise(folder / "log").rows == 100);
  CHECK_NOTHROW(export_csv(folder / "log", folder / "log/ticks.csv"));  // beside it is fine
}

TEST_CASE("a place that cannot be written is refused before anything is drawn") {
  const RuntimeFolder folder;
  CHECK_THROWS_WITH_AS(plot_forces(folder / "no recording", folder / "none/a.svg"),
                       doctest::Contains("none/a.svg: cannot be written"), FileError);
  CHECK_THROWS_WITH_AS(export_csv(folder / "no recording", folder / "none/a.csv"),
                       doctest::Contains("none/a.csv: cannot be written"), FileError);
}

}  // namespace kerf::views_test
