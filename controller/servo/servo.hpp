// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "shared/numeric/energy_source.hpp"
#include "shared/numeric/numbers.hpp"
#include "shared/numeric/vec.hpp"
#include "shared/volume/voxel_grid.hpp"
#include "shared/wire/personality.hpp"

// The interface of the servo: report and command in, output out.

namespace kerf {

/// Report of the device in this tick: raw counts, not angles. The only input of the servo step
/// besides commands, and so the input of a replay.
///
/// A Cartesian device has the position in `encoder`, in counts of its `step_um`
/// (shared/wire/cartesian.hpp), and the orientation as a quaternion of 16-bit numbers: x, y, z in
/// `wiper_a`, w in `wiper_b[0]`.
///
/// `parked` means that the device is not in use: the stylus is in the inkwell (Omni, Touch), the
/// centre button of the grip is held (Falcon), the arm has not left the home pose since its
/// calibration button was pressed (WoodenHaptics), or a button is held (Inverse3, omega). Parking
/// at rest calibrates the device; motors stay off while it is parked.
struct DeviceReport {
  bool fresh = false;                      ///< false: nothing arrived since the last tick
  std::array<std::int16_t, 3> encoder{};   ///< counts, wrap at 16 bits
  std::array<std::uint16_t, 3> wiper_a{};  ///< gimbal pots, both wipers; zero without a gimbal
  std::array<std::uint16_t, 3> wiper_b{};
  bool button1 = false, button2 = false;  ///< pressed
  bool parked = false;
  bool homed = true;          ///< false: absolute encoders have no meaning yet
  std::uint32_t counter = 0;  ///< packet counter of the device, else of the driver
};

/// A command of a person or a program; applied at a tick boundary. Values of kinds go into logs:
/// append only.
struct ServoCommand {
  enum class Kind : std::uint32_t {
    none,
    select_tool,
    hold,
    fade_in,  ///< force starts again from 0: after a stall of the servo
    reset,    ///< restores the volumes' first content, over several ticks; no-op without cutting
    undo,     ///< restores the content before the last stroke, likewise; refused without one
    redo,     ///< repeats the stroke that was undone last, likewise
    mark,     ///< changes nothing: marks a tick in the log
    missed    ///< ticks that the host skipped before this one: without a report, for all arms
  };
  Kind kind = Kind::none;
  std::uint32_t argument = 0;  ///< index of the tool; hold: 1 on, 0 off; missed: ticks
  std::uint32_t arm = 0;       ///< that gets the tool; other kinds are for all arms
};

inline constexpr double kContactThresholdN = 0.01;  ///< a tick with more force is a contact tick

/// Phase of the safety state machine. Motors are on in `ramping` and `active` only. Values go
/// into logs: append only.
enum class Phase : std::uint8_t {
  off,          ///< no report has come yet
  calibrating,  ///< never parked at rest yet, or homing lost: the joint angles are unknown
  armed,        ///< calibrated and parked: waits for the hand
  ramping,      ///< taken in hand: force fades in
  active,
  fault  ///< latched; parking at rest clears it
};

/// Why the force went to zero. Values go into logs: append only.
enum class Fault : std::uint32_t {
  none = 0,
  stale_input = 1,  ///< no report for 20 ms
  not_finite = 2,   ///< no finite pose, or counts of none, for more than 2 ms
  overspeed = 3,    ///< tip faster than the limit
  // A law of the scene gave a value that is not finite:
  force_law = 4,
  velocity_estimator = 5,
  stabiliser = 6,
  wrong_dock = 7,   ///< parked at rest, but not where it was calibrated first
  sparse_input = 8  ///< reports came too seldom for too long
};

[[nodiscard]] constexpr const char* fault_name(Fault fault) noexcept {
  switch (fault) {
    case Fault::none:
      return "none";
    case Fault::stale_input:
      return "stale_input";
    case Fault::not_finite:
      return "not_finite";
    case Fault::overspeed:
      return "overspeed";
    case Fault::force_law:
      return "force_law";
    case Fault::velocity_estimator:
      return "velocity_estimator";
    case Fault::stabiliser:
      return "stabiliser";
    case Fault::wrong_dock:
      return "wrong_dock";
    case Fault::sparse_input:
      return "sparse_input";
  }
  return "unknown";
}

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
  std::array<std::int16_t, 3> motor_counts{};  ///< signed counts of the device, 0 = no torque
  bool motors_on = false;
  Phase phase = Phase::off;
  Fault fault = Fault::none;
  bool started = false;    ///< was armed and taken in hand at least once: ticks count
  bool stale = false;      ///< no fresh report in this tick
  bool clamped = false;    ///< force, slew, thermal or motor limit was active
  bool contact = false;    ///< commanded force above 0.01 N
  bool forbidden = false;  ///< the tool presses on a forbidden material
  std::uint64_t forbidden_materials = 0;  ///< which: bit m is material m of the scene
  bool refused = false;                   ///< no free position near the hand: no force
  bool shaft = false;                     ///< load of shaft and handpiece above 0.01 N
  bool held = false;                      ///< by a command: no force and no cut
  bool undoing = false;                   ///< the last stroke is undone: likewise
  bool undoable = false;                  ///< it can be
  bool redoing = false;                   ///< a stroke that was undone is cut again: likewise
  bool redoable = false;                  ///< it can be
  bool pedalled = false;                  ///< nothing is cut without button 1
  bool resetting = false;  ///< volumes go back to their first content: changes are no cuts

