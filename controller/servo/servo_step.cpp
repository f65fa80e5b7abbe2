// SPDX-License-Identifier: Apache-2.0

#include "controller/servo/servo_step.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

#include "controller/kernel/sampling.hpp"
#include "controller/servo/contact_force.hpp"
#include "controller/servo/force_cut.hpp"
#include "controller/servo/sense.hpp"
#include "controller/servo/servo.hpp"
#include "controller/servo/servo_plan.hpp"
#include "controller/servo/servo_state.hpp"
#include "controller/servo/volume_restore.hpp"
#include "shared/numeric/fnv1a.hpp"
#include "shared/numeric/vec.hpp"

namespace kerf {
namespace {

/// Signed motor counts, and the fraction of the force that the motors can carry.
template <class N>
struct MotorCommand {
  std::array<std::int16_t, 3> counts{};
  typename N::Unit scale{};  ///< 1, or less if a motor is at the end of its range
};

/// Scales all three counts down together if one would leave the range, so that the direction of the
/// force stays. Products are not rounded before that.
template <class N>
[[nodiscard]] MotorCommand<N> motor_command(const ServoPlan<N>& plan,
                                            JointVec<typename N::Real> torque_n_mm) noexcept {
  const std::array<typename N::Real, 3> torque{torque_n_mm.x, torque_n_mm.y, torque_n_mm.z};
  MotorCommand<N> command;
  if constexpr (N::kIsFixed) {
    constexpr int kBits = 32;  // Q16 * Q16
    const std::int64_t end = plan.device.motor_count_end;
    std::array<std::int64_t, 3> wide{};
    std::int64_t largest = end << kBits;
    for (std::size_t i = 0; i < 3; ++i) {
      wide[i] = std::int64_t{torque[i].raw()} * plan.device.joints[i].counts_per_effort.raw();
      largest = std::max(largest, wide[i] < 0 ? -wide[i] : wide[i]);
    }
    // end / largest with 30 fraction bits: 14 bits of end and 48 more. No product exceeds end with
    // 12 + 30 more.
    const std::int64_t scale = (end << (30 + 18)) / (largest >> (kBits - 18));
    command.scale = N::Unit::from_raw(static_cast<std::int32_t>(scale));
    for (std::size_t i = 0; i < 3; ++i) {
      command.counts[i] = static_cast<std::int16_t>(round_shift((wide[i] >> 20) * scale, 12 + 30));
    }
  } else {
    using Real = typename N::Real;
    const auto end = static_cast<Real>(plan.device.motor_count_end);
    std::array<Real, 3> wide{};
    Real largest = end;
    for (std::size_t i = 0; i < 3; ++i) {
      wide[i] = torque[i] * plan.device.joints[i].counts_per_effort;
      largest = std::max(largest, wide[i] < 0 ? -wide[i] : wide[i]);
    }
    command.scale = end / largest;
    for (std::size_t i = 0; i < 3; ++i) {
      // Half up, as in fixed: the offset keeps the argument of the cast positive.
      constexpr int kOffset = 16384;
      command.counts[i] = static_cast<std::int16_t>(
          static_cast<int>(wide[i] * command.scale + Real(kOffset) + Real(0.5)) - kOffset);
    }
  }
  return command;
}

// The output of a tick.

template <class N>
constexpr double energy_mj(typename N::Energy energy) noexcept {
  if constexpr (N::kIsFixed) {
    return energy_mj_of_steps(energy);
  } else {
    return static_cast<double>(energy);
  }
}

/// For the log: in steps of 2^-32 mJ, rounded and saturated.
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
  for (const std::int16_t m : out.dac_counts) {
    hash = fnv1a_step(hash, static_cast<std::uint16_t>(m));
  }
  hash = fnv1a_step(hash, word(force_n.x));
  hash = fnv1a_step(hash, word(force_n.y));
  hash = fnv1a_step(hash, word(force_n.z));
  hash = fnv1a_step(hash, out.removed_steps);
  return fnv1a_step(hash, static_cast<std::uint64_t>(out.phase) << 1 | (out.motors_on ? 1U : 0U));
}

void add_removed(const std::array<Removed, kMaxVolumes>& removed, ServoOutput& out) noexcept {
  for (std::size_t v = 0; v < kMaxVolumes; ++v) {
    out.removed_by_volume[v] = removed[v].density_steps;
    out.removed_steps += removed[v].density_steps;
    out.changed[v] = removed[v].changed;
  }
}

/// Writes the contact of the tick.
template <class N>
void write_contact(const ContactResult<N>& contact, ServoOutput& out) noexcept {
  out.samples_read = contact.samples_read;
  out.proxy_offset_mm = as_doubles(contact.proxy_offset_mm);
  out.tip_torque_n_mm = as_doubles(contact.tip_torque_n_mm);
  out.contact_force_n = as_doubles(contact.contact_n);
  out.modification_n = as_doubles(contact.modification_n);
  out.shaft = contact.shaft_force_n > typename N::Real(kContactThresholdN);
  for (std::size_t i = 0; i < contact.plane_count; ++i) {
    const PlaneLoad<N>& plane = contact.planes[i];
    out.planes[i] = {to_double(plane.normal), to_double(plane.lever_mm), as_double(plane.load_n),
                     plane.on_shaft};
  }
  out.plane_count = static_cast<std::uint32_t>(contact.plane_count);
}

/// Writes the rest of the output, for pictures and the log, and extends its hash.
template <class N>
void write_output(const ServoPlan<N>& plan, ServoState<N>& state, const Sensed<N>& sensed,
                  ServoOutput& out) noexcept {
  using Real = typename N::Real;
  out.phase = state.supervisor.phase;
  out.fault = state.supervisor.fault;
  out.started = state.supervisor.started;
  out.held = state.hold;
  out.pedalled = plan.pedalled;
  out.contact = norm(state.force_n) > Real(kContactThresholdN);
  const ProxyState<N>& proxy = state.contact.proxy;
  out.refused = plan.contact.swept && !proxy.valid && proxy.search.refused();
  for (std::size_t i = 0; i < 3; ++i) {
    out.encoder_counts[i] = state.encoders.unwrapped[i];
    out.gimbal_rad[i] = as_double(sensed.pose.gimbal[i]);
  }
  out.position_mm = as_doubles(sensed.tip_mm);
  // The orientation of contact: a tool that does not turn keeps the world's axes, and a shaft that
  // is held lags behind the stylus.
  const ToolPlan<N>& tool = plan.tools[state.active_tool];
  Rotation<N> rotation = tool.turns ? state.rotation : identity_rotation<N>();
  if (tool.swept.shaft.count > 0 && proxy.valid) rotation = {rows_of(proxy.pose.orientation)};
  for (std::size_t i = 0; i < 9; ++i) out.rotation[i] = as_double(rotation.row[i / 3][i % 3]);
  out.velocity_mm_per_s = as_doubles(sensed.velocity_mm_per_s);
  out.commanded_force_n = as_doubles(state.force_n);
  out.absorbed_mj = energy_mj<N>(state.ledger.total_mj());
  out.port_minimum_mj = energy_mj<N>(state.ledger.lowest_mj());
  std::ranges::transform(state.ledger.by_source_mj(), out.energy_steps.begin(), energy_steps<N>);
  out.active_tool = state.active_tool;
  state.output_hash = hash_of<N>(state.output_hash, out, state.force_n);
  out.output_hash = state.output_hash;
}

/// A force before its limits.
template <class N>
struct ForceRequest {
  DeviceVec<typename N::Real> force_n;
  ForceParts<N> parts{};  ///< of the force before fading in
  bool limited = false;   ///< by peak, slew or heat
};

/// The proxy follows a hand that gets no force, so that it is on the same side of every wall when
/// the force comes back, with a ramp; a program's force fades in then. For a device that rests
/// parked, or has lost its home, the search starts again. Returns the number of samples that were
/// read.
template <class N>
std::int64_t track_without_force(const ServoPlan<N>& plan, ServoState<N>& state,
                                 const Sensed<N>& sensed) noexcept {
  state.external.level = 0;  // a program's force fades in again
  if (!plan.contact.swept) return 0;
  const Phase phase = state.supervisor.phase;
  const bool begins = phase == Phase::off || phase == Phase::calibrating || sensed.docked;
  if (begins) {
    state.contact.proxy = {};
    return 0;
  }
  const ContactResult<N> contact =
      proxy_force(plan, state, sensed.tip_mm, state.rotation, sensed.velocity_mm_per_s);
  state.force_law.begin_anew();
  state.contact.proxy.ramp();
  return contact.samples_read;
}

/// The force on the tool, and its removal by overlap. Without a usable pose the force of the last
/// good report is held and then faded, and nothing is cut. `contact` stays the default if the hand
/// gets no force, and if the force law failed, apart from the samples that were read and the
/// removal.
template <class N>
ForceRequest<N> wanted_force(const ServoPlan<N>& plan, ServoState<N>& state,
                             const Sensed<N>& sensed, ContactResult<N>& contact) noexcept {
  using Real = typename N::Real;
  Supervisor& supervisor = state.supervisor;
  const SafetyTiming& timing = plan.timing;
  const auto ratio = [](std::uint32_t part, std::uint32_t whole) {
    return Real(double(part)) / Real(double(whole));
  };
  if (sensed.usable && (!supervisor.motors_on() || state.held())) {
    contact.samples_read = track_without_force(plan, state, sensed);
    return {};
  }
  if (!supervisor.motors_on()) return {};
  if (!sensed.usable) {
    return {state.held_force_n * ratio(stale_fraction(timing, supervisor.stale_ticks),
                                       timing.zero_ticks - timing.hold_ticks)};
  }
  if (plan.external.on) {
    contact.spring_n = contact.contact_n =
        external_force(plan, state.external, state.tip_mm, sensed.velocity_mm_per_s);
  } else {
    contact = contact_and_cut(plan, state, sensed.tip_mm, state.rotation, sensed.velocity_mm_per_s);
  }
  if (plan.contact.swept &&
      (contact.law_failed || !all_finite(contact.contact_n) || !all_finite(contact.spring_n))) {
    latch(Fault::force_law, supervisor);
    // What the overlap removed in this tick is gone: it stays counted, and a reset restores it.
    ContactResult<N> kept;
    kept.removed = contact.removed;
    kept.samples_read = contact.samples_read;
    contact = kept;
    return {};
  }
  const DeviceVec<Real> tool_n = contact.contact_n + contact.modification_n;
  const ForceParts<N> parts{.contact = true,
                            .spring = contact.spring_n,
                            .damping = contact.contact_n - contact.spring_n - contact.friction_n,
                            .friction = contact.friction_n,
                            .cutting = contact.modification_n};
  if (supervisor.phase != Phase::ramping) return {tool_n, parts};
  // Force beyond the peak is never sent, so it must not shorten the fade.
  return {clamped(tool_n, plan.limits.peak_n) * ratio(supervisor.fade_ticks, timing.fade_in_ticks),
          parts};
}

/// Applies the limits, then the stabiliser if the scene has one, then the limits again. Stores the
/// part of the stabiliser in `wanted`, and whether a limit acted. A force that is not finite
/// latches a fault.
template <class N>
DeviceVec<typename N::Real> force_to_send(const ServoPlan<N>& plan, ServoState<N>& state,
                                          ForceRequest<N>& wanted,
                                          const Sensed<N>& sensed) noexcept {
  using Real = typename N::Real;
  const auto limited = [&](DeviceVec<Real> force_n, ThermalState<N>& thermal) {
    const auto limited_n =
        limited_force(plan.limits, thermal, force_n, state.force_n, sensed.leaves);
    wanted.limited = wanted.limited || !(limited_n == force_n);
    return limited_n;
  };
  if (state.held()) state.stabiliser.begin_anew();
  if (!plan.stabiliser.given() || !sensed.usable || state.held()) {
    return limited(wanted.force_n, state.thermal);
  }
  ThermalState<N> heated = state.thermal;
  const DeviceVec<Real> limited_n = limited(wanted.force_n, heated);
  const DeviceVec<Real> steady_n =
      plan.stabiliser(state.stabiliser, {limited_n, state.force_n, state.moved_mm,
                                         state.moved_ticks, state.velocity_mm_per_s,
                                         state.ledger.total_mj(), norm(state.contact_n) > Real(0)});
  if (!all_finite(steady_n)) {
    latch(Fault::stabiliser, state.supervisor);
    return {};
  }
  wanted.parts.stabiliser = steady_n - limited_n;
  if (!(steady_n == limited_n)) return limited(steady_n, state.thermal);
  state.thermal = heated;  // limits round: an unchanged force is not limited again
  return limited_n;
}

/// Limits the force and turns it into motor counts. Switching off is exempt from the slew limit.
template <class N>
void drive(const ServoPlan<N>& plan, ServoState<N>& state, ForceRequest<N>& wanted,
           const Sensed<N>& sensed, ServoOutput& out) noexcept {
  using Real = typename N::Real;
  if (state.supervisor.motors_on() && !all_finite(wanted.force_n)) {
    latch(Fault::not_finite, state.supervisor);
  }
  DeviceVec<Real> limited_n{};
  if (state.supervisor.motors_on() && plan.device.motors_configured) {
    limited_n = force_to_send(plan, state, wanted, sensed);
    out.motors_on = state.supervisor.motors_on();
  }
  if (!out.motors_on) {
    heat_up(plan.limits, state.thermal, {});
    state.force_n = {};
    state.stabiliser.begin_anew();
    return;
  }
  const MotorCommand<N> motors = motor_command(plan, state.jacobian_t_mm * limited_n);
  out.dac_counts = motors.counts;
  state.force_n = {multiply<Real>(motors.scale, limited_n.x),
                   multiply<Real>(motors.scale, limited_n.y),
                   multiply<Real>(motors.scale, limited_n.z)};
  out.clamped = wanted.limited || motors.scale < typename N::Unit(1);
  const JointVec<Real> torque_n_mm = state.jacobian_t_mm * state.force_n;
  out.torque_n_mm = {as_double(torque_n_mm.x), as_double(torque_n_mm.y), as_double(torque_n_mm.z)};
}

/// With a usable report: splits the work since the last one, and keeps the parts of the force that
/// was sent.
template <class N>
void update_energy(ServoState<N>& state, const ForceRequest<N>& wanted, bool motors_on) noexcept {
  ForceParts<N> parts = wanted.parts;
  state.ledger.split(parts);
  if (!motors_on) return state.ledger.send({});
  parts.limits = state.force_n - wanted.force_n - parts.stabiliser;
  state.ledger.send(parts);
}

/// Of the bur in the hand; 1 if it does not wear.
template <class N>
double sharpness_of(const ServoPlan<N>& plan, const ServoState<N>& state) noexcept {
  const CutLaw<N>& law = plan.tools[state.active_tool].law;
  if (!(law.wear_half > 0)) return 1;
  const BurWear<N>& wear = state.force_cut.wear[state.active_tool];
  return static_cast<double>(wear.sharpness(law)) /
         static_cast<double>(BurWear<N>{}.sharpness(law));
}

/// Cuts by the force that was sent. The spindle runs while the motors hold the hand and the pedal,
/// if there is one, is down; with the pedal up nothing is cut, though the spindle runs down.
template <class N>
void cut(const ServoPlan<N>& plan, ServoState<N>& state, const ContactResult<N>& contact,
         ServoOutput& out) noexcept {
  if (!plan.force_cut.on) return;
  out.spindle_ratio = as_double(state.force_cut.spindle.ratio);
  out.sharpness = sharpness_of(plan, state);
  const bool runs = state.supervisor.motors_on() && !state.held() && state.pedal_down;
  const ForceCut<N> done = cut_by_sent_force(plan, state, contact, state.force_n, runs);
  out.press_n = as_double(done.normal_force_n);
  out.spindle_load = as_double(state.force_cut.spindle.load);
  out.forbidden_materials = done.forbidden;
  out.forbidden = done.forbidden != 0;
  add_removed(done.removed, out);
}

/// Whether the tool holds on to its stroke: by the pedal of an arm at work, or without one by
/// contact.
template <class N>
bool holds_on(const Arm<N>& arm) noexcept {
  const bool touches = !(arm.state->contact_n == DeviceVec<typename N::Real>{});
  const bool pressed = arm.state->pedal_down && arm.state->supervisor.motors_on();
  return arm.plan->pedalled ? pressed : touches;
}

/// Marks what was cut, or restores it while a reset, an undo or a redo runs: then nothing is cut.
template <class N>
void follow_cuts(Arms<N> arms, std::span<ServoOutput> outputs) noexcept {
  VolumeHistory& history = *arms.front().state->history;
  StrokeState& stroke = history.stroke;
  for (ServoOutput& out : outputs) {
    out.resetting = history.reset.runs;
    out.undoing = stroke.motion == StrokeState::Motion::undo;
    out.redoing = stroke.motion == StrokeState::Motion::redo;
  }
  if (history.reset.runs) return restore_some(arms, outputs.front().changed);
  if (history.restores()) return swap_some(arms, outputs.front());
  bool cuts = false, holds = false;
  for (std::size_t a = 0; a < arms.size(); ++a) {
    const ServoPlan<N>& plan = *arms[a].plan;
    for (std::size_t v = 0; v < plan.volume_count; ++v) {
      const VolumePlan<N>& volume = plan.volumes[v];
      mark_cut(volume.grid, outputs[a].changed[volume.scene_index],
               arms[a].state->volumes[v].cut_blocks);
    }
    cuts = cuts || outputs[a].removed_steps > 0;
    holds = holds || holds_on(arms[a]);
  }
  if (stroke.pool.empty()) return;
  follow_stroke(arms.front().plan->stroke_pause_ticks, cuts, holds, stroke);
  for (ServoOutput& out : outputs) {
    out.undoable = stroke.can_undo();
    out.redoable = stroke.can_redo();
  }
}

/// The tick of one arm up to its cut. Returns what it sensed.
template <class N>
Sensed<N> step_arm(const ServoPlan<N>& plan, ServoState<N>& state, const DeviceReport& report,
                   ServoOutput& out) noexcept {
  if (report.fresh) state.pedal_down = !plan.pedalled || report.button1;
  const Sensed<N> sensed = sense(plan, state, report);
  if (plan.external.on) state.external.follow(plan.external, plan.timing);
  ContactResult<N> contact;
  ForceRequest<N> wanted = wanted_force(plan, state, sensed, contact);
  state.contact_n = contact.contact_n;
  state.proxy_offset_mm = contact.proxy_offset_mm;
  drive(plan, state, wanted, sensed, out);
  state.force_sum_n = state.force_sum_n + state.force_n;
  if (sensed.usable) update_energy(state, wanted, out.motors_on);
  write_contact(contact, out);
  add_removed(contact.removed, out);
  cut(plan, state, contact, out);
  if (sensed.usable) state.held_force_n = state.force_n;
  out.stale = !report.fresh;
  return sensed;
}

}  // namespace

