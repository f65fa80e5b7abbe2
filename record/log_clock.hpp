// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

// The date of a recording: clock.npy, readings of CLOCK_MONOTONIC, the time of the rows, and of UTC
// at one moment.

namespace kerf {

inline constexpr std::string_view kClockName = "clock.npy";
/// The header of clock.npy.
inline constexpr std::size_t kClockHeaderBytes = 256;

/// No clock.npy is larger: a row of 24 bytes a minute for five years. The ticks of such a run have
/// 78 TB at 1 kHz.
inline constexpr std::uintmax_t kMostClockBytes = std::uintmax_t{64} << 20;

/// One row of clock.npy, little-endian.
struct ClockPair {
  std::int64_t monotonic_ns;  ///< CLOCK_MONOTONIC; in lock-step 0, the time of tick 0
  std::int64_t utc_ns;        ///< at that moment, since 1970-01-01; negative before it
  std::uint32_t within_ns;    ///< both were read within this time, at most 4.29 s
  std::uint32_t crc32c;       ///< of the bytes before
};
static_assert(sizeof(ClockPair) == 24);

/// The pair with its checksum.
[[nodiscard]] ClockPair sealed(ClockPair pair) noexcept;

/// Reads both clocks, without a system call: the closest of several tries.
[[nodiscard]] ClockPair read_clocks() noexcept;

/// Chooses the pairs of a run that are kept: the first, one a minute, and one after each time that
/// UTC was set. NTP adjusts the rate of both clocks alike, so only setting changes their
/// difference.
class ClockWatch {
 public:
  /// `is_virtual`: in lock-step. Time is then the ticks', so the only pair gives tick 0 the date of
  /// the first reading.
  explicit ClockWatch(bool is_virtual) : is_virtual_(is_virtual) {}

  /// `now`, if it is to be kept.
  [[nodiscard]] std::optional<ClockPair> take(const ClockPair& now);

  static constexpr std::int64_t kPeriodNs = 60'000'000'000;
  /// Smaller steps are not noticed: they change a date by less than a tenth of a tick at 1 kHz.
  static constexpr std::int64_t kStepNs = 100'000;

 private:
  bool is_virtual_;
  std::optional<ClockPair> last_;
};

/// clock.npy of a recorder, as it grows: with each row a new file, whole or not at all.
class ClockWriter {
 public:
  /// Makes the file with the first pair, or goes on behind the sound pairs of the recorder before.
  /// Throws FileError.
  ClockWriter(const std::filesystem::path& folder, bool is_virtual);

  /// At each poll: appends a pair if one is due. Whether it did. Throws FileError.
  bool follow();

 private:
  std::filesystem::path folder_;
  std::vector<ClockPair> pairs_;
  bool is_virtual_;
  ClockWatch watch_;
};

/// The bytes of clock.npy with these rows.
[[nodiscard]] std::string clock_bytes(std::span<const ClockPair> pairs);

/// Writes clock.npy, whole or not at all. Throws FileError.
void write_clock(const std::filesystem::path& folder, std::span<const ClockPair> pairs);

/// The dates of a recording. All rows are dated by the last pair, so differences of dates are those
/// of the run, and dates do not run back; after UTC was set in the run, rows before have the date
/// that the set clock would have shown.
class LogClock {
 public:
  LogClock() = default;  ///< of a recording without dates
  explicit LogClock(std::vector<ClockPair> pairs, std::string problem = {})
      : pairs_(std::move(pairs)), problem_(std::move(problem)) {}

  [[nodiscard]] bool has_date() const noexcept { return !pairs_.empty(); }
  [[nodiscard]] bool is_virtual() const noexcept {
    return has_date() && pairs_.front().monotonic_ns == 0;
  }
  /// To be added to a row's `start_ns`; 0 without dates.
  [[nodiscard]] std::int64_t offset_ns() const noexcept {
    return has_date() ? pairs_.back().utc_ns - pairs_.back().monotonic_ns : 0;
  }
  [[nodiscard]] std::span<const ClockPair> pairs() const noexcept { return pairs_; }

  /// One line for what is wrong with clock.npy; `pairs` are those before it. Empty: nothing.
  [[nodiscard]] const std::string& problem() const noexcept { return problem_; }

  /// One line, to follow the path of clock.npy, if UTC was set in the run; else empty.
  [[nodiscard]] std::string set_in_the_run() const;

 private:
  std::vector<ClockPair> pairs_;
  std::string problem_;
};

/// Reads clock.npy of the recording in `folder`; without dates if it has none and its manifest
/// names none (`is_named`): earlier versions kept none. Throws `RecordError` if it is missing, cut,
/// or a row is damaged or not later than the row before.
[[nodiscard]] LogClock read_clock(const std::filesystem::path& folder, bool is_named);

/// Text such as 2026-11-29T13:40:12.345678Z, rounded down.
[[nodiscard]] std::string date_text(std::int64_t utc_ns);

}  // namespace kerf