  std::array<std::int32_t, 3> joint_counts{};  ///< unwrapped since calibration
  std::array<double, 3> gimbal_rad{};          ///< yaw, pitch, roll
  std::array<double, 3> position_mm{};         ///< tip in the scene
  std::array<double, 9> rotation{};            ///< world from tool as of the contact, row-major
  std::array<double, 3> velocity_mm_per_s{};   ///< device port, as estimated
  std::array<double, 3> force_n{};             ///< sent to the hand, device port
  std::array<double, 3> contact_n{};           ///< part of it before limits, device port
  std::array<double, 3> modification_n{};      ///< part from cutting: reaction, or friction
  std::array<double, 3> torque_n_mm{};         ///< motor torques
  std::array<double, 3> proxy_offset_mm{};     ///< from the tip to the proxy's, in the scene
  std::array<double, 3> tip_torque_n_mm{};     ///< of contact and cutting about the tip
  std::array<PlaneLoad<DoubleNumbers>, kMaxPlaneLoads> planes{};
  std::uint32_t plane_count = 0;  ///< of the planes that hold the tool
  double absorbed_mj = 0;         ///< SUM -F_sent . dx of the run; + = taken from the hand
  double port_minimum_mj = 0;     ///< lowest value of it so far
  /// `absorbed_mj` by source, in steps of 2^-32 mJ; exact in fixed point, as is their sum.
  std::array<std::int64_t, kEnergySources> energy_steps{};

  double press_n = 0;        ///< normal force that cuts, in the scene
  double spindle_ratio = 0;  ///< speed over the reference speed, in this tick's cut
  double spindle_load = 0;   ///< torque over the stall torque
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
/// `compile` makes one. `step`, `apply` and `penetration_mm` belong to the servo thread and are the
/// functions of servo_step.hpp; the rest is constant, or may be read while no step runs.
class Servo {
 public:
  virtual ~Servo() = default;

  /// 1 or 2; constant.
  [[nodiscard]] virtual std::size_t arms() const noexcept = 0;
  /// One tick of all arms; both spans have one element for each arm.
  virtual void step(std::span<const DeviceReport> reports,
                    std::span<ServoOutput> outputs) noexcept = 0;
  /// The same for a scene with one arm.
  [[nodiscard]] ServoOutput step(const DeviceReport& report) noexcept {
    ServoOutput output;
    step(std::span(&report, 1), std::span(&output, 1));
    return output;
  }
  virtual bool apply(const ServoCommand& command) noexcept = 0;
  [[nodiscard]] virtual double penetration_mm(std::size_t arm = 0) const noexcept = 0;

  [[nodiscard]] virtual VoxelGrid grid(std::size_t scene_index) const noexcept = 0;

  /// Density of volume `scene_index`, x fastest; solid volumes change as they are cut.
  [[nodiscard]] virtual std::span<const Density> density(
      std::size_t scene_index) const noexcept = 0;
};

}  // namespace kerf
