// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

#include "hil/device/device_model.hpp"
#include "tests/hil/model_runs.hpp"

/// Bytes of an emulated device, read without kerf's own packets.
namespace kerf::test {

using Bytes = std::vector<std::uint8_t>;
using Three = std::array<double, 3>;

inline constexpr double kPi = std::numbers::pi;
inline constexpr int kMs = 8;  ///< bus cycles of 125 us

inline Bytes packet_of(DeviceModel& model) {
  const auto packet = model.next_packet();
  return {packet.begin(), packet.end()};
}
inline int u16(const Bytes& bytes, std::size_t where) {
  return bytes.at(where) | bytes.at(where + 1) << 8;
}
inline int i16(const Bytes& bytes, std::size_t where) {
  return static_cast<std::int16_t>(u16(bytes, where));
}
inline double distance(DeviceVec<double> a, DeviceVec<double> b) {
  return norm(a - b);
}

}  // namespace kerf::test
