// SPDX-License-Identifier: Apache-2.0
#include "record/log_clock.hpp"

#include <algorithm>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "shared/segment/ros_messages.hpp"
#include "tests/record/record_support.hpp"

namespace kerf::log_clock_test {

using namespace kerf::test;

namespace {

constexpr std::int64_t kSecond = 1'000'000'000, kHour = 3600 * kSecond;

/// Read `at_ns` after the first, while UTC was `utc_ns` before its first reading.
ClockPair pair_at(std::int64_t at_ns, std::int64_t set_by_ns = 0, std::uint32_t within_ns = 50) {
  constexpr std::int64_t kBegin = 77 * kHour, kUtc = 500'000 * kHour;
  return sealed({kBegin + at_ns, kUtc + at_ns + set_by_ns, within_ns, 0});
}

}  // namespace

TEST_CASE("a pair is kept at the start, each minute, and when UTC was set") {
  ClockWatch watch(false);
  CHECK(watch.take(pair_at(0)));
  CHECK_FALSE(watch.take(pair_at(1)));
  CHECK_FALSE(watch.take(pair_at(60 * kSecond - 1)));
  CHECK(watch.take(pair_at(60 * kSecond)));
  CHECK_FALSE(watch.take(pair_at(61 * kSecond)));
  CHECK_FALSE(watch.take(pair_at(62 * kSecond, 90'000)));            // below a tenth of a tick
  CHECK_FALSE(watch.take(pair_at(63 * kSecond, 900'000, 850'000)));  // a slow reading
  CHECK(watch.take(pair_at(64 * kSecond, -kHour)));
  CHECK_FALSE(watch.take(pair_at(65 * kSecond, -kHour)));
  CHECK(watch.take(pair_at(66 * kSecond, -kHour + 200'000)));
}

TEST_CASE("in lock-step tick 0 has the date of the start") {
  ClockWatch watch(true);
  const auto pair = watch.take(pair_at(5 * kSecond));
  REQUIRE(pair);
  CHECK(pair->monotonic_ns == 0);
  CHECK(pair->utc_ns == pair_at(5 * kSecond).utc_ns);
  CHECK(sealed(*pair).crc32c == pair->crc32c);
  CHECK_FALSE(watch.take(pair_at(3 * kHour, kHour)));
}

TEST_CASE("both clocks are read together") {
  const ClockPair first = read_clocks(), second = read_clocks();
  CHECK(second.monotonic_ns > first.monotonic_ns);
  ClockWatch watch(false);
  CHECK(watch.take(first));
  CHECK_FALSE(watch.take(second));
}

TEST_CASE("dates are those of the last pair, and that UTC was set is a line") {
  const auto offset_after = [](std::vector<ClockPair> pairs) {
    return LogClock(std::move(pairs)).offset_ns() - (pair_at(0).utc_ns - pair_at(0).monotonic_ns);
  };
  CHECK(offset_after({pair_at(0), pair_at(60 * kSecond)}) == 0);
  CHECK(offset_after({pair_at(0), pair_at(kSecond, -kHour)}) == -kHour);
  CHECK(LogClock().offset_ns() == 0);
  CHECK(LogClock({pair_at(0), pair_at(60 * kSecond)}).set_in_the_run().empty());
  CHECK(
      LogClock({pair_at(0), pair_at(9, kHour), pair_at(99, kHour)}).set_in_the_run() ==
      "UTC was set in the run, by +3600.000 s; dates are those of the clock as it was at the end");
  CHECK(
      LogClock({pair_at(0), pair_at(9, kHour), pair_at(99, -kSecond)}).set_in_the_run() ==
      "UTC was set in the run, 2 times, by -1.000 s in all; dates are those of the clock as it was "
      "at the end");
}

TEST_CASE("no bit of clock.npy changes, and no byte is lost, without a word") {
  const RuntimeFolder folder;
  const std::vector<ClockPair> pairs{pair_at(0), pair_at(60 * kSecond), pair_at(120 * kSecond)};
  write_clock(folder.path(), pairs);
  const std::filesystem::path path = folder / "clock.npy";
  const std::string whole = file_text(path);
  const auto read_of = [&](std::string_view bytes) {
    std::ofstream(path, std::ios::binary) << bytes;
    return read_clock(folder.path(), true);
  };
  const LogClock sound = read_of(whole);
  CHECK(sound.problem().empty());
  REQUIRE(sound.pairs().size() == 3);
  CHECK(sound.pairs()[2].utc_ns == pairs[2].utc_ns);
  for (std::size_t bit = 0; bit < whole.size() * 8; ++bit) {
    std::string changed = whole;
    changed[bit / 8] = static_cast<char>(changed[bit / 8] ^ (1 << bit % 8));
    const LogClock clock = read_of(changed);
    INFO(bit);
    // A lower count of the header is that of a recorder that was killed.
    const bool is_as_before = clock.problem().empty() && clock.pairs().size() == 3;
    CHECK((is_as_before || clock.problem().starts_with(path.string() + ": ")));
    CHECK(std::ranges::all_of(clock.pairs(), [&](const ClockPair& pair) {
      return pair.utc_ns - pair.monotonic_ns == pairs[0].utc_ns - pairs[0].monotonic_ns;
    }));
  }
  for (std::size_t size = 0; size < whole.size(); ++size) {
    CHECK_FALSE(read_of(std::string_view(whole).substr(0, size)).problem().empty());
  }
  write_clock(folder.path(), std::vector<ClockPair>{pairs[1], pairs[0]});
  CHECK(read_clock(folder.path(), true).problem() ==
        path.string() + ": row 1 is not later than the row before; copy it again");
  constexpr std::int64_t kLast = std::numeric_limits<std::int64_t>::max();
  for (const ClockPair& pair :
       {ClockPair{1, -kLast, 0, 0}, {1, kLast, 0, 0}, {kLast, 1, 0, 0}, {-1, 1, 0, 0}}) {
    write_clock(folder.path(), std::vector<ClockPair>{pairs[0], sealed(pair)});
    const LogClock clock = read_clock(folder.path(), true);
    CHECK(clock.problem() ==
          path.string() + ": row 1 has a time that no clock shows; copy it again");
    CHECK(clock.pairs().size() == 1);
  }
  std::filesystem::resize_file(path, std::uintmax_t{1} << 40);  // on no block of the disk
  CHECK(read_clock(folder.path(), true).problem() ==
        path.string() + ": larger than the clock of any run; copy it again");
  std::filesystem::remove(path);
  CHECK_FALSE(read_clock(folder.path(), true).problem().empty());
  CHECK(read_clock(folder.path(), false).problem().empty());  // of an earlier version
}

TEST_CASE("a recorder goes on with the clock of the one before") {
  const RuntimeFolder folder;
  const std::filesystem::path path = folder / "clock.npy";
  const auto pairs = [&] {
    const LogClock clock = read_clock(folder.path(), true);
    CHECK(clock.problem().empty());
    return clock.pairs().size();
  };
  {
    ClockWriter clock(folder.path(), false);
    CHECK(pairs() == 1);
    clock.follow();
    CHECK(pairs() == 1);
  }
  std::filesystem::resize_file(path, std::filesystem::file_size(path) + 7);  // killed in a row
  { const ClockWriter clock(folder.path(), false); }
  CHECK(pairs() == 2);
  std::ofstream(path) << "nothing";
  { const ClockWriter clock(folder.path(), true); }
  CHECK(pairs() == 1);
  CHECK(read_clock(folder.path(), true).is_virtual());
  { const ClockWriter clock(folder.path(), true); }
  CHECK(pairs() == 1);
}

TEST_CASE("dates in text, and in the stamps of ROS, also before 1970") {
  CHECK(date_text(0) == "1970-01-01T00:00:00.000000Z");
  CHECK(date_text(-1) == "1969-12-31T23:59:59.999999Z");
  CHECK(date_text(1'795'960'147'910'139'031) == "2026-11-29T13:49:07.910139Z");
  CHECK(date_text(-kHour * 24 * 365 * 100) == "1870-01-25T00:00:00.000000Z");
  TickRecord record{};
  record.start_ns = 2 * kSecond;
  RosMessages messages(1'000'000, -kSecond * 9 / 4);
  CHECK(messages.time_ns(record) == -kSecond / 4);
  const std::string_view force = messages.message(ros_force, record);
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;
  std::memcpy(&sec, force.data() + 4, sizeof sec);
  std::memcpy(&nanosec, force.data() + 8, sizeof nanosec);
  CHECK(sec == -1);
  CHECK(nanosec == 750'000'000);
}

}  // namespace kerf::log_clock_test
