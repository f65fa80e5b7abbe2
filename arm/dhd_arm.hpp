// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <string>
#include <thread>

#include "arm/exchange.hpp"
#include "arm/vendor_arm.hpp"
#include "arm/vendor_library.hpp"

namespace kerf {

/// What kerf calls of Force Dimension's SDK (3.x), in our own words: libdrd has it all.
///
/// C linkage. The last argument, the device's ID, has a default in C++ alone and is always given.
/// Results below 0 are errors.
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
  int (*get_status)(int* words, char id);  ///< null if the library has none
};

}  // namespace dhd

/// An omega of Force Dimension, by libdrd.so.3: as an omega.3, whatever its wrist. Another device
/// of theirs, as the Falcon, opens only if the user has said which force it bears; axes, buttons
/// and range are those of an omega.3.
///
/// A thread of its own runs the frames: position, buttons, one turn, force. The SDK's axes are x to
/// the user, y right, z up, in m: kerf (x, y, z) = (y, z, x) mm.
///
/// The device has no dock: it is parked while button 0 is held, and button 1 is kerf's first
/// button. Its own watchdog switches the force off 20 ms after the last command if the firmware
/// takes it; its velocity threshold stays as the vendor has set it.
class DhdArm final : public VendorArm {
 public:
  struct Options {
    std::string library;  ///< empty: libdrd.so.3, libdrd.so
    int index = -1;       ///< of the device; -1: the SDK's default
    int rate_hz = 4000;
    bool is_peak_given = false;  ///< the exchange's peak is the user's word for this device
    bool initializes = false;    ///< by a motion of its own, if it is not yet
    int priority = 81;           ///< SCHED_FIFO; 0: none
    int core = -1;               ///< -1: the last one
  };
  /// Units of 125 us: 20 ms.
  static constexpr unsigned char kWatchdogUnits = 160;
  /// The device is gone if no position could be read for so long, in at least kFewestUnread tries:
  /// time and not a count of cycles, since a call may block, and a thread that stood still has not
  /// tried.
  static constexpr double kGoneS = 0.1;
  static constexpr int kFewestUnread = 3;

  /// Loads the library. Throws ArmError.
  DhdArm(const Options& options, ArmExchange& exchange);

  void open() override;
  void start() override;
  void stop() override;
  void close() override;
  [[nodiscard]] Facts facts() const override { return facts_; }
  [[nodiscard]] std::vector<std::string> warnings() const override;
  [[nodiscard]] std::string text_of(std::uint32_t failure) const override;
  [[nodiscard]] std::vector<std::pair<std::string, std::uint64_t>> errors() const override;
  [[nodiscard]] const char* notice() const noexcept override { return notice_.load(); }
  /// Whether the device's own watchdog is set. After `open`.
  [[nodiscard]] bool has_watchdog() const noexcept { return has_watchdog_; }

  /// One cycle. The thread of the frames alone.
  void frame() noexcept;

 private:
  void run() noexcept;
  void check_type();
  void follow_force_mode(ArmReading& reading) noexcept;
  [[nodiscard]] bool set_watchdog() noexcept;
  [[nodiscard]] std::string last_error() const;
  void count_error() noexcept;

  Options options_;
  ArmExchange& exchange_;
  VendorLibrary library_;
  dhd::Calls calls_{};
  Facts facts_;
  char id_ = 0;
  int type_ = 0;  ///< dhdGetSystemType
  bool is_open_ = false, has_watchdog_ = false;
  std::jthread thread_;
  std::atomic<const char*> notice_{""};
  // Of that thread, until `stop`.
  int unread_ = 0;            ///< positions in a row that could not be read
  std::int64_t read_ns_ = 0;  ///< when the last one was read, or the first try
  int initialized_look_ = 0, mode_look_ = 0;
  bool gives_force_ = true;
  bool is_initialized_ = false;
  std::uint64_t saturated_ = 0;
  std::array<std::uint64_t, 24> error_counts_{};  ///< by the SDK's number, the last one: any other
};

}  // namespace kerf
