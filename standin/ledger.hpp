// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

/// What a program did with a stand-in: counts in a file that outlives it, however it ends.
namespace kerf::standin {

/// A row of the ledger: a count, or a number.
enum class Row : std::uint8_t {
  // counts
  opened,             ///< devices
  closed,             ///< by the program
  ticks,              ///< of the servo thread (HD), force commands (dhd)
  missed_ticks,       ///< deadlines that the servo thread did not meet by a period or more
  commands,           ///< forces that the program commanded
  frames,             ///< that were ended
  frames_not_ended,   ///< open at the end of their tick
  begins_refused,     ///< a second frame in a tick, or in a frame
  ends_refused,       ///< without a frame
  set_outside_frame,  ///< a force
  bad_handles,        ///< of a device (HD), IDs (dhd)
  bad_schedules,      ///< handles of callbacks that are not scheduled
  not_finite,         ///< forces
  output_off,         ///< forces while the program had the output off
  before_enable,      ///< forces before dhdEnableForce that were given all the same
  after_trip,         ///< forces after the device had switched its motors off by itself
  not_cleared,        ///< scheduler stopped or device closed with a force
  stalls,             ///< callbacks (HD) or pauses with a force (dhd) longer than allowed
  excess,             ///< forces above the limit of the device
  impulses,           ///< steps of force above the limit
  too_fast,           ///< ticks above the limit of speed
  lost_link,          ///< times that the device was found to be gone
  watchdog,           ///< expiries (dhd)
  in_use,             ///< times that a program opened a device of another one
  warm,               ///< times that a motor became warm (HD)
  // numbers
  square_sum_n2,      ///< of the force of all commands
  peak_n,             ///< of a command
  last_n,             ///< of the newest packet; 0 after a close
  longest_us,         ///< callback
  longest_period_us,  ///< between two ticks
  end
};

inline constexpr std::size_t kRows = static_cast<std::size_t>(Row::end);

/// The ledger. Any thread, several processes at once; wait-free but for the sums of numbers, which
/// retry; nothing allocates or throws after the constructor.
///
/// The file, little-endian: "kerfldg1", u32 number of rows, u32 number of buckets; for each row its
/// name in 39 bytes, 'u' or 'd', and 8 bytes of a u64 or a double; then a u64 for each bucket of
/// kBucketUs: periods between ticks, the last one with all longer ones. Counts add up over the
/// programs that write to one file.
class Ledger {
 public:
  static constexpr std::size_t kBuckets = 2000;
  static constexpr std::int64_t kBucketUs = 10;

  /// Creates the file, or adds to one. Empty path, or a file that cannot be: counts that end with
  /// the process.
  explicit Ledger(const std::string& path) noexcept;
  Ledger(const Ledger&) = delete;
  Ledger& operator=(const Ledger&) = delete;

  void add(Row row, std::uint64_t count = 1) noexcept {
    word(row).fetch_add(count, std::memory_order_relaxed);
  }
  void sum(Row row, double value) noexcept;
  void raise_to(Row row, double value) noexcept;
  void set(Row row, double value) noexcept {
    word(row).store(std::bit_cast<std::uint64_t>(value), std::memory_order_relaxed);
  }
  void record_period_us(std::int64_t us) noexcept;
  /// The program commands this force, whatever becomes of it.
  void record_force_n(double force_n) noexcept;

  [[nodiscard]] std::uint64_t count(Row row) const noexcept;

 private:
  struct Line {
    std::array<char, 39> name;
    char kind;
    std::uint64_t value;
  };
  struct Page {
    std::array<char, 8> magic;
    std::uint32_t rows, buckets;
    std::array<Line, kRows> lines;
    std::array<std::uint64_t, kBuckets> periods;
  };
  static_assert(sizeof(Line) == 48 && sizeof(Page) == 16 + kRows * 48 + kBuckets * 8);

  [[nodiscard]] std::atomic_ref<std::uint64_t> word(Row row) const noexcept {
    return std::atomic_ref(page_->lines[static_cast<std::size_t>(row)].value);
  }

  Page own_{};
  Page* page_ = &own_;
};

/// The name of a row, as the file has it.
[[nodiscard]] std::string_view name_of(Row row) noexcept;

}  // namespace kerf::standin
