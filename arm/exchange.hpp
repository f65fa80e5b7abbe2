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

/// The report of a vendor's library in one frame, in kerf's axes and units: x right, y up, z to the
/// user, mm; orientation of the tool as quaternion x, y, z, w.
struct ArmReading {
  std::array<double, 3> position_mm{};
  std::array<double, 4> orientation{0, 0, 0, 1};
  bool button1 = false, button2 = false;
  bool parked = false;
  bool homed = false;
  bool powered = true;  ///< the device can exert a force
};

/// Orientation of a tool with the axes `x`, `y`, `z`, as a quaternion. nullopt unless each axis has
/// a squared length of 1 within 0.05, each pair a dot product of 0 within 0.05 (3 degrees from a
/// right angle), and the three are right-handed.
[[nodiscard]] std::optional<std::array<double, 4>> orientation_of(
    const std::array<double, 3>& x, const std::array<double, 3>& y,
    const std::array<double, 3>& z) noexcept;

/// The exchange between the frames of a device and the page: in each frame it publishes one reading
/// and returns one force.
///
/// Only the thread of the frames calls `turn`, or in its place `publish`, `command` and
/// `await_command`; none of them allocates or throws, and only the last one blocks. Any thread may
/// call the rest, unless noted.
class ArmExchange {
 public:
  using Clock = std::int64_t() noexcept;

  /// The force is zero at most this long after the last command, even if the controller has
  /// crashed.
  static constexpr std::int64_t kZeroNs = 20'000'000;
  /// Lowest frame rate; with it a command lives for three quarters of `kZeroNs`.
  static constexpr int kSlowestHz = 200;
  /// After `let_go` the exchange is finished once frames of zero force have run for this time, and
  /// at least kFewest of them. A time, because a library may run at another rate than requested.
  static constexpr double kZeroS = 0.02;
  static constexpr int kFewest = 3;

  ArmExchange(ArmPageAdapter& page, double peak_n, int rate_hz,
              Clock* clock = monotonic_ns) noexcept;

  /// One exchange. Returns the force of this frame in N, in kerf's axes: that of the newest
  /// command, scaled down to the peak. Zero before the first valid reading, if the newest reading
  /// is not homed, if there is no command or it has expired, and after `let_go`. Always finite. If
  /// `reading` is empty or not a valid pose, publishes no report; the servo then decides how long
  /// its force stays (docs/safety.md, "report lost").
  [[nodiscard]] std::array<double, 3> turn(const std::optional<ArmReading>& reading) noexcept;

  // A frame in two halves, for a device whose frames are messages to a service, which has limits of
  // its own (ServiceArm).

  /// Publishes the report as it is, but for its number.
  void publish(const CartesianReport& report) noexcept;
  /// The command of this frame: the newest one; nothing if there is none, if it has expired, and
  /// after `let_go`.
  [[nodiscard]] std::optional<TimedCommand> command() noexcept;
  /// Sleeps until there is a newer command than that of the last frame, at most until `until_ns`.
  /// Whether there is.
  [[nodiscard]] bool await_command(std::int64_t until_ns) const noexcept {
    return page_.await_command(ticket_, until_ns);
  }
  /// The thread of the frames lives, though it has none now.
  void beat() noexcept { beats_.fetch_add(1); }

  /// The device runs in lock-step at this rate: commands do not expire, and after `let_go` no
  /// frame is needed, since none comes unasked. Before the first frame.
  void set_lockstep(int rate_hz) noexcept;
  [[nodiscard]] bool in_lockstep() const noexcept { return in_lockstep_; }

  /// Zero force from the next frame on. Cannot be undone.
  void let_go() noexcept {
    is_let_go_.store(true);
    if (in_lockstep_) is_finished_.store(true);
  }
  [[nodiscard]] bool is_let_go() const noexcept { return is_let_go_.load(); }
  /// True after enough frames of zero force since then.
  [[nodiscard]] bool finished() const noexcept { return is_finished_.load(); }

  /// Reports a failure: a code of the library, or one of these. The first one is kept. Also calls
  /// `let_go`.
  static constexpr std::uint32_t kStalled = 0xffff0001, kUnreadable = 0xffff0002,
                                 kSilent = 0xffff0003;
  void fail(std::uint32_t code) noexcept;
  /// 0 if there is none.
  [[nodiscard]] std::uint32_t failure() const noexcept { return failure_.load(); }

  /// The clock that the exchange uses.
  [[nodiscard]] std::int64_t now_ns() const noexcept { return clock_(); }
  /// Number of frames so far.
  [[nodiscard]] std::uint64_t frames() const noexcept { return frames_.load(); }
  /// Changes while the thread of the frames lives.
  [[nodiscard]] std::uint64_t heartbeat() const noexcept { return frames_.load() + beats_.load(); }
  [[nodiscard]] std::uint64_t published() const noexcept { return published_.load(); }

  /// To be read after the frames have ended.
  struct Counts {
    std::uint64_t unreadable = 0;  ///< readings that are not a valid pose
    std::uint64_t forced = 0;      ///< frames with a force other than zero
    std::uint64_t expired = 0;     ///< times that a force ended because its command expired
    std::uint64_t clamped = 0;     ///< frames whose command was above the peak
    Histogram turn;                ///< duration of an exchange
    Histogram command_age;         ///< of the commands that were used
  };
  [[nodiscard]] const Counts& counts() const noexcept { return counts_; }

 private:
  [[nodiscard]] std::array<double, 3> commanded(std::int64_t now_ns) noexcept;
  [[nodiscard]] std::optional<TimedCommand> current(std::int64_t now_ns) noexcept;
  void count_zero_frame(std::int64_t now_ns) noexcept;
  [[nodiscard]] bool publish(const ArmReading& reading, std::int64_t now_ns) noexcept;

  ArmPageAdapter& page_;
  double peak_n_;
  /// A command expires one frame before `kZeroNs`, and at least 1 ms before it.
  std::int64_t command_life_ns_;
  Clock* clock_;
  std::atomic<bool> is_let_go_{false}, is_finished_{false};
  std::atomic<std::uint32_t> failure_{0};
  std::atomic<std::uint64_t> frames_{0}, beats_{0}, published_{0};
  bool in_lockstep_ = false;
  std::uint64_t ticket_ = 0;  ///< of the last frame's command; 0: none
  std::array<double, 3> last_force_n_{};
  bool is_homed_ = false;  ///< by the newest reading
  int zero_frames_ = 0;    ///< since `let_go`
  std::int64_t zero_since_ns_ = 0;
  Counts counts_;
};

}  // namespace kerf