template <class N>
void servo_step(Arms<N> arms, std::span<const DeviceReport> reports,
                std::span<ServoOutput> outputs) noexcept {
  std::array<Sensed<N>, kMaxArms> sensed;
  for (std::size_t a = 0; a < arms.size(); ++a) {
    outputs[a] = {};
    sensed[a] = step_arm(*arms[a].plan, *arms[a].state, reports[a], outputs[a]);
  }
  follow_cuts(arms, outputs);
  for (std::size_t a = 0; a < arms.size(); ++a) {
    write_output(*arms[a].plan, *arms[a].state, sensed[a], outputs[a]);
  }
}

template <class N>
double penetration_mm(const ServoPlan<N>& plan, const ServoState<N>& state) noexcept {
  using Real = typename N::Real;
  if (plan.external.on) return 0;
  if (plan.contact.swept) return as_double(norm(state.proxy_offset_mm));
  const Real length = norm(state.contact_n);
  if (!(length > Real(0))) return 0;
  using Unit = typename N::Unit;
  const WorldVec<Unit> normal{Unit(state.contact_n.x / length), Unit(state.contact_n.y / length),
                              Unit(state.contact_n.z / length)};
  const WorldVec<Real> tip_mm =
      relabel<WorldSpace>(state.tip_mm * plan.workspace_scale) + plan.offset_mm;
  const ToolPlan<N>& tool = plan.tools[state.active_tool];
  double deepest_mm = 0;
  for (std::size_t v = 0; v < plan.volume_count; ++v) {
    const VolumePlan<N>& volume = plan.volumes[v];
    const ToolPose<N> pose = tool_pose(volume, tool, tool.in_volume[v], tip_mm, state.rotation);
    const Real extent = penetration_extent<N>(volume.grid, state.volumes[v].density, tool.offsets,
                                              pose, volume.iso, volume.normal_from_world * normal);
    deepest_mm = std::max(deepest_mm, as_double(extent * volume.largest_spacing_mm));
  }
  return deepest_mm;
}

