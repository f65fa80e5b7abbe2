// SPDX-License-Identifier: Apache-2.0
#include "arm/hd_arm.hpp"

#include <algorithm>
#include <clocale>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "arm/arm_error.hpp"
#include "arm/overseer.hpp"

namespace kerf {
namespace {

// Constants of the interface, from its documentation.
constexpr std::uint32_t kNoDevice = 0xffffffff;
constexpr std::uint32_t kHighestHandle = 1024;  // a failed start has returned a larger one
constexpr std::uint32_t kButtons = 0x2000, kInkwellSwitch = 0x2002;
constexpr std::uint32_t kTransform = 0x2052, kForce = 0x2700;
constexpr std::uint32_t kVersion = 0x2500, kModel = 0x2501, kDriver = 0x2502, kVendor = 0x2503,
                        kSerial = 0x2504;
constexpr std::uint32_t kCalibrationStyle = 0x2555;
constexpr std::uint32_t kForceOutput = 0x4000;
constexpr std::uint32_t kCalibrationOk = 0x5000, kNeedsUpdate = 0x5001;
constexpr std::uint32_t kStyleAuto = 2, kStyleInkwell = 4;
constexpr std::uint32_t kDone = 0, kContinue = 1;
constexpr std::uint16_t kHighestPriority = 0xffff;

enum class Effect : std::uint8_t { none, spoils, fails };
struct ErrorName {
  std::uint32_t code;
  const char* name;
  Effect effect;
};
// `none`: warm motors and the library's own limits of force, impulse and speed lower the force for
// a while; the readings stay valid.
constexpr ErrorName kHdErrors[] = {
    {0x100, "invalid enum", Effect::spoils},
    {0x101, "invalid value", Effect::spoils},
    {0x102, "invalid operation", Effect::spoils},
    {0x103, "invalid input type", Effect::spoils},
    {0x104, "bad handle", Effect::spoils},
    {0x200, "warm motors", Effect::none},
    {0x201, "exceeded maximum force", Effect::none},
    {0x202, "exceeded force impulse", Effect::none},
    {0x203, "exceeded velocity", Effect::none},
    {0x204, "force error", Effect::fails},
    {0x300, "device fault", Effect::fails},
    {0x301, "device already initiated", Effect::spoils},
    {0x302, "communication error", Effect::fails},
    {0x303, "communication set-up error", Effect::spoils},
    {0x304, "timer error", Effect::spoils},
    {0x400, "illegal begin of a frame", Effect::spoils},
    {0x401, "illegal end of a frame", Effect::spoils},
    {0x402, "frame error", Effect::spoils},
    {0x500, "invalid priority", Effect::spoils},
    {0x501, "scheduler full", Effect::spoils},
    {0x600, "invalid licence", Effect::spoils},
};
constexpr std::size_t kKnownHdErrors = std::size(kHdErrors);

/// A text of the library; empty if it is null.
std::string text_or_none(const char* text) {
  return text != nullptr ? text : "";
}

std::uint32_t on_tick(void* arm) {
  Overseer::give_crash_stack();
  return static_cast<HdArm*>(arm)->frame();
}

/// The vendor's driver fails with a decimal comma, so this sets the point, in the environment too.
void set_decimal_point() {
  // NOLINTBEGIN(concurrency-mt-unsafe): start
  if (std::getenv("LC_ALL") != nullptr) setenv("LC_ALL", "C", 1);
  setenv("LC_NUMERIC", "C", 1);
  std::setlocale(LC_NUMERIC, "C");
  // NOLINTEND(concurrency-mt-unsafe)
}

VendorLibrary load(const std::string& path) {
  set_decimal_point();
  return {path, {"libHD.so"}, "OpenHaptics of 3D Systems"};
}

}  // namespace

HdArm::HdArm(const Options& options, ArmExchange& exchange)
    : options_(options), exchange_(exchange), library_(load(options.library)) {
  library_.find("hdInitDevice", calls_.init_device);
  library_.find("hdDisableDevice", calls_.disable_device);
  library_.find("hdBeginFrame", calls_.begin_frame);
  library_.find("hdEndFrame", calls_.end_frame);
  library_.find("hdEnable", calls_.enable);
  library_.find("hdGetBooleanv", calls_.get_booleanv);
  library_.find("hdGetIntegerv", calls_.get_integerv);
  library_.find("hdGetDoublev", calls_.get_doublev);
  library_.find("hdSetDoublev", calls_.set_doublev);
  library_.find("hdGetString", calls_.get_string);
  library_.find("hdGetError", calls_.get_error);
  library_.find("hdGetErrorString", calls_.get_error_string);
  library_.find("hdCheckCalibration", calls_.check_calibration);
  library_.find("hdUpdateCalibration", calls_.update_calibration);
  library_.find("hdStartScheduler", calls_.start_scheduler);
  library_.find("hdStopScheduler", calls_.stop_scheduler);
  library_.find("hdSetSchedulerRate", calls_.set_scheduler_rate);
  library_.find("hdScheduleAsynchronous", calls_.schedule_asynchronous);
  library_.find("hdUnschedule", calls_.unschedule);
  library_.require_all();
}

void HdArm::open() {
  static_assert(kKnownHdErrors < std::tuple_size_v<decltype(error_counts_)>);
  const std::string name = options_.has_name ? "'" + options_.device_name + "'" : "without a name";
  device_ = calls_.init_device(options_.has_name ? options_.device_name.c_str() : nullptr);
  const std::uint32_t error = calls_.get_error().code;
  if (error != 0 || device_ == kNoDevice || device_ > kHighestHandle) {
    throw ArmError("device " + name + ": cannot be opened (" +
                   (error != 0 ? described(error) : "an invalid handle") +
                   "); check cable and power, end other programs that use it, unplug it and plug "
                   "it in again, or try another --vendor-name or --no-vendor-name");
  }
  is_open_ = true;
  facts_ = {{"library", library_.file()}, {"version", fact(kVersion)}, {"model", fact(kModel)},
            {"driver", fact(kDriver)},    {"vendor", fact(kVendor)},   {"serial", fact(kSerial)}};
  int style = 0;
  calls_.get_integerv(kCalibrationStyle, &style);
  calibration_style_ = static_cast<std::uint32_t>(style);
  pop_errors();  // a missing fact does no harm
  calls_.enable(kForceOutput);
  require_no_error("hdEnable of the force");
  if (options_.rate_hz > 0) {
    calls_.set_scheduler_rate(static_cast<unsigned long>(options_.rate_hz));
    if (const std::uint32_t refused = pop_errors(); refused != 0) {
      throw ArmError("--rate " + std::to_string(options_.rate_hz) + ": not taken by the library (" +
                     described(refused) + "); take 500 or 1000, or leave it out");
    }
  }
}

void HdArm::start() {
  is_started_ = true;
  calls_.start_scheduler();
  require_no_error("hdStartScheduler");
  scheduled_ = calls_.schedule_asynchronous(on_tick, this, kHighestPriority);
  is_scheduled_ = true;
  require_no_error("hdScheduleAsynchronous");
  owns_errors_.store(true, std::memory_order_release);
}

void HdArm::stop() {
  if (!is_started_) return;
  is_started_ = false;
  calls_.stop_scheduler();
  // A callback that has ended is no longer scheduled.
  if (is_scheduled_ && !has_ended_.load()) calls_.unschedule(scheduled_);
}

void HdArm::close() {
  if (!is_open_) return;
  is_open_ = false;
  calls_.disable_device(device_);
}

std::uint32_t HdArm::frame() noexcept {
  if (exchange_.finished()) {
    has_ended_.store(true);
    return kDone;
  }
  if (!owns_errors_.load(std::memory_order_acquire)) return kContinue;
  calls_.begin_frame(device_);
  std::optional<ArmReading> reading(std::in_place);
  const bool is_read = read(*reading);
  if (!is_read || clean_ < kCleanFrames) reading.reset();
  const std::array<double, 3> force_n = exchange_.turn(reading);
  calls_.set_doublev(kForce, force_n.data());
  calls_.end_frame(device_);
  const std::uint32_t error = pop_errors();
  if (error == 0 && is_read) {
    clean_ = std::min(clean_ + 1, kCleanFrames);
    unclean_ = 0;
    unclean_code_ = 0;
    return kContinue;
  }
  clean_ = 0;
  if (error != 0) unclean_code_ = error;
  if (++unclean_ >= kMostUnclean) {
    exchange_.fail(unclean_code_ != 0 ? unclean_code_ : std::uint32_t{ArmExchange::kUnreadable});
  }
  return kContinue;
}

bool HdArm::read(ArmReading& reading) noexcept {
  std::array<double, 16> m{};  // column-major
  int buttons = 0;
  std::uint8_t is_out = 1;  // out of the inkwell
  calls_.get_doublev(kTransform, m.data());
  calls_.get_integerv(kButtons, &buttons);
  calls_.get_booleanv(kInkwellSwitch, &is_out);
  if (const std::uint32_t error = pop_errors(); error != 0) {
    unclean_code_ = error;
    return false;
  }
  reading.position_mm = {m[12], m[13], m[14]};
  // The tool's axes from those of HD's stylus: x is x, y (the shaft) is z, z is -y: Rx(90 degrees).
  const auto orientation =
      orientation_of({m[0], m[1], m[2]}, {m[8], m[9], m[10]}, {-m[4], -m[5], -m[6]});
  if (!orientation) return false;
  reading.orientation = *orientation;
  reading.button1 = (buttons & 1) != 0;
  reading.button2 = (buttons & 2) != 0;
  reading.parked = is_out == 0;
  // In the first frames the inkwell switch may not have been read yet.
  reading.homed = clean_ >= kCleanFrames && follow_calibration(reading.parked);
  return true;
}

bool HdArm::follow_calibration(bool is_docked) noexcept {
  const std::uint32_t state = calls_.check_calibration();
  if (state == kCalibrationOk) {
    notice_.store("");
    return true;
  }
  const bool by_inkwell = (calibration_style_ & kStyleInkwell) != 0;
  const bool by_itself = (calibration_style_ & kStyleAuto) != 0;
  if (by_inkwell && !is_docked) {
    notice_.store("not calibrated: put the stylus into the inkwell");
  } else if (by_inkwell || by_itself) {
    notice_.store("calibrating");
    const std::int64_t now_ns = exchange_.now_ns();
    if (state == kNeedsUpdate && !(updated_ns_ && now_ns - *updated_ns_ < kUpdateNs)) {
      updated_ns_ = now_ns;
      calls_.update_calibration(by_inkwell ? kStyleInkwell : kStyleAuto);
    }
  } else {
    notice_.store("not calibrated: calibrate it with the vendor's own program");
  }
  return false;
}

std::uint32_t HdArm::pop_errors() noexcept {
  constexpr int kMost = 16;
  std::uint32_t spoiling = 0;
  for (int i = 0; i < kMost; ++i) {
    const std::uint32_t code = calls_.get_error().code;
    if (code == 0) break;
    const auto* known = std::ranges::find(kHdErrors, code, &ErrorName::code);
    ++error_counts_[static_cast<std::size_t>(known - std::begin(kHdErrors))];
    const Effect effect = known == std::end(kHdErrors) ? Effect::spoils : known->effect;
    if (effect == Effect::none) continue;
    if (spoiling == 0) spoiling = code;
    if (effect == Effect::fails) exchange_.fail(code);
  }
  return spoiling;
}

void HdArm::require_no_error(const char* call) {
  const std::uint32_t error = pop_errors();
  if (error == 0) return;
  throw ArmError(std::string(call) + ": " + described(error) +
                 "; end other programs that use the device, unplug it and plug it in again");
}

std::string HdArm::fact(std::uint32_t what) const {
  return text_or_none(calls_.get_string(what));
}

std::string HdArm::described(std::uint32_t code) const {
  char hex[16];
  std::snprintf(hex, sizeof hex, "error %x", code);
  const std::string text = text_or_none(calls_.get_error_string(code));
  return text.empty() ? hex : hex + (": " + text);
}

std::string HdArm::text_of(std::uint32_t failure) const {
  switch (failure) {
    case ArmExchange::kStalled:
      return "the library's callback has stopped; unplug the device, plug it in again, and start "
             "kerf-arm again";
    case ArmExchange::kUnreadable:
      return "no reading of the arm in " + std::to_string(kMostUnclean) +
             " frames is a pose; is this library the device's own?";
    case ArmExchange::kSilent:
      return "the library's scheduler has started no frame; end other programs that use the device";
    default:
      break;
  }
  // The texts are kerf's: a library that has failed is not called.
  const auto* known = std::ranges::find(kHdErrors, failure, &ErrorName::code);
  char code[16];
  std::snprintf(code, sizeof code, "error %x", failure);
  return std::string("the library reports ") + code +
         (known != std::end(kHdErrors) ? std::string(": ") + known->name : "") +
         "; check cable and power, and start kerf-arm again";
}

std::vector<std::pair<std::string, std::uint64_t>> HdArm::errors() const {
  std::vector<std::pair<std::string, std::uint64_t>> seen;
  for (std::size_t i = 0; i <= kKnownHdErrors; ++i) {
    if (error_counts_[i] == 0) continue;
    seen.emplace_back(i < kKnownHdErrors ? kHdErrors[i].name : "another", error_counts_[i]);
  }
  return seen;
}

}  // namespace kerf
