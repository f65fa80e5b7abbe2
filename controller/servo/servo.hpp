// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "include/kerf/tick.hpp"
#include "shared/numeric/energy_source.hpp"
#include "shared/numeric/numbers.hpp"
#include "shared/numeric/vec.hpp"
#include "shared/volume/voxel_grid.hpp"
#include "shared/wire/personality.hpp"

// The output of the servo step, and a servo of any number type. Reports and commands are those of
// other programs too (include/kerf/tick.hpp).

namespace kerf {

inline constexpr double kContactThresholdN = 0.01;  ///< a tick with more force is a contact tick

/// A plane that the tool presses on, with its load; at the device port.
template <class N>
struct PlaneLoad {
  DeviceVec<typename N::Unit> normal{};    ///< out of the solid
  DeviceVec<typename N::Real> lever_mm{};  ///< from the tool's centre to the contact
  typename N::Real load_n{};               ///< along the normal, before any limit
  bool on_shaft = false;                   ///< on shaft or handpiece
};
inline constexpr std::size_t kMaxPlaneLoads = 3;

/// The output of one tick: motor counts for the device, the rest for pictures and the log.
///
/// Physical values are converted from the loop's numbers exactly; nothing here flows back.
struct ServoOutput {
  std::array<std::int16_t, 3> dac_counts{};  ///< signed counts of the device, 0 = no torque
  bool motors_on = false;
  Phase phase = Phase::off;
  Fault fault = Fault::none;
  bool started = false;                   ///< was armed and picked up at least once: ticks count
  bool stale = false;                     ///< no fresh report in this tick
  bool clamped = false;                   ///< force, slew, thermal or motor limit was active
  bool contact = false;                   ///< commanded force above 0.01 N
  bool forbidden = false;                 ///< the tool presses on a forbidden material
  std::uint64_t forbidden_materials = 0;  ///< which: bit m is material m of the scene
  bool refused = false;                   ///< no free position near the hand: no force
  bool shaft = false;                     ///< load of shaft and handpiece above 0.01 N
  bool held = false;                      ///< by a command: no force and no cut
  bool undoing = false;                   ///< the last stroke is undone: no force and no cut
  bool undoable = false;                  ///< it can be
  bool redoing = false;                   ///< a stroke is cut again: no force and no cut
  bool redoable = false;                  ///< it can be
  bool pedalled = false;                  ///< nothing is cut without button 1
  bool resetting = false;  ///< volumes go back to their first content: changes are no cuts

  std::array<std::int32_t, 3> encoder_counts{};  ///< unwrapped since calibration
  std::array<double, 3> gimbal_rad{};            ///< yaw, pitch, roll
  std::array<double, 3> position_mm{};           ///< tip in the scene
  std::array<double, 9> rotation{};              ///< world from tool as of the contact, row-major
  std::array<double, 3> velocity_mm_per_s{};     ///< device port, as estimated
  std::array<double, 3> commanded_force_n{};     ///< sent to the hand, device port
  std::array<double, 3> contact_force_n{};       ///< part of it before limits, device port
  std::array<double, 3> modification_n{};        ///< part from cutting: reaction, or friction
  std::array<double, 3> torque_n_mm{};           ///< motor torques
  std::array<double, 3> proxy_offset_mm{};       ///< from the tip to the proxy's, in the scene
  std::array<double, 3> tip_torque_n_mm{};       ///< of contact and cutting about the tip
  std::array<PlaneLoad<DoubleNumbers>, kMaxPlaneLoads> planes{};
  std::uint32_t plane_count = 0;  ///< of the planes that hold the tool
  double absorbed_mj = 0;         ///< SUM -F_sent . dx of the run; + = taken from the hand
  double port_minimum_mj = 0;     ///< lowest value of it so far
  /// `absorbed_mj` by source, in steps of 2^-32 mJ; exact in fixed point, as is their sum.
  std::array<std::int64_t, kEnergySources> energy_steps{};

  double press_n = 0;        ///< normal force that cuts, in the scene
  double spindle_ratio = 0;  ///< speed over the reference speed, in this tick's cut
  double spindle_load = 0;   ///< torque over the stall torque
  double sharpness = 1;      ///< rate of the bur over that of a new one, before this tick's cut
  std::uint32_t active_tool = 0;
  std::int64_t samples_read = 0;    ///< of the tool's surface, by contact (sample_reader.hpp)
  std::uint64_t removed_steps = 0;  ///< density steps removed in this tick, all volumes
  std::array<std::uint64_t, kMaxVolumes> removed_by_volume{};
  std::array<std::uint64_t, kMaxVolumes> returned_by_volume{};  ///< of a stroke that is undone
  std::array<VoxelBox, kMaxVolumes> changed{};                  ///< voxels that changed, by volume
  std::uint64_t output_hash = 0;                                ///< chain over all ticks
};

/// A compiled scene that can be stepped, whatever its number type.
///
/// `compile` makes one. `step`, `apply`, the two of a program's force and `penetration_mm` belong
/// to the servo thread and are the functions of servo_step.hpp and external_force.hpp; the rest is
/// constant, or may be read while no step runs.
class AnyServo {
 public:
  virtual ~AnyServo() = default;

  /// 1 or 2; constant.
  [[nodiscard]] virtual std::size_t arms() const noexcept = 0;
  /// Of the reports that the device of an arm gives; constant.
  [[nodiscard]] virtual DeviceReport::Kind report_kind(std::size_t arm) const noexcept = 0;
  /// One tick of all arms; both spans have one element for each arm.
  virtual void step(std::span<const DeviceReport> reports,
                    std::span<ServoOutput> outputs) noexcept = 0;
  /// One tick of a scene with one arm.
  [[nodiscard]] ServoOutput step(const DeviceReport& report) noexcept {
    ServoOutput output;
    step(std::span(&report, 1), std::span(&output, 1));
    return output;
  }
  virtual bool apply(const ServoCommand& command) noexcept = 0;
  /// The force of a program for an arm, from the next step on; of a replay, for the next one.
  /// External scenes only: others return false, and ignore a replay's.
  [[nodiscard]] virtual bool give_force(std::size_t arm, const ProgramForce& force) noexcept = 0;
  virtual void repeat_force(std::size_t arm, const std::array<float, 3>& contact_n) noexcept = 0;
  [[nodiscard]] virtual double penetration_mm(std::size_t arm = 0) const noexcept = 0;

  [[nodiscard]] virtual VoxelGrid grid(std::size_t scene_index) const noexcept = 0;

  /// Density of volume `scene_index`, x fastest; solid volumes change as they are cut.
  [[nodiscard]] virtual std::span<const Density> density(
      std::size_t scene_index) const noexcept = 0;
};

}  // namespace kerf
