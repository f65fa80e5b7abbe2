// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cstddef>
#include <cstring>
#include <span>
#include <utility>
#include <vector>

#include "record/losses_of_rows.hpp"
#include "record/manifest_seal.hpp"
#include "record/recorder.hpp"
#include "record/tick_log_writer.hpp"
#include "tests/record/record_support.hpp"

namespace kerf::recording_check_test {

using namespace kerf::test;

namespace {

/// A row as a recorder writes it. A watched replay rests at ticks that have no record: `rests`.
TickRecord row(Tick tick, Tick rests = 0) {
  TickRecord record = made_up_tick(tick, 1000);
  record.seq = 2 * (tick - rests);
  record.crc32c = tick_record_crc(record);
  return record;
}

std::filesystem::path write_rows(const std::filesystem::path& path,
                                 const std::vector<TickRecord>& rows) {
  std::filesystem::remove(path);
  TickLogWriter log(path);
  for (const TickRecord& record : rows) log.append(record);
  log.sync();
  return path;
}

/// What a reader of these rows reports; "" if it reads them all.
std::string problem_with(const std::filesystem::path& path, const std::vector<TickRecord>& rows) {
  write_rows(path, rows);
  return error_of([&] { TickLogReader(path).for_each([](const TickRecord&) {}); });
}

/// Whether rows in this order can be of one run, as a reader decides it.
bool are_in_order(std::span<const TickRecord> rows) {
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (!why_unsound(rows[i]).empty()) return false;
    if (i > 0 && !why_out_of_order(rows[i - 1], rows[i]).empty()) return false;
  }
  return true;
}

LossesOfRows losses_of(std::uint64_t first, std::initializer_list<Tick> ticks) {
  LossesOfRows losses(first);
  for (const Tick tick : ticks) losses.add(row(tick));
  return losses;
}

}  // namespace

TEST_CASE("each bit of a row is covered: of the first one, the last, one before and behind a gap") {
  const std::vector<TickRecord> rows{row(1), row(2), row(3), row(30), row(31)};
  REQUIRE(are_in_order(rows));
  for (std::size_t changed = 0; changed < rows.size(); ++changed) {
    CAPTURE(changed);
    for (std::size_t bit = 0; bit < 8 * sizeof(TickRecord); ++bit) {
      CAPTURE(bit);
      std::vector<TickRecord> damaged = rows;
      std::as_writable_bytes(std::span(damaged))[changed * sizeof(TickRecord) + bit / 8] ^=
          std::byte{1} << bit % 8;
      CHECK_FALSE(are_in_order(damaged));
    }
  }
}

TEST_CASE("a seq that another row could have is found by its neighbours, or by the losses") {
  std::vector<TickRecord> rows{row(1), row(2), row(30), row(31)};
  rows[2].seq = 2 * 17;  // in the gap before it
  CHECK(why_unsound(rows[2]).empty());
  CHECK_FALSE(are_in_order(rows));
  rows.pop_back();  // the last row has one neighbour only
  CHECK(are_in_order(rows));
  const RecordLosses said{.lost = 27, .gaps = {{2, 27}}};
  LossesOfRows losses(0);
  for (const TickRecord& record : rows) losses.add(record);
  CHECK(losses.why_not(said, true, 3).find("gaps has 27 records from index 2") !=
        std::string::npos);
  CHECK_FALSE(losses.why_not(said, false, 0).empty());
}

TEST_CASE("rows that are doubled, exchanged or of another run end a log, in one line") {
  const RuntimeFolder folder;
  const std::filesystem::path path = folder / "ticks.npy";
  const std::vector<TickRecord> rows{row(1), row(2), row(3), row(4), row(5)};
  CHECK(problem_with(path, rows).empty());
  std::vector<TickRecord> doubled = rows;
  doubled.insert(doubled.begin() + 2, rows[1]);
  CHECK(problem_with(path, doubled) ==
        path.string() + ": row 2 (tick 2, seq 4) cannot follow tick 2, seq 4; copy it again");
  std::vector<TickRecord> exchanged = rows;
  std::swap(exchanged[1], exchanged[3]);
  CHECK(problem_with(path, exchanged).find("row 2 (tick 3, seq 6) cannot follow tick 4, seq 8") !=
        std::string::npos);
  std::vector<TickRecord> appended = rows;
  appended.push_back(row(1));
  CHECK(problem_with(path, appended).find("row 5 (tick 1, seq 2)") != std::string::npos);
  // The first row of a chunk has its predecessor in the chunk before.
  write_rows(path, doubled);
  std::array<TickRecord, 2> chunk;
  std::string problem;
  CHECK(TickLogReader(path).read(2, chunk, problem) == 0);
  CHECK(problem.find("row 2 (tick 2") != std::string::npos);
}