namespace {

template <class N>
bool select_tool(const Arm<N>& arm, std::uint32_t tool) noexcept {
  ServoState<N>& state = *arm.state;
  if (tool >= arm.plan->tool_count) return false;
  if (tool == state.active_tool) return true;
  state.active_tool = tool;
  state.contact.proxy.search_again();  // the new tool may not fit where the old one was
  state.force_cut.change_tool();
  return true;
}

}  // namespace

template <class N>
bool apply_command(Arms<N> arms, const ServoCommand& command) noexcept {
  const ServoPlan<N>& plan = *arms.front().plan;
  VolumeHistory& history = *arms.front().state->history;
  switch (command.kind) {
    case ServoCommand::Kind::none:
    case ServoCommand::Kind::mark:
      return true;
    case ServoCommand::Kind::select_tool:
      return command.arm < arms.size() && select_tool(arms[command.arm], command.argument);
    case ServoCommand::Kind::fade_in:
      for (const Arm<N>& arm : arms) {
        restart_fade(arm.state->supervisor);
        arm.state->force_n = {};  // the motors were off meanwhile
        arm.state->held_force_n = {};
        arm.state->force_sum_n = {};
        arm.state->ledger.send({});
      }
      return true;
    case ServoCommand::Kind::missed:
      for (const Arm<N>& arm : arms) {
        miss_ticks(command.argument, arm.state->supervisor);
        miss_ticks(arm.plan->timing, command.argument, arm.state->encoders);
      }
      return true;
    case ServoCommand::Kind::hold:
      for (const Arm<N>& arm : arms) arm.state->hold = command.argument != 0;
      return true;
    case ServoCommand::Kind::reset:
      history.reset.runs = plan.overlap_cuts || plan.force_cut.on;
      forget_strokes(history.stroke);  // their bricks are among those that were cut
      return true;
    case ServoCommand::Kind::undo:
      return !history.reset.runs && begin_undo(history.stroke);
    case ServoCommand::Kind::redo:
      return !history.reset.runs && begin_redo(history.stroke);
  }
  return false;
}

// For both bundles of number types, compiled once.
#define KERF_INSTANTIATE(N)                                                              \
  template void servo_step<N>(Arms<N>, std::span<const DeviceReport>,                    \
                              std::span<ServoOutput>) noexcept;                          \
  template double penetration_mm<N>(const ServoPlan<N>&, const ServoState<N>&) noexcept; \
  template bool apply_command<N>(Arms<N>, const ServoCommand&) noexcept;
KERF_INSTANTIATE(FixedNumbers)
KERF_INSTANTIATE(DoubleNumbers)
#undef KERF_INSTANTIATE

}  // namespace kerf
