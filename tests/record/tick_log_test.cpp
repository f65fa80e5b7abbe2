// SPDX-License-Identifier: Apache-2.0
#include <csignal>
#include <cstring>

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "record/tick_log_writer.hpp"
#include "shared/volume/checksum.hpp"
#include "tests/record/record_support.hpp"

namespace kerf::tick_log_test {

using namespace kerf::test;

namespace {

TickRecord row(std::uint64_t index) {
  TickRecord record = made_up_tick(index + 1, 1000);
  record.seq = 2 * index + 2;
  record.crc32c = tick_record_crc(record);
  return record;
}

void write_rows(const std::filesystem::path& path, std::uint64_t rows) {
  TickLogWriter log(path);
  for (std::uint64_t i = 0; i < rows; ++i) log.append(row(i));
  log.sync();
}

}  // namespace

TEST_CASE("the log header is a NPY 1.0 header of fixed size that names each column") {
  const std::string header = tick_log_header(1234);
  REQUIRE(header.size() == kTickLogHeaderBytes);
  CHECK(kTickLogHeaderBytes % 64 == 0);
  CHECK(header.substr(0, 8) == std::string("\x93NUMPY\x01\x00", 8));
  CHECK(static_cast<unsigned char>(header[8]) + 256 * static_cast<unsigned char>(header[9]) ==
        kTickLogHeaderBytes - 10);
  CHECK(header.back() == '\n');
  for (const char* const part :
       {"('seq', '<u8'), ", "('encoder_counts', '<i4', (6,)), ", "('position_mm', '<f8', (3,)), ",
        "('dac_counts', '<i2', (3,)), ", "('dirty_lo', '<u2', (3,)), ", "'shape': (1234,)",
        "('penetration_mm', '<f4'), ", "'fortran_order': False"}) {
    CAPTURE(part);
    CHECK(header.find(part) != std::string::npos);
  }
  CHECK(tick_log_header(~std::uint64_t{0}).size() == kTickLogHeaderBytes);
}

TEST_CASE("rows come back as they were written, and lie behind the header byte for byte") {
  const RuntimeFolder folder;
  write_rows(folder / "ticks.npy", 1500);
  TickLogReader reader(folder / "ticks.npy");
  REQUIRE(reader.rows() == 1500);
  std::uint64_t index = 0;
  reader.for_each([&](const TickRecord& record) {
    const TickRecord expected = row(index++);
    CHECK(std::memcmp(&record, &expected, sizeof record) == 0);
  });
  CHECK(index == 1500);
  CHECK(file_text(folder / "ticks.npy").size() == kTickLogHeaderBytes + 1500 * sizeof(TickRecord));
}

TEST_CASE(
    "rows behind the count of the header are read too: a killed recorder loses none of them") {
  const RuntimeFolder folder;
  TickLogWriter log(folder / "ticks.npy");
  for (std::uint64_t i = 0; i < 10; ++i) log.append(row(i));
  log.sync();
  for (std::uint64_t i = 10; i < 15; ++i) log.append(row(i));
  log.flush();
  CHECK(file_text(folder / "ticks.npy").substr(0, kTickLogHeaderBytes) == tick_log_header(10));
  CHECK(TickLogReader(folder / "ticks.npy").rows() == 15);
}

TEST_CASE(
    "rows that a power cut tore end a log behind its sound rows; one among sound rows does not") {
  const RuntimeFolder folder;
  const std::filesystem::path path = folder / "ticks.npy";
  constexpr std::uint64_t kCounted = 10, kSound = 1500, kTorn = 1100;  // of more than a chunk
  {
    TickLogWriter log(path);
    for (std::uint64_t i = 0; i < kCounted; ++i) log.append(row(i));
    log.sync();
    for (std::uint64_t i = kCounted; i < kSound; ++i) log.append(row(i));
    log.flush();
  }
  const auto end_of = [](std::uint64_t rows) {
    return kTickLogHeaderBytes + rows * sizeof(TickRecord);
  };
  const auto zero = [&](std::uint64_t from, std::uint64_t bytes) {
    std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
    file.seekp(static_cast<std::streamoff>(from));
    file << std::string(bytes, '\0');
  };
  zero(end_of(kSound) - 100, 100 + kTorn * sizeof(TickRecord) + 7);
  {
    TickLogReader log(path);
    CHECK(log.rows() == kSound - 1);
    CHECK(log.parts()[0].bytes_left == (kTorn + 1) * sizeof(TickRecord) + 7);
    std::uint64_t rows = 0;
    log.for_each([&](const TickRecord&) { ++rows; });
    CHECK(rows == kSound - 1);
    log.end_at(kCounted);
    log.end_at(kSound);
    CHECK(log.rows() == kCounted);
    CHECK(log.rows_in_files() == kSound - 1);
    CHECK(log.parts()[0].bytes_left == (kTorn + 1) * sizeof(TickRecord) + 7);
  }
  zero(end_of(700), 3);  // a row among sound ones
  CHECK(error_of([&] {
          TickLogReader(path).for_each([](const TickRecord&) {});
        }).find("row 700 has seq 0") != std::string::npos);
  zero(end_of(kCounted - 1), end_of(kSound + kTorn) - end_of(kCounted - 1));
  CHECK(TickLogReader(path).rows() == kCounted);  // none is sound, and those are counted
  { TickLogWriter log(path, TickLogWriter::Begin::after_last, kCounted - 1); }
  CHECK(std::filesystem::file_size(path) == end_of(kCounted - 1));
}

TEST_CASE("a recording is never overwritten") {
  const RuntimeFolder folder;
  write_rows(folder / "ticks.npy", 3);
  CHECK(error_of([&] { TickLogWriter again(folder / "ticks.npy"); }).find("holds a recording") !=
        std::string::npos);
  CHECK(TickLogReader(folder / "ticks.npy").rows() == 3);
}

TEST_CASE("a log that was cut has the rows before the cut, whatever the byte") {
  const RuntimeFolder folder;
  const std::filesystem::path path = folder / "ticks.npy";
  write_rows(path, 100);
  for (std::uintmax_t bytes = kTickLogHeaderBytes + 100 * sizeof(TickRecord);
       bytes >= kTickLogHeaderBytes; bytes -= 7) {
    CAPTURE(bytes);
    std::filesystem::resize_file(path, bytes);
    TickLogReader log(path);
    CHECK(log.rows() == (bytes - kTickLogHeaderBytes) / sizeof(TickRecord));
    CHECK(log.counted() == 100);
    std::uint64_t rows = 0;
    log.for_each([&](const TickRecord&) { ++rows; });
    CHECK(rows == log.rows());
  }
  for (std::uintmax_t bytes = kTickLogHeaderBytes - 1; bytes > 0; bytes /= 2) {
    std::filesystem::resize_file(path, bytes);
    CHECK(error_of([&] { TickLogReader cut(path); }).find("cut before its first tick") !=
          std::string::npos);
  }
}

TEST_CASE("a log that is changed, foreign or missing is refused in one line") {
  const RuntimeFolder folder;
  const std::filesystem::path path = folder / "ticks.npy";
  const auto read = [&] { TickLogReader(path).for_each([](const TickRecord&) {}); };
  CHECK(error_of(read).find("cannot be read") != std::string::npos);
  write_rows(path, 100);
  CHECK(error_of(read).empty());
  std::filesystem::remove(path);
  write_rows(path, 100);
  {
    std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
    file.seekp(kTickLogHeaderBytes + 42 * sizeof(TickRecord) + 70);
    file.put('!');
  }
  CHECK(error_of(read).find("row 42 has a wrong checksum") != std::string::npos);
  for (const char* const text : {"hello", "\x93NUMPX"}) {
    std::ofstream(path, std::ios::trunc) << text;
    CHECK(error_of(read).find("not a tick log") != std::string::npos);
  }
}

TEST_CASE("a full disk is one line, and the rows that fit stay readable") {
  const RuntimeFolder folder;
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{100'000, 100'000};  // ends inside a row
    setrlimit(RLIMIT_FSIZE, &limit);
    try {
      write_rows(folder / "ticks.npy", 1000);
    } catch (const RecordError& error) {
      _exit(std::string(error.what()).find("make room") != std::string::npos ? 0 : 1);
    }
    _exit(2);
  }
  int status = 0;
  REQUIRE(waitpid(child, &status, 0) == child);
  CHECK(status == 0);
  TickLogReader log(folder / "ticks.npy");
  CHECK(log.rows() > 100);
  CHECK(file_text(folder / "ticks.npy").substr(0, kTickLogHeaderBytes) ==
        tick_log_header(log.rows()));
  CHECK(error_of([&] { log.for_each([](const TickRecord&) {}); }).empty());
}