TEST_CASE("the recording of a watched replay, which rests at ticks without a record, is sound") {
  const std::vector<TickRecord> rows{row(1), row(2), row(9, 6), row(10, 6), row(40, 6), row(42, 7)};
  CHECK(are_in_order(rows));
  std::vector<TickRecord> back = rows;
  back[3] = row(10, 5);
  CHECK_FALSE(are_in_order(back));
}

TEST_CASE("losses follow from the rows: a manifest that says others is refused") {
  const LossesOfRows losses = losses_of(4, {7, 8, 20});  // indices 4, 5 and 8 to 18 are lost
  const auto why = [&](RecordLosses said, bool is_final = true, std::uint64_t counted = 0) {
    said.missed_before_start = 4;
    return losses.why_not(said, is_final, counted);
  };
  CHECK(why({.lost = 13, .gaps = {{4, 2}, {8, 11}}}).empty());
  CHECK(why({.lost = 13}).empty());  // a flight recorder lists none
  CHECK(why({.lost = 20, .gaps = {{4, 2}, {8, 11}, {20, 7}}}).empty());  // behind the last row
  CHECK(why({.lost = 12, .gaps = {{4, 2}, {8, 11}}}) == "lost_ticks is 12, and 13 by its rows");
  CHECK(why({.lost = 13, .gaps = {{4, 3}}}).find("gaps has 3 records from index 4") == 0);
  CHECK(why({.lost = 13, .gaps = {{UINT64_MAX, 1}}}).find("lost_ticks is 13, and 14") == 0);
  CHECK(why({.lost = 13, .gaps = {{8, UINT64_MAX}}}).find("gaps has") == 0);
  // A recorder that was killed may not have written down those before rows that it had not counted.
  CHECK(why({.lost = 2, .gaps = {{4, 2}}}, false).empty());
  CHECK(why({.lost = 2, .gaps = {{4, 2}}}, false, 2).empty());
  CHECK(why({.lost = 2, .gaps = {{4, 2}}}, false, 3) ==
        "gaps lacks 11 records from index 8, which are in no row");
  CHECK(why({.lost = 13, .gaps = {{4, 2}, {8, 4}, {12, 7}}}, false, 3).empty());
  CHECK(why({}, false, 1).find("gaps lacks 2 records from index 4") == 0);
  CHECK(why({.lost = 3, .gaps = {{4, 3}}}, false).find("gaps has") == 0);
  CHECK(losses_of(7, {7}).why_not({.missed_before_start = 7}, false, 0) ==
        "missed_before_start is 7, and its first row is of an earlier record");
  const RecordLosses made = losses.as_losses(1);
  CHECK(made.lost == 13);
  REQUIRE(made.gaps.size() == 1);
  CHECK(made.gaps[0].count == 2);
}

TEST_CASE("the seal of a manifest covers each of its bytes") {
  const std::string text =
      sealed(Json{{"tick_ns", 1000000}, {"crc32", "of before"}, {"end_reason", "clean end"}});
  CHECK(seal_of(text) == Seal::whole);
  CHECK(Json::parse(text).at("crc32").get<std::string>().size() == 8);
  for (std::size_t i = 0; i < text.size(); ++i) {
    CAPTURE(i);
    for (const char other : {'x', '0', ' '}) {
      std::string changed = text;
      if (std::exchange(changed[i], other) != other) CHECK(seal_of(changed) != Seal::whole);
    }
    CHECK(seal_of(text.substr(0, i)) != Seal::whole);
  }
  CHECK(seal_of(text + "\n") == Seal::broken);
  CHECK(seal_of("{}") == Seal::none);
}

}  // namespace kerf::recording_check_test
