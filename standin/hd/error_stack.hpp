// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <mutex>

#include "standin/hd/numbers.hpp"

namespace kerf::hd {

/// The stack of errors of the whole process: every thread pushes to it, and each read removes the
/// newest. Any thread. Full: the oldest is forgotten; the vendor's depth is not known.
class ErrorStack {
 public:
  static constexpr std::size_t kMost = 1024;

  void push(Enum code, Handle device) noexcept {
    const std::lock_guard lock(mutex_);
    errors_[next_++ % kMost] = {code, 0, device};
    if (size_ < kMost) ++size_;
  }
  /// Success if there is none.
  [[nodiscard]] ErrorInfo pop() noexcept {
    const std::lock_guard lock(mutex_);
    if (size_ == 0) return {};
    --size_;
    return errors_[--next_ % kMost];
  }

 private:
  std::mutex mutex_;
  std::array<ErrorInfo, kMost> errors_{};
  std::size_t next_ = 0, size_ = 0;
};

/// One line for an error code, never null.
[[nodiscard]] constexpr const char* text_of(Enum code) noexcept {
  switch (code) {
    case kSuccess:
      return "no error";
    case kInvalidEnum:
      return "no such parameter";
    case kInvalidValue:
      return "value out of range";
    case kInvalidOperation:
      return "not possible with this device or now";
    case kInvalidType:
      return "the parameter has another type";
    case kBadHandle:
      return "no such device";
    case kWarmMotors:
      return "the motors are warm";
    case kExceededForce:
      return "the force exceeds the device's maximum";
    case kExceededImpulse:
      return "the step of the force exceeds the limit";
    case kExceededVelocity:
      return "the speed exceeds the limit";
    case kForceError:
      return "two kinds of force in one frame";
    case kDeviceFault:
      return "the device does not answer";
    case kAlreadyOpen:
      return "the device is open already";
    case kCommunication:
      return "the connection to the device is lost";
    case kConfiguration:
      return "the connection to the device is configured wrongly";
    case kTimer:
      return "the servo's timer failed";
    case kIllegalBegin:
      return "a frame began where none may";
    case kIllegalEnd:
      return "a frame ended that had not begun";
    case kFrameError:
      return "only possible within a frame";
    case kInvalidPriority:
      return "no such priority";
    case kSchedulerFull:
      return "too many callbacks";
    case kInvalidLicense:
      return "no licence";
    default:
      return "unknown error";
  }
}

}  // namespace kerf::hd
