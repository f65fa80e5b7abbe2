// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>

#include <unistd.h>

#include "shared/numeric/vec.hpp"
#include "shared/wire/cartesian.hpp"
#include "standin/ledger.hpp"
#include "standin/settings.hpp"

/// The arm behind a stand-in: a client of kerf-emulator's socket.
namespace kerf::standin {

/// Pose of the arm in kerf's device frame, from one report.
struct Pose {
  std::uint32_t number = 0;  ///< of the report, from 1
  DeviceVec<double> tip_mm;
  std::array<double, 4> orientation{0, 0, 0, 1};  ///< of the tool: x, y, z, w
  DeviceVec<double> applied_n;                    ///< force that the device gives
  bool button1 = false, button2 = false, parked = false;
};

/// The length of any finite force: its square may be too large for a double.
[[nodiscard]] inline double length_of(DeviceVec<double> force_n) noexcept {
  return std::hypot(force_n.x, force_n.y, force_n.z);
}

/// The connection to an emulated Cartesian device, in real time or in lock-step, and the newest
/// poses. One thread at a time.
///
/// Real time: reports arrive by themselves, a command is sent at once. Lock-step: `command` also
/// waits for the report of the next tick, so the speed of the program changes nothing.
class EmulatedArm {
 public:
  /// Called with each report in its turn, `dt_s` of the device's clock after the one before (0 for
  /// the first): what a device keeps of its own, and may put into the pose. Does not throw.
  using Follow = std::function<void(Pose& now, double dt_s)>;

  /// Connects and receives the first report. Throws std::runtime_error with one line.
  EmulatedArm(const Settings& settings, const DeviceSettings& device, Ledger& ledger,
              Follow follow = {});
  /// No arm, but one pose for ever; commands go nowhere.
  EmulatedArm(const Settings& settings, const DeviceSettings& device, const Pose& still,
              Ledger& ledger) noexcept;
  EmulatedArm(const EmulatedArm&) = delete;
  EmulatedArm& operator=(const EmulatedArm&) = delete;
  ~EmulatedArm();

  /// Takes in the reports that wait. Never waits.
  void refresh() noexcept;
  /// Sends a force in N; one that is not finite is 0. In lock-step without an emulator that has the
  /// next tick, waits for as long as a tick of the device lasts.
  void command(DeviceVec<double> force_n, bool on, bool ready) noexcept;
  /// Counts a force that the program commands, in N; none after the emulator has ended.
  void count_command(double wanted_n) noexcept;

  [[nodiscard]] const Pose& pose() const noexcept { return history_[newest_]; }
  /// Mean velocity over the poses of the last `window_s`, mm/s; empty with fewer than two of them.
  [[nodiscard]] std::optional<DeviceVec<double>> velocity(double window_s) const noexcept;
  /// Mean angular velocity over these poses, rad/s; zero with fewer than two of them.
  [[nodiscard]] DeviceVec<double> angular_velocity(double window_s) const noexcept;
  /// The emulator has ended, or has not sent a report for kSilenceS: of the clock, or of the ticks
  /// of lock-step. Each time that it comes to this is counted.
  [[nodiscard]] bool lost() noexcept;
  /// Time of the newest pose by the device's clock, s.
  [[nodiscard]] double time_s() const noexcept { return pose().number / report_hz_; }
  [[nodiscard]] bool lockstep() const noexcept { return lockstep_; }

  static constexpr double kSilenceS = 0.1;

 private:
  void connect_to(const std::string& path);
  void agree(const DeviceSettings& device);
  /// Takes in one datagram: a report, or a turn of them. Returns whether there was one.
  bool take(int timeout_ms) noexcept;
  void take_packet(std::span<const std::uint8_t> bytes) noexcept;
  [[nodiscard]] const Pose* oldest_within(double window_s) const noexcept;

  static constexpr std::size_t kHistory = 1024;

  Ledger& ledger_;
  Follow follow_;
  int fd_ = -1;
  pid_t opener_ = getpid();
  bool closed_ = false;
  bool is_still_ = false;  ///< it is no arm
  bool hand_waits_;        ///< until the first force
  bool lockstep_;
  double report_hz_ = 1000;
  std::array<Pose, kHistory> history_{};
  std::size_t newest_ = 0, known_ = 0;
  std::int64_t heard_ns_ = 0;
  int silent_ticks_ = 0;
  bool was_lost_ = false;
};

}  // namespace kerf::standin
