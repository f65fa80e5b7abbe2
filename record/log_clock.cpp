// SPDX-License-Identifier: Apache-2.0
#include "record/log_clock.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <iterator>
#include <limits>
#include <system_error>

#include "record/npy_header.hpp"
#include "record/tick_log.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/posix/monotonic_clock.hpp"
#include "shared/volume/checksum.hpp"

namespace kerf {
namespace {

std::int64_t utc_now_ns() noexcept {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  return std::int64_t{now.tv_sec} * kNsPerSecond + now.tv_nsec;
}

std::int64_t offset_of(const ClockPair& pair) noexcept {
  return pair.utc_ns - pair.monotonic_ns;
}

/// Whether UTC was set between both: their difference changed by more than the readings can err.
bool was_set(const ClockPair& before, const ClockPair& after) noexcept {
  const double change =
      static_cast<double>(offset_of(after)) - static_cast<double>(offset_of(before));
  return std::abs(change) >
         static_cast<double>(ClockWatch::kStepNs + before.within_ns + after.within_ns);
}

std::string clock_header(std::size_t rows) {
  return npy_header(
      "[('monotonic_ns', '<i8'), ('utc_ns', '<i8'), ('within_ns', '<u4'), ('crc32c', '<u4')]",
      std::to_string(rows) + ",", kClockHeaderBytes);
}

/// Whether a clock can have shown it: Linux refuses to set a date after 2232, so that 30 years of
/// uptime fit into 64 bits. No date before 1823, so that differences fit, too.
bool is_possible(const ClockPair& pair) noexcept {
  constexpr std::int64_t kMostNs = std::int64_t{1} << 62, kLastNs = 8'277'292'036 * kNsPerSecond;
  constexpr std::int64_t kUptimeNs = std::numeric_limits<std::int64_t>::max() - kLastNs;
  return pair.monotonic_ns >= 0 && pair.monotonic_ns <= kUptimeNs && pair.utc_ns >= -kMostNs &&
         pair.utc_ns <= kLastNs;
}

std::string bytes_of(std::span<const ClockPair> pairs) {
  return {reinterpret_cast<const char*>(pairs.data()), pairs.size_bytes()};
}

/// The rows that the header counts; nothing if it is none of this file.
std::optional<std::size_t> rows_of(std::string_view header) {
  constexpr std::string_view kShape = "'shape': (";
  const std::size_t at = header.find(kShape);
  std::size_t rows = 0;
  if (at == std::string_view::npos) return std::nullopt;
  std::from_chars(header.data() + at + kShape.size(), header.data() + header.size(), rows);
  if (header != clock_header(rows)) return std::nullopt;
  return rows;
}

/// The line for what is wrong with clock.npy.
[[nodiscard]] std::string damaged(const std::filesystem::path& path, const std::string& what) {
  return path.string() + ": " + what + "; copy it again";
}

}  // namespace

ClockPair sealed(ClockPair pair) noexcept {
  pair.crc32c = crc32c(std::as_bytes(std::span(&pair, 1)).first(offsetof(ClockPair, crc32c)));
  return pair;
}

ClockPair read_clocks() noexcept {
  constexpr int kTries = 5;
  ClockPair best{};
  for (int i = 0; i < kTries; ++i) {
    const std::int64_t before = monotonic_ns();
    const std::int64_t utc = utc_now_ns();
    const std::int64_t within = monotonic_ns() - before;
    if (i > 0 && within >= best.within_ns) continue;
    best.monotonic_ns = before + within / 2;
    best.utc_ns = utc;
    best.within_ns = static_cast<std::uint32_t>(
        std::min<std::int64_t>(within, std::numeric_limits<std::uint32_t>::max()));
  }
  return sealed(best);
}

std::optional<ClockPair> ClockWatch::take(const ClockPair& now) {
  if (last_ && (is_virtual_ ||
                (now.monotonic_ns - last_->monotonic_ns < kPeriodNs && !was_set(*last_, now)))) {
    return std::nullopt;
  }
  last_ = now;
  if (is_virtual_) last_->monotonic_ns = 0;
  last_ = sealed(*last_);
  return last_;
}

ClockWriter::ClockWriter(const std::filesystem::path& folder, bool is_virtual)
    : folder_(folder), is_virtual_(is_virtual), watch_(is_virtual) {
  const LogClock before = read_clock(folder, false);
  pairs_.assign(before.pairs().begin(), before.pairs().end());
  if (pairs_.empty()) {
    pairs_.push_back(*watch_.take(read_clocks()));
    write_clock(folder_, pairs_);
  }
  follow();
}

bool ClockWriter::follow() {
  if (is_virtual_) return false;  // it has its only pair
  const auto pair = watch_.take(read_clocks());
  if (!pair) return false;
  pairs_.push_back(*pair);
  write_clock(folder_, pairs_);
  return true;
}

std::string clock_bytes(std::span<const ClockPair> pairs) {
  return clock_header(pairs.size()) + bytes_of(pairs);
}

void write_clock(const std::filesystem::path& folder, std::span<const ClockPair> pairs) {
  write_new_file(folder / kClockName, clock_bytes(pairs));
}

std::string LogClock::set_in_the_run() const {
  std::size_t times = 0;
  for (std::size_t i = 1; i < pairs_.size(); ++i)
    times += was_set(pairs_[i - 1], pairs_[i]) ? 1 : 0;
  if (times == 0) return {};
  std::array<char, 64> by{};
  std::snprintf(by.data(), by.size(), "%+.3f",
                static_cast<double>(offset_of(pairs_.back()) - offset_of(pairs_.front())) * 1e-9);
  return "UTC was set in the run" + (times == 1 ? "" : ", " + std::to_string(times) + " times") +
         ", by " + by.data() + " s" + (times == 1 ? "" : " in all") +
         "; dates are those of the clock as it was at the end";
}

LogClock read_clock(const std::filesystem::path& folder, bool is_named) {
  const std::filesystem::path path = folder / kClockName;
  std::error_code none;
  if (!std::filesystem::exists(path, none)) {
    if (!is_named) return {};
    return LogClock({}, damaged(path, "no such file, and the manifest names it"));
  }
  if (!std::filesystem::is_regular_file(path, none)) {
    return LogClock({}, damaged(path, "no regular file"));
  }
  if (std::filesystem::file_size(path, none) > kMostClockBytes) {
    return LogClock({}, damaged(path, "larger than the clock of any run"));
  }
  std::ifstream file = open_recorded(path, way_to_recording(folder));
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  const auto counted = rows_of(std::string_view(text).substr(0, kClockHeaderBytes));
  if (!counted) return LogClock({}, damaged(path, "not the clock of a recording of this version"));
  std::vector<ClockPair> pairs((text.size() - kClockHeaderBytes) / sizeof(ClockPair));
  std::copy_n(text.data() + kClockHeaderBytes, pairs.size() * sizeof(ClockPair),
              reinterpret_cast<char*>(pairs.data()));
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const char* what = nullptr;
    if (i > 0 && pairs[i].monotonic_ns <= pairs[i - 1].monotonic_ns) {
      what = " is not later than the row before";
    }
    if (!is_possible(pairs[i])) what = " has a time that no clock shows";
    if (sealed(pairs[i]).crc32c != pairs[i].crc32c) what = " has a wrong checksum";
    if (what == nullptr) continue;
    pairs.resize(i);
    return LogClock(std::move(pairs), damaged(path, "row " + std::to_string(i) + what));
  }
  std::string problem;
  if (pairs.size() < *counted || pairs.empty()) {
    problem = damaged(path, "cut after " + std::to_string(pairs.size()) + " of " +
                                std::to_string(*counted) + " rows");
  }
  return LogClock(std::move(pairs), std::move(problem));
}

std::string date_text(std::int64_t utc_ns) {
  using namespace std::chrono;
  const sys_time<microseconds> time(floor<microseconds>(nanoseconds(utc_ns)));
  const auto midnight = floor<days>(time);
  const year_month_day day(midnight);
  const hh_mm_ss clock(time - midnight);
  std::array<char, 64> text{};
  std::snprintf(
      text.data(), text.size(), "%04d-%02u-%02uT%02d:%02d:%02d.%06dZ", static_cast<int>(day.year()),
      static_cast<unsigned>(day.month()), static_cast<unsigned>(day.day()),
      static_cast<int>(clock.hours().count()), static_cast<int>(clock.minutes().count()),
      static_cast<int>(clock.seconds().count()), static_cast<int>(clock.subseconds().count()));
  return text.data();
}

}  // namespace kerf
