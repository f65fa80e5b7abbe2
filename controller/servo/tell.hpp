// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "controller/servo/plain_numbers.hpp"
#include "controller/servo/sense.hpp"
#include "controller/servo/servo_output.hpp"
#include "controller/servo/servo_plan.hpp"
#include "controller/servo/servo_state.hpp"
#include "controller/servo/tool_contact.hpp"
#include "shared/numeric/fnv1a.hpp"

namespace kerf {

// What a tick tells the eyes and the log.

template <class N>
constexpr double energy_mj(typename N::Energy energy) noexcept {
  if constexpr (N::kIsFixed) {
    return energy_mj_of_steps(energy);
  } else {
    return static_cast<double>(energy);
  }
}

/// For the record: in steps of 2^-32 mJ, rounded and saturated.
template <class N>
constexpr std::int64_t energy_steps(typename N::Energy energy) noexcept {
  if constexpr (N::kIsFixed) {
    return energy;
  } else {
    const double steps = static_cast<double>(energy) * kEnergyStepsPerMj;
    constexpr double kEnd = 9223372036854774784.0;  // largest double below 2^63
    return static_cast<std::int64_t>(std::clamp(steps + (steps < 0 ? -0.5 : 0.5), -kEnd, kEnd));
  }
}

template <class N>
std::uint64_t hash_of(std::uint64_t hash, const ServoOutput& out,
                      DeviceVec<typename N::Real> force_n) noexcept {
  const auto word = [](auto value) {
    if constexpr (N::kIsFixed) {
      return static_cast<std::uint64_t>(static_cast<std::uint32_t>(value.raw()));
    } else {
      return std::bit_cast<std::uint64_t>(static_cast<double>(value));
    }
  };
  for (const std::int16_t m : out.motor_counts) {
    hash = fnv1a_step(hash, static_cast<std::uint16_t>(m));
  }
  hash = fnv1a_step(hash, word(force_n.x));
  hash = fnv1a_step(hash, word(force_n.y));
  hash = fnv1a_step(hash, word(force_n.z));
  hash = fnv1a_step(hash, out.removed_steps);
  return fnv1a_step(hash, static_cast<std::uint64_t>(out.phase) << 1 | (out.motors_on ? 1U : 0U));
}

inline void tell_removed(const std::array<Removed, kMaxVolumes>& removed,
                         ServoOutput& out) noexcept {
  for (std::size_t v = 0; v < kMaxVolumes; ++v) {
    out.removed_by_volume[v] = removed[v].density_steps;
    out.removed_steps += removed[v].density_steps;
    out.changed[v] = removed[v].changed;
  }
}

template <class N>
void tell_planes(const ToolContact<N>& tool, ServoOutput& out) noexcept {
  static_assert(kMaxPlaneLoads == kMaxPlanes);
  for (std::size_t i = 0; i < tool.plane_count; ++i) {
    const PressedPlane<N>& plane = tool.planes[i];
    out.planes[i] = {as_doubles(plane.normal), as_doubles(plane.arm_mm), as_double(plane.load_n)};
  }
  out.plane_count = static_cast<std::uint32_t>(tool.plane_count);
}

/// The rest of the output, for the eyes and the log.
template <class N>
void tell(const ServoPlan<N>& plan, ServoState<N>& state, const Sensed<N>& sensed,
          ServoOutput& out) noexcept {
  using Real = typename N::Real;
  out.phase = state.supervisor.phase;
  out.fault = state.supervisor.fault;
  out.started = state.supervisor.started;
  out.held = state.hold;
  out.contact = norm(state.force_n) > Real(kContactThresholdN);
  const ProxyState<N>& proxy = state.contact.proxy;
  out.refused = plan.contact.swept && !proxy.placed && proxy.search.refused();
  for (std::size_t i = 0; i < 3; ++i) {
    out.joint_counts[i] = state.encoders.unwrapped[i];
    out.gimbal_rad[i] = as_double(sensed.pose.gimbal[i]);
  }
  out.position_mm = as_doubles(sensed.tip_mm);
  // Drawn as it is felt: a tool that does not turn keeps the world's axes, and a shaft that is held
  // lags behind the stylus.
  const ToolPlan<N>& tool = plan.tools[state.active_tool];
  Rotation<N> rotation = tool.turns ? state.rotation : identity_rotation<N>();
  if (tool.swept.behind.count > 0 && proxy.placed) rotation = {rows_of(proxy.pose.turn)};
  for (std::size_t i = 0; i < 9; ++i) out.rotation[i] = as_double(rotation.row[i / 3][i % 3]);
  out.velocity_mm_per_s = as_doubles(sensed.velocity_mm_per_s);
  out.force_n = as_doubles(state.force_n);
  out.absorbed_mj = energy_mj<N>(state.ledger.total_mj());
  out.port_minimum_mj = energy_mj<N>(state.ledger.lowest_mj());
  std::ranges::transform(state.ledger.by_source_mj(), out.energy_steps.begin(), energy_steps<N>);
  out.active_tool = state.active_tool;
  state.output_hash = hash_of<N>(state.output_hash, out, state.force_n);
  out.output_hash = state.output_hash;
}

}  // namespace kerf
