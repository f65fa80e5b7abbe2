// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "controller/kernel/gradient.hpp"
#include "controller/kernel/kernel_set.hpp"
#include "controller/kernel/milling.hpp"
#include "controller/law/law.hpp"
#include "controller/servo/energy_ledger.hpp"
#include "controller/servo/force_limits.hpp"
#include "controller/servo/kinematics.hpp"
#include "controller/servo/servo.hpp"
#include "controller/servo/servo_plan.hpp"
#include "controller/servo/supervisor.hpp"
#include "shared/numeric/fnv1a.hpp"
#include "shared/volume/brick_grid.hpp"

namespace kerf {

/// The part of a volume that changes; memory belongs to the compiled scene.
template <class N>
struct VolumeState {
  std::span<Density> density;
  std::span<Gradient<N>> gradient;   ///< empty where no tool gathers
  std::span<RemovalCarry<N>> carry;  ///< fractions of density steps still owed
  std::span<const Density> first;    ///< content before the first cut; empty where nothing is cut
  std::span<std::uint64_t> cut_blocks;  ///< what differs from it (volume_restore.hpp)
};

/// How far a reset of the volumes has come (volume_restore.hpp).
struct ResetState {
  bool runs = false;
  std::size_t volume = 0, block = 0;  ///< to be looked at next
};

/// A brick as it was before a stroke.
struct KeptBrick {
  std::uint32_t volume = 0;  ///< of the plan
  std::uint32_t id = 0;
  std::array<Density, kBrickVoxels> density{};  ///< of its voxels that exist, x fastest
};

/// The last stroke, and what may belong to the next (volume_restore.hpp). `pool` is a ring; places
/// in it only grow: begin .. next is the last stroke, next .. end waits for one.
struct StrokeState {
  std::span<KeptBrick> pool;                                  ///< empty where nothing is cut
  std::array<std::span<std::uint32_t>, kMaxVolumes> kept_in;  ///< by brick: in which generation
  std::uint32_t generation = 1;
  std::uint64_t begin = 0, next = 0, end = 0;
  bool open = false;       ///< it goes on, and reaches from begin to end
  bool lost = false;       ///< it is longer than the pool
  bool next_lost = false;  ///< likewise, if one begins in this tick
  bool undoing = false;
  std::uint32_t quiet_ticks = 0;  ///< since it touched anything
  [[nodiscard]] constexpr bool can_undo() const noexcept {
    return !lost && !undoing && (open ? end : next) != begin;
  }
};

/// Joint counters since the last calibration.
struct EncoderState {
  std::array<std::int16_t, 3> last{};
  std::array<std::int32_t, 3> unwrapped{};  ///< counts from home, beyond 16 bits
  std::array<std::int16_t, 3> rest_from{};  ///< reading with which the rest began
  std::uint32_t rest_ticks = 0;             ///< since it is parked and no joint turns
  std::uint32_t silent_ticks = 0;           ///< since the last report
};

/// Sliding sum over the gimbal readings of the last 20 ms: the pots' low bits are noise.
struct GimbalFilter {
  std::array<std::array<std::uint16_t, 6>, kMaxGimbalSamples> ring{};
  std::array<std::uint32_t, 6> sum{};
  std::size_t next = 0;
};

/// Everything that one tick hands to the next. A run is a function of plan, first state, reports
/// and commands; nothing else is remembered anywhere.
template <class N>
struct ServoState {
  using Real = typename N::Real;

  std::array<VolumeState<N>, kMaxVolumes> volumes{};
  OverlapBox<N> overlap;  ///< scratch of one tick, as is the next
  GradientScratch* gradient_scratch = nullptr;
  SplatScratch scratch;  ///< the method `aligned` uses its inner part

  ContactState<N> contact;     ///< of the swept proxy
  ForceCutState<N> force_cut;  ///< of cutting by force

  Supervisor supervisor;
  EncoderState encoders;
  GimbalFilter gimbal;
  std::uint32_t active_tool = 0;
  bool hold = false;  ///< asked by command: force 0, nothing is cut
  ResetState reset;   ///< asked by command; a hold while it runs
  StrokeState stroke;
  [[nodiscard]] constexpr bool undoes() const noexcept { return stroke.undoing; }
  [[nodiscard]] constexpr bool held() const noexcept { return hold || reset.runs || undoes(); }

  JacobianTransposed<N> jacobian_t_mm;  ///< of the last good report
  DeviceVec<Real> tip_mm;               ///< device port
  Rotation<N> rotation = identity_rotation<N>();
  bool tip_known = false;             ///< false before the first report
  std::uint32_t tip_ticks = 0;        ///< since the tip was taken over
  DeviceVec<Real> force_sum_n;        ///< sent in these ticks
  DeviceVec<Real> moved_mm;           ///< to this tip, from the last one
  std::uint32_t moved_ticks = 1;      ///< in so many ticks
  DeviceVec<Real> velocity_mm_per_s;  ///< there
  LawMemory velocity;
  LawMemory force_law;
  LawMemory stabiliser;

  DeviceVec<Real> contact_n;       ///< felt in the last tick, before limits
  WorldVec<Real> proxy_offset_mm;  ///< in the last tick
  DeviceVec<Real> force_n;         ///< sent in the last tick
  DeviceVec<Real> held_force_n;    ///< sent with the last good report: faded when reports stop
  ThermalState<N> thermal;
  EnergyLedger<N> ledger;
  std::uint64_t output_hash = kFnv1aBasis;
};

}  // namespace kerf
