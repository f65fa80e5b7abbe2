// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

#include "shared/numeric/vec.hpp"

/// Numbers of the dhd/drd interface that programs are compiled with, its axes and units.
namespace kerf::dhd {

enum Error : int {
  kNoError,
  kError,
  kCommunication,
  kBusy,
  kNoDriver,
  kNoDevice,
  kNotAvailable,
  kTimeout,
  kGeometry,
  kExpertOnly,
  kNotImplemented,
  kOutOfMemory,
  kNotReady,
  kNoFile,
  kConfiguration,
  kBadIndex,
  kDeprecated,
  kNullArgument,
  kRedundancy,
  kNotEnabled,
  kInUse,
  kInvalid,
  kNoRegulation,
  kErrors
};

inline constexpr int kOk = 0;
inline constexpr int kReused = 1;     ///< a reading within the time guard
inline constexpr int kSaturated = 2;  ///< a force above what the motors give
inline constexpr int kFailed = -1;

inline constexpr int kOmega3 = 33;
inline constexpr int kFirstSerialNumber = 1;
inline constexpr std::size_t kStatusWords = 17;
inline constexpr std::size_t kMostDof = 8;
inline constexpr std::array<int, 4> kSdkVersion{3, 17, 5, 0};  ///< whose names the library has

/// dhd counts in metres, x to the user, y right, z up; kerf in mm, x right, y up, z to the user.
inline constexpr double kMmPerM = 1000;
[[nodiscard]] constexpr DeviceVec<double> from_dhd(double x, double y, double z) noexcept {
  return {y, z, x};
}
[[nodiscard]] constexpr std::array<double, 3> to_dhd(DeviceVec<double> v) noexcept {
  return {v.z, v.x, v.y};
}

}  // namespace kerf::dhd
