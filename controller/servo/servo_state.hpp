// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "controller/kernel/gradient.hpp"
#include "controller/kernel/kernel_set.hpp"
#include "controller/kernel/milling.hpp"
#include "controller/kernel/preston.hpp"
#include "controller/kernel/proxy/contact_query.hpp"
#include "controller/kernel/proxy/proxy.hpp"
#include "controller/kernel/spindle.hpp"
#include "controller/law/law.hpp"
#include "controller/servo/energy_ledger.hpp"
#include "controller/servo/external_force.hpp"
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
  std::span<Gradient<N>> gradient;      ///< empty if no tool gathers
  std::span<RemovalCarry<N>> carry;     ///< fractions of density steps still owed
  std::span<const Density> first;       ///< content before the first cut; empty if nothing is cut
  std::span<std::uint64_t> cut_blocks;  ///< bricks that differ from it (volume_restore.hpp)
};

/// The state of the swept contact; the memory of `volumes` belongs to the compiled scene.
template <class N>
struct ContactState {
  using Volumes = std::array<ContactVolume<N>, kMaxVolumes>;  ///< by index of the plan's volumes
  Volumes volumes{};
  std::array<Volumes, kMaxShaftParts> shaft_volumes{};  ///< with the samples of shaft and handpiece
  ProxyState<N> proxy;
};

/// The state of cutting by force; the lists belong to the compiled scene.
template <class N>
struct ForceCutState {
  typename N::Real advance{kCutAdvance};
  SpindleState<N> spindle;
  Vec<typename N::Real, ToolSpace> friction_n;  ///< for the next tick, force in the scene
  std::array<PrestonState<N>, kMaxVolumes> volume{};
  std::array<BurWear<N>, kMaxTools> wear{};                    ///< of each tool, in the hand or not
  std::array<std::span<CoveredEntry<N>>, kMaxVolumes> list{};  ///< scratch of one tick

  /// Resets the state for a new tool, which stands still. Keeps the budgets of the materials, and
  /// the wear of all tools.
  constexpr void change_tool() noexcept {
    advance = typename N::Real(kCutAdvance);
    spindle = {};
    friction_n = {};
  }
};

/// Progress of a reset of the volumes (volume_restore.hpp).
struct ResetState {
  bool runs = false;
  std::size_t volume = 0, block = 0;  ///< the next one to check
};

/// A brick as it was before a stroke.
struct KeptBrick {
  std::uint32_t volume = 0;  ///< of the plan
  std::uint32_t id = 0;
  std::array<Density, kBrickVoxels> density{};  ///< of its voxels that exist, x fastest
};

inline constexpr std::size_t kUndoLevels = 20;

/// The bricks of a stroke in the pool.
struct Stroke {
  std::uint64_t begin = 0, end = 0;
};

/// The last strokes, and bricks that may belong to the next (volume_restore.hpp). `pool` is a ring;
/// indices in it only grow. An undo and a redo swap the bricks of a stroke with the volume's, so
/// the entries of a done stroke hold the content before it, those of an undone stroke the content
/// after it.
struct StrokeState {
  enum class Motion : std::uint8_t { none, undo, redo };

  std::span<KeptBrick> pool;  ///< empty if nothing is cut
  std::array<std::span<std::uint32_t>, kMaxVolumes>
      kept_in;  ///< by brick: the generation that kept it
  std::uint32_t generation = 1;
  std::array<Stroke, kUndoLevels> strokes{};  ///< oldest first: `done`, then those undone, to `all`
  std::size_t done = 0, all = 0;
  std::uint64_t from = 0, end = 0;  ///< of the open stroke; else, saved for the next one
  bool open = false;                ///< a stroke has begun and not ended
  bool lost = false;                ///< it is longer than its room, or would be if it began now
  std::uint32_t quiet_ticks = 0;    ///< since the last contact, or since the pedal went up
  Motion motion = Motion::none;     ///< undo or redo that runs now
  Stroke moving{};                  ///< the rest of its stroke

  [[nodiscard]] constexpr bool can_undo() const noexcept {
    return motion == Motion::none && (open ? !lost : done > 0);
  }
  [[nodiscard]] constexpr bool can_redo() const noexcept {
    return motion == Motion::none && done < all;
  }
};

