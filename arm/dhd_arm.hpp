// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <thread>

#include "arm/exchange.hpp"
#include "arm/vendor_arm.hpp"
#include "arm/vendor_library.hpp"

namespace kerf {

/// The functions of Force Dimension's SDK (3.x) that kerf calls, declared by kerf itself. libdrd
/// has all of them.
///
/// C linkage. A last argument `id` is the device; only the SDK's C++ header has a default for it,
/// so kerf always passes it. Results below 0 are errors.
namespace dhd {

struct Calls {
  void (*get_sdk_version)(int* major, int* minor, int* release, int* revision);
  int (*open)();
  int (*open_id)(char index);
  int (*close)(char id);
  bool (*is_initialized)(char id);
  int (*auto_init)(char id);
  int (*stop_regulation)(bool leaves_force, char id);
  const char* (*get_system_name)(char id);
  int (*get_system_type)(char id);
  int (*error_get_last)();  ///< of the calling thread
  const char* (*error_get_last_str)();
  int (*enable_expert_mode)();
  int (*disable_expert_mode)();
  int (*set_watchdog)(unsigned char units_of_125_us, char id);
  int (*enable_force)(unsigned char on, char id);
  int (*get_position)(double* x_m, double* y_m, double* z_m, char id);
  int (*set_force)(double x_n, double y_n, double z_n, char id);
  int (*get_button)(int index, char id);
  int (*get_status)(int* words, char id);  ///< null if the library does not have it
};

}  // namespace dhd

/// An omega of Force Dimension, through libdrd.so.3. Every omega is used as an omega.3, without its
/// wrist. Another device of the vendor, such as a Falcon, opens only if the user has given its peak
/// force; kerf assumes the axes, buttons and range of an omega.3.
///
/// A separate thread runs the frames: position, buttons, one `ArmExchange::turn`, force. The SDK's
/// axes are x to the user, y right, z up, in m: kerf (x, y, z) = (y, z, x) mm.
///
/// The device has no dock: it is parked while button 0 is held. Button 1 is kerf's first button. If
/// the firmware supports it, the device's own watchdog switches the force off 20 ms after the last
/// command. The velocity threshold stays as the vendor has set it.
class DhdArm final : public VendorArm {
 public:
  struct Options {
    std::string library;  ///< empty: libdrd.so.3, libdrd.so
    int index = -1;       ///< of the device; -1: the SDK's choice
    int rate_hz = 4000;
    bool is_peak_given = false;  ///< the user has given the peak force of this device
    bool initializes = false;    ///< if needed; this moves the arm
    int priority = 81;           ///< SCHED_FIFO; 0: none
    int core = -1;               ///< of the thread; -1: the last one
  };
  /// Between two looks at states that seldom change: initialised, force mode. By the clock, so that
  /// it holds at every rate. Shorter than the 5 ms for which the servo holds a force without a
  /// report, so that a lost state is seen no later than a lost report. Whether these calls cost a
  /// transfer is not published; position and buttons are read in each frame.
  static constexpr std::int64_t kLookNs = 4'000'000;
  /// In units of 125 us: 20 ms.
  static constexpr unsigned char kWatchdogUnits = 160;
  /// The device is lost if no position could be read for kGoneS, in at least kFewestUnread tries. A
  /// time, because a call may block; and a number of tries, because a thread that did not run has
  /// not tried.
  static constexpr double kGoneS = 0.1;
  static constexpr int kFewestUnread = 3;

  /// Loads the library. Throws ArmError.
  DhdArm(const Options& options, ArmExchange& exchange);

  void open() override;
  void start() override;
  void stop() override;
  void close() override;
  [[nodiscard]] std::vector<std::string> warnings() const override;
  [[nodiscard]] std::string text_of(std::uint32_t failure) const override;
  [[nodiscard]] std::vector<std::pair<std::string, std::uint64_t>> errors() const override;
  /// True if the device's own watchdog is set. After `open`.
  [[nodiscard]] bool has_watchdog() const noexcept { return has_watchdog_; }

  /// One frame. Only the thread of the frames calls it.
  void frame() noexcept;

 private:
  void run() noexcept;
  void check_type();
  void look_at_states() noexcept;
  [[nodiscard]] bool set_watchdog() noexcept;
  [[nodiscard]] std::string last_error() const;
  void count_error() noexcept;

  Options options_;
  ArmExchange& exchange_;
  VendorLibrary library_;
  dhd::Calls calls_{};
  char id_ = 0;
  int type_ = 0;  ///< dhdGetSystemType
  bool is_open_ = false, has_watchdog_ = false;
  std::jthread thread_;
  // Used by that thread only, until `stop`.
  int unread_ = 0;            ///< consecutive positions that could not be read
  std::int64_t read_ns_ = 0;  ///< when the last one was read; before that, the first try
  std::optional<std::int64_t> looked_ns_;  ///< at the states, last
  bool gives_force_ = true;
  bool is_initialized_ = false;
  std::uint64_t saturated_ = 0;
  std::array<std::uint64_t, 24> error_counts_{};  ///< per SDK error number; then any other
};

}  // namespace kerf
