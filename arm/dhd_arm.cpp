// SPDX-License-Identifier: Apache-2.0
#include "arm/dhd_arm.hpp"

#include <algorithm>
#include <cstddef>

#include "arm/arm_error.hpp"
#include "arm/overseer.hpp"
#include "shared/posix/stop_signals.hpp"
#include "shared/posix/threads.hpp"

namespace kerf {
namespace {

constexpr int kSdkMajor = 3;
constexpr int kSaturated = 2;  // a result, not an error
constexpr int kExpertModeDisabled = 9;
constexpr double kMmPerM = 1000;

constexpr const char* kDhdErrors[] = {
    "no error",        "error",         "communication",    "controller busy",   "no driver",
    "no device",       "not available", "timeout",          "geometry",          "expert mode off",
    "not implemented", "out of memory", "device not ready", "file not found",    "configuration",
    "invalid index",   "deprecated",    "null argument",    "redundant sensors", "not enabled",
    "device in use",   "invalid",       "no regulation"};
constexpr std::size_t kKnownDhdErrors = std::size(kDhdErrors);

/// Values of dhdGetSystemType, from the SDK's header. Of two with one name, the second is the
/// left-hand version.
struct DeviceType {
  int number;
  const char* name;
};
constexpr DeviceType kDeviceTypes[] = {
    {33, "omega.3"},   {34, "omega.6"},   {36, "omega.6"},    {35, "omega.7"},    {37, "omega.7"},
    {60, "Falcon"},    {63, "delta.3"},   {81, "controller"}, {82, "controller"}, {91, "custom"},
    {104, "sigma.7"},  {105, "sigma.7"},  {108, "lambda.7"},  {109, "lambda.7"},  {131, "lambda.6"},
    {132, "lambda.6"}, {203, "lambda.3"}, {206, "sigma.3"}};
constexpr int kOmega3 = 33, kFirstOmega = 33, kLastOmega = 37;

constexpr bool is_omega(int type) noexcept {
  return type >= kFirstOmega && type <= kLastOmega;
}

std::string described(int type) {
  const auto* known = std::ranges::find(kDeviceTypes, type, &DeviceType::number);
  return "type " + std::to_string(type) + ", " +
         (known != std::end(kDeviceTypes) ? known->name : "a type that kerf does not know");
}

}  // namespace

DhdArm::DhdArm(const Options& options, ArmExchange& exchange)
    : options_(options),
      exchange_(exchange),
      library_(options.library, {"libdrd.so.3", "libdrd.so"}, "the SDK of Force Dimension") {
  library_.find("dhdGetSDKVersion", calls_.get_sdk_version);
  library_.find("drdOpen", calls_.open);
  library_.find("drdOpenID", calls_.open_id);
  library_.find("drdClose", calls_.close);
  library_.find("drdIsInitialized", calls_.is_initialized);
  library_.find("drdAutoInit", calls_.auto_init);
  library_.find("drdStop", calls_.stop_regulation);
  library_.find("dhdGetSystemName", calls_.get_system_name);
  library_.find("dhdGetSystemType", calls_.get_system_type);
  library_.find("dhdErrorGetLast", calls_.error_get_last);
  library_.find("dhdErrorGetLastStr", calls_.error_get_last_str);
  library_.find("dhdEnableExpertMode", calls_.enable_expert_mode);
  library_.find("dhdDisableExpertMode", calls_.disable_expert_mode);
  library_.find("dhdSetWatchdog", calls_.set_watchdog);
  library_.find("dhdEnableForce", calls_.enable_force);
  library_.find("dhdGetPosition", calls_.get_position);
  library_.find("dhdSetForce", calls_.set_force);
  library_.find("dhdGetButton", calls_.get_button);
  library_.require_all();
  library_.find("dhdGetStatus", calls_.get_status);  // optional: without it the mode is unknown
}

void DhdArm::open() {
  static_assert(kKnownDhdErrors < std::tuple_size_v<decltype(error_counts_)>);
  std::array<int, 4> version{};
  calls_.get_sdk_version(&version[0], &version[1], &version[2], &version[3]);
  std::string sdk;
  for (const int part : version) sdk += (sdk.empty() ? "" : ".") + std::to_string(part);
  if (version[0] != kSdkMajor) {
    throw ArmError(library_.file() + ": SDK " + sdk + ", and kerf-arm knows 3; install SDK 3");
  }
  const int id =
      options_.index < 0 ? calls_.open() : calls_.open_id(static_cast<char>(options_.index));
  if (id < 0) {
    throw ArmError("device" + (options_.index < 0 ? "" : " " + std::to_string(options_.index)) +
                   ": cannot be opened (" + last_error() +
                   "); check cable, power and the rights of its USB node, and end other programs "
                   "that use it");
  }
  id_ = static_cast<char>(id);
  is_open_ = true;
  const char* const name = calls_.get_system_name(id_);
  facts_ = {{"library", library_.file()}, {"version", sdk}, {"model", name != nullptr ? name : ""}};
  check_type();
  is_initialized_ = calls_.is_initialized(id_);
  if (!is_initialized_ && options_.initializes) {
    static_cast<void>(set_watchdog());  // so that the motion does not outlive this process
    if (calls_.auto_init(id_) < 0) throw ArmError("--auto-init: " + last_error());
    // Ends the SDK's own regulation; the force stays enabled.
    if (calls_.stop_regulation(true, id_) < 0) throw ArmError("--auto-init: " + last_error());
    is_initialized_ = calls_.is_initialized(id_);
  }
  has_watchdog_ = set_watchdog();
  facts_.emplace_back("watchdog", has_watchdog_ ? "20 ms" : "none: " + last_error());
  if (calls_.enable_force(1, id_) < 0) {
    throw ArmError("dhdEnableForce: " + last_error() +
                   "; release the device's force button, and see the vendor's manual");
  }
}

void DhdArm::check_type() {
  type_ = calls_.get_system_type(id_);
  if (type_ <= 0) {
    throw ArmError("device type " + std::to_string(type_) +
                   ": none that the library knows; check cable and power, and install the SDK of "
                   "this device");
  }
  facts_.emplace_back("type", described(type_));
  if (is_omega(type_) || options_.is_peak_given) return;
  throw ArmError("device of " + described(type_) +
                 ": no omega, and kerf knows no limits of another; say which force in N it bears "
                 "all the time by its data sheet: --peak N, at most 12");
}

bool DhdArm::set_watchdog() noexcept {
  if (calls_.set_watchdog(kWatchdogUnits, id_) >= 0) return true;
  if (calls_.error_get_last() != kExpertModeDisabled) return false;
  // Expert mode is process-wide, so it is on for this call only.
  if (calls_.enable_expert_mode() < 0) return false;
  const bool is_set = calls_.set_watchdog(kWatchdogUnits, id_) >= 0;
  static_cast<void>(calls_.disable_expert_mode());
  return is_set;
}

void DhdArm::start() {
  thread_ = std::jthread([this] { run(); });
}

void DhdArm::stop() {
  if (thread_.joinable()) thread_.join();
}

void DhdArm::close() {
  if (!is_open_) return;
  is_open_ = false;
  static_cast<void>(calls_.close(id_));
}

void DhdArm::run() noexcept {
  const BlockStopSignals to_the_main_thread;
  Overseer::give_crash_stack();
  if (options_.priority > 0) {
    static_cast<void>(pin_to_core(options_.core >= 0 ? options_.core : allowed_cores().back()));
    static_cast<void>(set_fifo(options_.priority));
  }
  const std::int64_t period_ns = kNsPerSecond / options_.rate_hz;
  std::int64_t next_ns = monotonic_ns();
  while (!exchange_.finished()) {
    frame();
    // Skips missed cycles: this thread has a higher priority than the servo by default, so it must
    // sleep.
    const std::int64_t late_ns = std::max<std::int64_t>(monotonic_ns() - next_ns, 0);
    next_ns += (late_ns / period_ns + 1) * period_ns;
    sleep_until_ns(next_ns);
  }
  static_cast<void>(calls_.enable_force(0, id_));
}

void DhdArm::frame() noexcept {
  double x_m = 0;
  double y_m = 0;
  double z_m = 0;
  std::optional<ArmReading> reading;
  if (calls_.get_position(&x_m, &y_m, &z_m, id_) >= 0) {
    unread_ = 0;
    read_ns_ = exchange_.now_ns();
    look_at_states();
    reading = ArmReading{.position_mm = {kMmPerM * y_m, kMmPerM * z_m, kMmPerM * x_m},
                         .orientation = {0, 0, 0, 1},
                         .button1 = calls_.get_button(1, id_) > 0,
                         .button2 = false,
                         .parked = calls_.get_button(0, id_) > 0,
                         .homed = is_initialized_,
                         .powered = gives_force_};
    if (!gives_force_ && reading->parked) static_cast<void>(calls_.enable_force(1, id_));
  } else {
    count_error();
    const auto code = static_cast<std::uint32_t>(calls_.error_get_last());
    constexpr auto kGoneNs = static_cast<std::int64_t>(kGoneS * kNsPerSecond);
    const std::int64_t now_ns = exchange_.now_ns();
    if (read_ns_ == 0) read_ns_ = now_ns;
    if (++unread_ >= kFewestUnread && now_ns - read_ns_ >= kGoneNs) {
      exchange_.fail(std::max(code, 1U));
    }
  }
  const auto force_n = exchange_.turn(reading);
  // In the SDK's axes.
  const int result = calls_.set_force(force_n[2], force_n[0], force_n[1], id_);
  if (result < 0) {
    count_error();
  } else if (result == kSaturated) {
    ++saturated_;
  }
}

/// A device can leave the force mode by its force button, velocity threshold or watchdog. If it
/// came back during contact, it would exert the full force at once. So outside the force mode the
/// reading is `powered = false`, and the mode is enabled again only while the parking button is
/// held.
void DhdArm::look_at_states() noexcept {
  constexpr std::size_t kForceMode = 5;
  if (looked_ns_ && read_ns_ - *looked_ns_ < kLookNs) return;
  looked_ns_ = read_ns_;
  is_initialized_ = calls_.is_initialized(id_);
  notice_.store(is_initialized_ ? ""
                                : "not initialised: run the vendor's HapticInit, or "
                                  "kerf-arm --auto-init, which moves the arm");
  if (calls_.get_status == nullptr) return;
  std::array<int, 32> status{};  // 17 words as of SDK 3.17
  if (calls_.get_status(status.data(), id_) >= 0) gives_force_ = status[kForceMode] != 0;
}

void DhdArm::count_error() noexcept {
  const int code = calls_.error_get_last();
  const bool is_known = code >= 0 && static_cast<std::size_t>(code) < kKnownDhdErrors;
  ++error_counts_[is_known ? static_cast<std::size_t>(code) : kKnownDhdErrors];
}

std::string DhdArm::last_error() const {
  const char* const text = calls_.error_get_last_str();
  return "error " + std::to_string(calls_.error_get_last()) +
         (text != nullptr ? ": " + std::string(text) : "");
}

std::vector<std::string> DhdArm::warnings() const {
  std::vector<std::string> all;
  if (!is_omega(type_)) {
    all.push_back("device of " + described(type_) +
                  ": no omega; its force is held below --peak alone, its axes and its parking "
                  "button are taken for an omega.3's; check each without force first "
                  "(docs/devices.md)");
  } else if (type_ != kOmega3) {
    all.push_back("device of " + described(type_) +
                  ": its wrist and gripper are not read and get no force; it is taken for an "
                  "omega.3");
  }
  if (!has_watchdog_) {
    all.emplace_back(
        "the device takes no watchdog: if kerf-arm is killed or the machine stops, its force may "
        "stay; keep a hand at its switch");
  }
  return all;
}

std::string DhdArm::text_of(std::uint32_t failure) const {
  switch (failure) {
    case ArmExchange::kStalled:
      return "a call of the library has not returned; check the cable, and start kerf-arm again";
    case ArmExchange::kUnreadable:
    case ArmExchange::kSilent:
      return "no reading of the arm is a position; is this library the device's own?";
    default:
      return "the device cannot be read any more (error " + std::to_string(failure) +
             (failure < kKnownDhdErrors ? std::string(": ") + kDhdErrors[failure] : "") +
             "); check cable and power, and start kerf-arm again";
  }
}

std::vector<std::pair<std::string, std::uint64_t>> DhdArm::errors() const {
  std::vector<std::pair<std::string, std::uint64_t>> seen;
  for (std::size_t i = 0; i <= kKnownDhdErrors; ++i) {
    if (error_counts_[i] == 0) continue;
    seen.emplace_back(i < kKnownDhdErrors ? kDhdErrors[i] : "another", error_counts_[i]);
  }
  if (saturated_ > 0) seen.emplace_back("saturated motor", saturated_);
  return seen;
}

}  // namespace kerf