/// State of reset, undo and redo of the volumes; one for all arms of a scene.
struct VolumeHistory {
  ResetState reset;
  StrokeState stroke;

  /// Whether one of them runs. Meanwhile nothing is cut, and no hand gets a force.
  [[nodiscard]] constexpr bool restores() const noexcept {
    return reset.runs || stroke.motion != StrokeState::Motion::none;
  }
};

/// Joint counters since the last calibration.
struct EncoderState {
  std::array<std::int16_t, 3> last{};
  std::array<std::int32_t, 3> unwrapped{};            ///< counts from home, beyond 16 bits
  std::array<std::int16_t, 3> rest_from{};            ///< reading with which the rest began
  std::optional<std::array<std::int16_t, 3>> dock{};  ///< reading of the first calibration
  std::uint32_t rest_ticks = 0;                       ///< parked without a motion of a joint
  std::uint32_t silent_ticks = 0;                     ///< since the last report
};

/// Sliding sum over the gimbal readings of the last 20 ms, because the pots' low bits are noise.
/// For a Cartesian device, the newest orientation.
struct GimbalFilter {
  std::array<std::array<std::uint16_t, 6>, kMaxGimbalSamples> ring{};
  std::array<std::uint32_t, 6> sum{};
  std::size_t next = 0;
  std::array<std::int16_t, 4> orientation{0, 0, 0, 32767};  ///< quaternion x, y, z, w
};

/// Everything of an arm that changes from tick to tick. A run is a function of plan, first state,
/// reports and commands; there is no other state.
template <class N>
struct ServoState {
  using Real = typename N::Real;

  std::array<VolumeState<N>, kMaxVolumes> volumes{};
  OverlapBox<N> overlap;  ///< scratch of one tick, as is the next
  GradientScratch* gradient_scratch = nullptr;
  SplatScratch scratch;  ///< the method `aligned` uses its inner part

  ContactState<N> contact;     ///< of the swept proxy
  ForceCutState<N> force_cut;  ///< of cutting by force
  ExternalState<N> external;   ///< of the force of a program

  Supervisor supervisor;
  EncoderState encoders;
  GimbalFilter gimbal;
  std::uint32_t active_tool = 0;
  bool pedal_down = true;            ///< in the last report; always true without a pedal
  bool hold = false;                 ///< by command: force 0, nothing is cut
  VolumeHistory* history = nullptr;  ///< of the compiled scene; null only if nothing is stepped
  [[nodiscard]] constexpr bool held() const noexcept {
    return hold || (history != nullptr && history->restores());
  }

  JacobianTransposed<N> jacobian_t_mm;  ///< of the last good report
  DeviceVec<Real> tip_mm;               ///< device port
  Rotation<N> rotation = identity_rotation<N>();
  bool tip_known = false;             ///< false before the first report
  std::uint32_t tip_ticks = 0;        ///< since the last tip
  DeviceVec<Real> force_sum_n;        ///< sum of the forces sent in these ticks
  DeviceVec<Real> moved_mm;           ///< from the last tip to this one
  std::uint32_t moved_ticks = 1;      ///< ticks that this took
  DeviceVec<Real> velocity_mm_per_s;  ///< at this tip
  LawMemory velocity;
  LawMemory force_law;
  LawMemory stabiliser;

  DeviceVec<Real> contact_n;       ///< of the last tick, before limits
  WorldVec<Real> proxy_offset_mm;  ///< in the last tick
  DeviceVec<Real> force_n;         ///< sent in the last tick
  DeviceVec<Real> held_force_n;    ///< sent with the last good report: faded when reports stop
  ThermalState<N> thermal;
  EnergyLedger<N> ledger;
  std::uint64_t output_hash = kFnv1aBasis;
};

/// An arm of the scene: a device with a tool. Two arms use the same volumes, one after the other in
/// each tick; everything else is separate.
template <class N>
struct Arm {
  const ServoPlan<N>* plan = nullptr;
  ServoState<N>* state = nullptr;
};

/// All arms of a scene, at least one.
template <class N>
using Arms = std::span<const Arm<N>>;

}  // namespace kerf
