// SPDX-License-Identifier: Apache-2.0
#include "controller/shell/publisher.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "shared/numeric/fixed.hpp"
#include "shared/segment/hash.hpp"

namespace kerf {
namespace {

std::array<float, 3> floats(const std::array<double, 3>& v) noexcept {
  return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

void put(float (&out)[3], const std::array<double, 3>& v) noexcept {
  std::ranges::copy(floats(v), out);
}

/// Unit quaternion x, y, z, w of a rotation matrix, from its largest component (Shepperd).
std::array<float, 4> quaternion_of(const std::array<double, 9>& m) noexcept {
  const std::array<double, 4> squares{1 + m[0] - m[4] - m[8], 1 - m[0] + m[4] - m[8],
                                      1 - m[0] - m[4] + m[8], 1 + m[0] + m[4] + m[8]};
  std::array<double, 4> q{};
  switch (std::ranges::max_element(squares) - squares.begin()) {
    case 0:
      q = {squares[0], m[1] + m[3], m[2] + m[6], m[7] - m[5]};
      break;
    case 1:
      q = {m[1] + m[3], squares[1], m[5] + m[7], m[2] - m[6]};
      break;
    case 2:
      q = {m[2] + m[6], m[5] + m[7], squares[2], m[3] - m[1]};
      break;
    default:
      q = {m[7] - m[5], m[2] - m[6], m[3] - m[1], squares[3]};
      break;
  }
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  std::array<float, 4> unit{};
  for (std::size_t i = 0; i < 4; ++i) unit[i] = static_cast<float>(q[i] / length);
  return unit;
}

std::uint32_t flags_of(const DeviceReport& report, const ServoOutput& output) noexcept {
  std::uint32_t flags = 0;
  const auto set = [&](bool on, std::uint32_t bit) {
    if (on) flags |= bit;
  };
  set(report.button1, kFlagButton1);
  set(report.button2, kFlagButton2);
  set(report.docked, kFlagDocked);
  set(output.contact, kFlagContact);
  set(output.saturated, kFlagClamped);
  set(output.stale, kFlagStaleInput);
  set(output.fault != Fault::none, kFlagDeviceFault);
  set(output.motors_on, kFlagMotorsOn);
  set(output.armed, kFlagArmed);
  return flags;
}

void put_raw(const DeviceReport& report, TickRecord& record) noexcept {
  for (std::size_t i = 0; i < 3; ++i) {
    record.raw[kRawEncoder + i] = report.encoder[i];
    record.raw[kRawPot + i] = report.wiper_a[i];
    record.raw[kRawPot + 3 + i] = report.wiper_b[i];
  }
  record.raw[kRawStatus] =
      (report.button1 ? 1 : 0) | (report.button2 ? 2 : 0) | (report.docked ? 4 : 0);
  record.raw[kRawDeviceCounter] = static_cast<std::int32_t>(report.counter);
}

}  // namespace

void Publisher::publish_volumes(const ServoOutput& output, TickRecord& record) noexcept {
  VoxelBox first_box;
  for (std::size_t v = 0; v < output.changed.size(); ++v) {
    const VoxelBox& box = output.changed[v];
    if (box.empty()) continue;
    const std::span<const Density> density = servo_.density(v);
    segment_.publish_box(v, density, box, static_cast<std::uint32_t>(output.removed_by_volume[v]));
    volume_hash_ = hash_word(volume_hash_, box_hash(density, servo_.grid(v), box));
    record.dirty_volumes |= 1U << v;
    if (first_box.empty()) first_box = box;
  }
  const auto narrow = [](std::int32_t value) { return static_cast<std::uint16_t>(value); };
  const std::array lo{narrow(first_box.lo.x), narrow(first_box.lo.y), narrow(first_box.lo.z)};
  const std::array hi{narrow(first_box.hi.x), narrow(first_box.hi.y), narrow(first_box.hi.z)};
  std::ranges::copy(lo, record.dirty_lo);
  std::ranges::copy(hi, record.dirty_hi);
}

void Publisher::publish(Tick tick, const DeviceReport& report, const ServoOutput& output,
                        std::uint32_t last_command, const TickTiming& timing) noexcept {
  TickRecord record{};
  segment_.begin_tick(tick);
  publish_volumes(output, record);

  record.tick = tick;
  record.start_ns = static_cast<std::uint64_t>(timing.start_ns);
  record.period_error_ns = saturate_i32(timing.late_ns);
  record.execution_ns = static_cast<std::uint32_t>(timing.compute_ns);
  record.flags = flags_of(report, output);
  record.missed_deadlines = static_cast<std::uint32_t>(timing.missed_deadlines);
  std::ranges::copy(output.joint_counts, record.encoder_counts);
  std::ranges::copy(output.position_mm, record.position_mm);
  std::ranges::copy(quaternion_of(output.rotation), record.orientation);
  put(record.velocity_mm_per_s, output.velocity_mm_per_s);
  put(record.commanded_force_n, output.force_n);
  put(record.contact_force_n, output.contact_n);
  put(record.modification_force_n, output.modification_n);
  put(record.torque_n_mm, output.torque_n_mm);
  std::ranges::copy(output.motor_counts, record.dac_counts);
  record.removed = static_cast<std::uint32_t>(output.removed_steps);
  record.port_energy_j = output.absorbed_mj / 1000.0;
  record.energies[0] = std::llround(output.absorbed_mj / 1000.0 * 4294967296.0);
  record.volume_hash = volume_hash_;
  record.output_hash = output.output_hash;
  record.sub_steps = 1;
  record.last_command = last_command;
  put_raw(report, record);
  record.active_tool = output.active_tool;
  record.fault = static_cast<std::uint32_t>(output.fault);
  record.stale = output.stale ? 1 : 0;
  record.penetration_mm = static_cast<float>(servo_.penetration_mm());
  segment_.publish_state(record);
  segment_.end_tick(static_cast<std::uint64_t>(timing.start_ns));
}

}  // namespace kerf