TEST_CASE("a tick of a log of 11 GB is found, and its row read, without the rows before it") {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder / "ticks.npy";
  constexpr std::uint64_t kRows = 22'000'000;
  {
    TickLogWriter log(path);
    log.append(made_up_tick(1, 2));
    log.sync();
  }
  // Rows of zeros on no block of the disk, and a last one.
  std::filesystem::resize_file(path, kTickLogHeaderBytes + (kRows - 1) * sizeof(TickRecord));
  std::fstream(path, std::ios::binary | std::ios::in | std::ios::out) << tick_log_header(kRows - 1);
  {
    TickLogWriter log(path, TickLogWriter::Begin::after_last);
    TickRecord last = made_up_tick(kRows, 2);
    last.crc32c = tick_record_crc(last);
    log.append(last);
    log.sync();
  }
  TickLogReader reader(path);
  CHECK(reader.rows() == kRows);
  CHECK(reader.row_of(kRows) == kRows - 1);
  CHECK(reader.row_of(kRows + 1) == kRows);
  int visited = 0;
  reader.for_each([&](const TickRecord& record) { visited += record.tick == kRows ? 1 : 2; },
                  {.from = kRows});
  CHECK(visited == 1);
}

TEST_CASE("a row with a wrong checksum ends a log behind the sound rows before it") {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder / "ticks.npy";
  {
    TickLogWriter log(path);
    for (Tick tick = 1; tick <= 100; ++tick) {
      TickRecord record = made_up_tick(tick, 100);
      record.crc32c = tick_record_crc(record);
      log.append(record);
    }
    log.sync();
  }
  {
    std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(kTickLogHeaderBytes + 40 * sizeof(TickRecord) + 100);
    file.put('x');
  }
  TickLogReader reader(path);
  std::vector<TickRecord> rows(100);
  CHECK(reader.read(0, rows) == 40);
  CHECK(error_of([&] { static_cast<void>(reader.read(40, rows)); }).find("row 40 has a wrong") !=
        std::string::npos);
  CHECK(reader.read(41, rows) == 59);
  std::string problem;
  CHECK(reader.read(0, rows, problem) == 40);
  CHECK(problem.empty());
  CHECK(reader.read(40, rows, problem) == 0);
  CHECK(problem.find("row 40 has a wrong") != std::string::npos);
  int visited = 0;
  CHECK_NOTHROW(reader.for_each([&](const TickRecord&) { ++visited; }, {.until = 40}));
  CHECK(visited == 40);
}

}  // namespace kerf::tick_log_test
