// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <optional>

#include "shared/arm/arm_page.hpp"
#include "shared/numeric/statistics.hpp"
#include "shared/posix/monotonic_clock.hpp"

namespace kerf {

/// What a vendor's library reports in one frame, in kerf's frame and units: x right, y up, z to the
/// user, mm; orientation of the tool as x, y, z, w.
struct ArmReading {
  std::array<double, 3> position_mm{};
  std::array<double, 4> orientation{0, 0, 0, 1};
  bool button1 = false, button2 = false;
  bool parked = false;
  bool homed = false;
  bool powered = true;  ///< it can give a force
};

/// Orientation of a tool whose axes are the columns `x`, `y`, `z`. Empty unless each column has a
/// squared length of 1 within 0.05, each pair a dot product of 0 within 0.05 (3 degrees from the
/// right angle), and the three are right-handed.
[[nodiscard]] std::optional<std::array<double, 4>> orientation_of(
    const std::array<double, 3>& x, const std::array<double, 3>& y,
    const std::array<double, 3>& z) noexcept;

/// The exchange between the frames of a vendor's library and the page. In each frame one reading
/// goes out and one force comes in.
///
/// `turn` is called by the thread of the frames only; it never blocks, allocates or throws. Any
/// thread may call the rest, unless noted.
class ArmExchange {
 public:
  using Clock = std::int64_t() noexcept;

  /// The force is zero at the latest this long after the last command, whatever has happened to the
  /// controller.
  static constexpr std::int64_t kZeroNs = 20'000'000;
  /// Lowest frame rate: at this rate commands still live for three quarters of `kZeroNs`.
  static constexpr int kSlowestHz = 200;
  /// After `let_go` the exchange is finished once all frames over this time, and at least kFewest,
  /// had zero force. A time, not a count, because a library may run at another rate than requested.
  static constexpr double kZeroS = 0.02;
  static constexpr int kFewest = 3;

  ArmExchange(ArmPageAdapter& page, double peak_n, int rate_hz,
              Clock* clock = monotonic_ns) noexcept;

  /// One exchange. Returns the force of this frame, in N in kerf's frame: that of the newest
  /// command, at most the peak; zero before the first reading, without a command that has not
  /// expired, and after `let_go`. Always finite. Without a reading, or if it is not a pose, no
  /// report is published, and the servo decides how long its force stays: docs/safety.md, "report
  /// lost".
  [[nodiscard]] std::array<double, 3> turn(const std::optional<ArmReading>& reading) noexcept;

  /// Zero force from the next frame on, for good.
  void let_go() noexcept { is_let_go_.store(true); }
  /// Whether enough frames of zero force have passed since.
  [[nodiscard]] bool finished() const noexcept { return is_finished_.load(); }

  /// The first failure stays: a code of the library, or one of these. Zero force from then on.
  enum : std::uint32_t { kStalled = 0xffff0001, kUnreadable, kSilent };
  void fail(std::uint32_t code) noexcept;
  /// 0: none.
  [[nodiscard]] std::uint32_t failure() const noexcept { return failure_.load(); }

  /// The clock of the exchanges.
  [[nodiscard]] std::int64_t now_ns() const noexcept { return clock_(); }
  /// Frames so far: the heartbeat.
  [[nodiscard]] std::uint64_t frames() const noexcept { return frames_.load(); }
  [[nodiscard]] std::uint64_t published() const noexcept { return published_.load(); }

  /// Once the frames have ended.
  struct Counts {
    std::uint64_t unreadable = 0;  ///< readings that are no pose
    std::uint64_t forced = 0;      ///< frames with a force
    std::uint64_t expired = 0;     ///< times that a force ended because its command was too old
    std::uint64_t clamped = 0;     ///< frames whose force was above the peak
    Histogram turn;                ///< duration of an exchange
    Histogram command_age;         ///< of the commands whose force was given
  };
  [[nodiscard]] const Counts& counts() const noexcept { return counts_; }

 private:
  [[nodiscard]] std::array<double, 3> commanded(std::int64_t now_ns) noexcept;
  void count_zero_frame(std::int64_t now_ns) noexcept;
  [[nodiscard]] bool publish(const ArmReading& reading, std::int64_t now_ns) noexcept;

  ArmPageAdapter& page_;
  double peak_n_;
  /// A command expires one frame before `kZeroNs`, and at least 1 ms before it.
  std::int64_t command_life_ns_;
  Clock* clock_;
  std::atomic<bool> is_let_go_{false}, is_finished_{false};
  std::atomic<std::uint32_t> failure_{0};
  std::atomic<std::uint64_t> frames_{0}, published_{0};
  std::array<double, 3> last_force_n_{};
  int zero_frames_ = 0;  ///< since `let_go`
  std::int64_t zero_since_ns_ = 0;
  Counts counts_;
};

}  // namespace kerf
