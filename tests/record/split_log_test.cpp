// SPDX-License-Identifier: Apache-2.0
#include <fstream>
#include <vector>

#include "record/recording.hpp"
#include "record/run/recorder_run.hpp"
#include "record/tick_log_writer.hpp"
#include "shared/segment/server.hpp"
#include "shared/text/command_line.hpp"
#include "shared/text/json.hpp"
#include "tests/record/record_support.hpp"

namespace kerf::split_log_test {

using namespace kerf::test;

namespace {

constexpr std::uint64_t kRows = 2500, kRowsAPart = 1000;

TickRecord row(std::uint64_t index) {
  TickRecord record = made_up_tick(index + 1, kRows);
  record.seq = 2 * index + 2;
  record.crc32c = tick_record_crc(record);
  return record;
}

/// Appends rows up to `end`, of a log that is split.
void write_until(const std::filesystem::path& path, std::uint64_t end, TickLogWriter::Begin begin,
                 std::uint64_t most_rows = UINT64_MAX) {
  TickLogWriter log(path, begin, most_rows, kRowsAPart);
  while (log.rows() < end) log.append(row(log.rows()));
  log.sync();
}

std::vector<std::uint64_t> rows_of_parts(const std::filesystem::path& path) {
  std::vector<std::uint64_t> rows;
  const TickLogReader log(path);
  for (const TickLogReader::Part& part : log.parts()) rows.push_back(part.rows);
  CHECK(log.counted() == log.rows());
  return rows;
}

/// How many rows it has, each as it was written.
std::uint64_t sound_rows(const std::filesystem::path& path, TickRange range = {}) {
  std::uint64_t rows = 0;
  TickLogReader(path).for_each(
      [&](const TickRecord& record) {
        const TickRecord expected = row(record.tick - 1);
        CHECK(std::memcmp(&record, &expected, sizeof record) == 0);
        ++rows;
      },
      range);
  return rows;
}

using Counts = std::vector<std::uint64_t>;
constexpr auto kNew = TickLogWriter::Begin::new_file;
constexpr auto kAfter = TickLogWriter::Begin::after_last;

}  // namespace

TEST_CASE("a log that is split reads as one") {
  const RuntimeFolder folder;
  const std::filesystem::path path = folder / "ticks.npy";
  CHECK(part_of_log(path, 1) == path);
  CHECK(part_of_log(path, 2) == folder / "ticks.npy.0002");
  CHECK(part_of_log(path, 12345) == folder / "ticks.npy.12345");
  write_until(path, kRows, kNew);
  CHECK(rows_of_parts(path) == Counts{1000, 1000, 500});
  CHECK(sound_rows(path) == kRows);
  CHECK(sound_rows(path, {.from = 990, .until = 2010}) == 1021);
  TickLogReader log(path);
  CHECK(log.row_of(2001) == 2000);
  std::vector<TickRecord> rows(1500);  // over two borders
  REQUIRE(log.read(900, rows) == 1500);
  for (std::size_t i = 0; i < rows.size(); ++i) CHECK(rows[i].tick == 901 + i);
  CHECK(log.read(2, std::span(rows).first(1)) == 1);  // back to the first file
  CHECK(rows[0].tick == 3);
  CHECK(log.read(kRows, rows) == 0);
}

TEST_CASE("a log that was split goes on behind any of its rows") {
  const RuntimeFolder folder;
  const std::filesystem::path path = folder / "ticks.npy";
  write_until(path, kRows, kNew);
  write_until(path, 3200, kAfter);
  CHECK(rows_of_parts(path) == Counts{1000, 1000, 1000, 200});
  CHECK(sound_rows(path) == 3200);
  for (const std::uint64_t keep : {2500U, 2000U, 1999U, 1001U, 1000U, 7U, 0U}) {
    CAPTURE(keep);
    write_until(path, keep, kAfter, keep);
    CHECK(sound_rows(path) == keep);
    write_until(path, kRows, kAfter);
    CHECK(sound_rows(path) == kRows);
  }
  // Killed as the third file began, and in a row.
  std::filesystem::resize_file(part_of_log(path, 3), 100);
  CHECK(sound_rows(path) == 2000);
  std::filesystem::resize_file(part_of_log(path, 2), std::filesystem::file_size(path) - 1);
  std::filesystem::remove(part_of_log(path, 3));
  CHECK(sound_rows(path) == 1999);
  write_until(path, kRows, kAfter);
  CHECK(rows_of_parts(path) == Counts{1000, 1000, 500});
  CHECK(sound_rows(path) == kRows);
}

TEST_CASE("files of a log that are missing or of another one are named") {
  const RuntimeFolder folder;
  const std::filesystem::path path = folder / "ticks.npy";
  write_until(path, 3500, kNew);
  std::filesystem::resize_file(part_of_log(path, 2), 100);
  const std::string line = part_of_log(path, 2).string() +
                           ": missing, or cut in its header, and ticks.npy.0003 is there; copy the "
                           "recording again";
  CHECK(error_of([&] { const TickLogReader log(path); }) == line);
  std::filesystem::remove(part_of_log(path, 2));
  CHECK(error_of([&] { const TickLogReader log(path); }) == line);
  std::ofstream(part_of_log(path, 2)) << std::string(5000, 'x');
  CHECK(error_of([&] {
          const TickLogReader log(path);
        }).starts_with(part_of_log(path, 2).string() + ": not a tick log of this version; "));
  std::filesystem::remove(path);
  CHECK(error_of([&] { write_until(path, 1, kNew); }) ==
        part_of_log(path, 2).string() + ": of a recording; choose another --out");
}

TEST_CASE("a power cut as a file of a log begins leaves the files before it") {
  const RuntimeFolder folder;
  const std::filesystem::path path = folder / kTickLogName;
  write_until(path, 2 * kRowsAPart, kNew);
  for (const std::size_t zeros : {std::size_t{0}, kTickLogHeaderBytes, 2 * kTickLogHeaderBytes}) {
    CAPTURE(zeros);
    std::ofstream(part_of_log(path, 3), std::ios::binary) << std::string(zeros, '\0');
    CHECK(sound_rows(path) == 2 * kRowsAPart);
  }
}

TEST_CASE("files that are taken away or damaged do not end their recorder") {
  const RuntimeFolder folder;
  const std::filesystem::path path = folder / kTickLogName;
  write_until(path, kRows, kNew);
  const NoiseVolume volume({8, 8, 8});
  const SegmentWriter writer = SegmentWriter::create(spec_of(volume));
  const SegmentReader reader = SegmentReader::map(writer.fd());
  std::filesystem::remove(part_of_log(path, 2));
  std::fstream(path, std::ios::in | std::ios::out | std::ios::binary) << "no header";
  const Json files = Json::Members{};
  CHECK_NOTHROW(write_manifest(folder / ".", reader.info(), {}, kRows, kStillRunning, {}, &files));
  const Json manifest = Json::parse(text_in(folder / kManifestName));
  CHECK(manifest.at("first_rows").at(0).get<std::uint32_t>() == row(0).crc32c);
}

TEST_CASE("a file that cannot be begun is named, and the rows before it stay") {
  const RuntimeFolder folder;
  const std::filesystem::path path = folder / "ticks.npy";
  TickLogWriter log(path, kNew, UINT64_MAX, kRowsAPart);
  std::filesystem::create_directory(part_of_log(path, 2));
  CHECK(error_of([&] {
          while (log.rows() < kRows) log.append(row(log.rows()));
        }) == part_of_log(path, 2).string() +
                  ": cannot be written (Is a directory); make room or choose another --out");
  CHECK(error_of([&] {
          const TickLogReader read(path);
        }).starts_with(part_of_log(path, 2).string() + ": no regular file; "));
  std::filesystem::remove(part_of_log(path, 2));
  CHECK(rows_of_parts(path) == Counts{1000});
  CHECK(sound_rows(path) == 1000);
}

TEST_CASE("a recorder splits by the time of the run, and goes on with --resume") {
  CHECK(split_s("90s") == 90);
  CHECK(split_s("10m") == 600);
  CHECK(split_s("1.5h") == 5400);
  for (const char* const text :
       {"", "10", "10 m", "m", "0.9s", "-1m", "25h", "nan s", "1e9h", "1mm"}) {
    CAPTURE(text);
    CHECK_THROWS_AS(static_cast<void>(split_s(text)), UsageError);
  }
  const RuntimeFolder folder;
  const NoiseVolume volume({8, 8, 8});
  SegmentWriter writer = SegmentWriter::create(spec_of(volume));
  const SegmentServer server("demo", writer);
  const std::atomic<bool> stop{true};  // one poll and a manifest
  RecorderOptions options;
  options.name = "demo";
  options.out = folder / "log";
  options.resume = true;
  options.split = "1s";
  for (Tick tick = 1; tick <= 4500; ++tick) {
    publish_tick(writer, made_up_tick(tick, 4500));
    if (tick % 1500 == 0) CHECK(run_recorder(options, stop) == 0);
  }
  CHECK(rows_of_parts(folder / "log/ticks.npy") == Counts{1000, 1000, 1000, 1000, 500});
  CHECK(error_of([&] {
          export_csv(folder / "log", folder / "log/ticks.npy.0003");
        }).find("is a file of this run itself") != std::string::npos);
  const RecordSummary summary = summarise(folder / "log");
  CHECK(summary.rows == 4500);
  CHECK(summary.lost_ticks == 0);
}

}  // namespace kerf::split_log_test
