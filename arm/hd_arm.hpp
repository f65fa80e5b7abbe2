// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <optional>
#include <string>

#include "arm/exchange.hpp"
#include "arm/vendor_arm.hpp"
#include "arm/vendor_library.hpp"

namespace kerf {

/// The OpenHaptics HD functions (3.0 and later) that kerf calls, declared by kerf itself.
///
/// C linkage. Device handles, error codes and parameter names (`what`) are unsigned 32-bit, a
/// `priority` is unsigned 16-bit. Vectors are arrays of the caller.
namespace hd {

struct ErrorInfo {
  std::uint32_t code = 0;
  int internal = 0;
  std::uint32_t device = 0;
};
using Callback = std::uint32_t(void* data);

struct Calls {
  std::uint32_t (*init_device)(const char* name);
  void (*disable_device)(std::uint32_t device);
  void (*begin_frame)(std::uint32_t device);
  void (*end_frame)(std::uint32_t device);
  void (*enable)(std::uint32_t what);
  void (*get_booleanv)(std::uint32_t what, std::uint8_t* values);
  void (*get_integerv)(std::uint32_t what, int* values);
  void (*get_doublev)(std::uint32_t what, double* values);
  void (*set_doublev)(std::uint32_t what, const double* values);
  const char* (*get_string)(std::uint32_t what);
  ErrorInfo (*get_error)();
  const char* (*get_error_string)(std::uint32_t code);
  std::uint32_t (*check_calibration)();
  void (*update_calibration)(std::uint32_t style);
  void (*start_scheduler)();
  void (*stop_scheduler)();
  void (*set_scheduler_rate)(unsigned long hz);
  unsigned long (*schedule_asynchronous)(Callback* callback, void* data, std::uint16_t priority);
  void (*unschedule)(unsigned long handle);
};

}  // namespace hd

/// A Touch, Touch X or Omni, through libHD.so.
///
/// One asynchronous callback of the highest priority runs a frame in each tick of the library's
/// servo thread; it never blocks. HD's axes are kerf's; +z of the stylus is the shaft of the tool.
/// The position is the centre of the gimbal, where the force acts.
///
/// A reading is used if the last kCleanFrames frames before it were valid, because the first frames
/// after the start of the scheduler do not contain readings of the arm. Each of these frames checks
/// the calibration, as public clients of the library do in theirs at 1 kHz: without it the arm
/// counts as not homed, and the force is zero in that frame. Frames also update it, at most every
/// kUpdateNs: by the notes of a public client, calibration of a Touch did not complete outside the
/// servo thread, which kerf has not tested. An inkwell calibration needs a running scheduler, which
/// a frame always has.
///
/// HD has one error stack for all threads. The main thread reads it until `start` has checked its
/// calls, then only the servo thread. Callbacks before that return at once.
class HdArm final : public VendorArm {
 public:
  struct Options {
    std::string library;      ///< empty: libHD.so
    bool has_name = true;     ///< false: the library chooses a device
    std::string device_name;  ///< as in the vendor's set-up
    int rate_hz = 0;          ///< 0: the library's own
  };
  static constexpr int kCleanFrames = 3;
  /// Consecutive frames with an error or an invalid orientation that count as a failure.
  static constexpr int kMostUnclean = 1000;
  static constexpr std::int64_t kUpdateNs = 100'000'000;

  /// Loads the library. Throws ArmError.
  HdArm(const Options& options, ArmExchange& exchange);

  void open() override;
  void start() override;
  void stop() override;
  void close() override;
  [[nodiscard]] std::string text_of(std::uint32_t failure) const override;
  [[nodiscard]] std::vector<std::pair<std::string, std::uint64_t>> errors() const override;

  /// One tick of the servo thread. Returns HD's code to continue or to end the callback.
  [[nodiscard]] std::uint32_t frame() noexcept;

 private:
  /// Takes all errors from the library's stack and counts them. Returns the newest one that makes a
  /// frame invalid, or 0. An error that means a lost device fails the exchange.
  std::uint32_t pop_errors() noexcept;
  void require_no_error(const char* call);
  [[nodiscard]] bool read(ArmReading& reading) noexcept;
  [[nodiscard]] bool follow_calibration(bool is_docked) noexcept;
  [[nodiscard]] std::string fact(std::uint32_t what) const;
  [[nodiscard]] std::string described(std::uint32_t code) const;

  Options options_;
  ArmExchange& exchange_;
  VendorLibrary library_;
  hd::Calls calls_{};
  std::uint32_t device_ = 0;
  unsigned long scheduled_ = 0;
  bool is_open_ = false, is_started_ = false, is_scheduled_ = false;
  std::uint32_t calibration_style_ = 0;
  std::atomic<bool> owns_errors_{false};  ///< the servo thread reads the error stack
  std::atomic<bool> has_ended_{false};    ///< of the callback
  // Used by the servo thread only, until `stop`.
  int clean_ = 0, unclean_ = 0;
  std::uint32_t unclean_code_ = 0;
  std::optional<std::int64_t> updated_ns_;        ///< the last update of the calibration
  std::array<std::uint64_t, 24> error_counts_{};  ///< per entry of kHdErrors; then any other
};

}  // namespace kerf
