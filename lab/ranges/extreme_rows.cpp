// SPDX-License-Identifier: Apache-2.0
#include "lab/ranges/extreme_rows.hpp"

#include <array>

#include "lab/ranges/extreme_measures.hpp"

namespace kerf::ranges {
namespace {

const std::array kRows{
    ExtremeRow{"stiffness",
               "0 gives no force; both ends keep every rule; beyond, and no number, are refused",
               measure_stiffness,
               {}},
    ExtremeRow{
        "damping",
        "both ends keep every rule; beyond, no number, and what no stiffness bears are refused",
        measure_damping,
        {{"plan/gain_margin_test.cpp",
          "a damping that no stiffness bears is named with its own bound"}}},
    ExtremeRow{
        "velocity",
        "no wall is passed; faster than the limit has no motors in the same tick",
        nullptr,
        {{"proxy/tunnel_test.cpp",
          "no ball goes through a wall at any speed, or behind it without force"},
         {"servo/servo_safety_test.cpp", "faster than 10 m/s: motors off in the same tick"},
         {"servo/velocity_window_test.cpp",
          "whatever the places, the velocity is theirs within the range, and fixed is double"}}},
    ExtremeRow{
        "mass of the emulator",
        "a free mass of any size follows its parabola; the map scales with it",
        nullptr,
        {{"hil/tip_mass_test.cpp", "a free mass under a constant force follows the parabola"},
         {"stability/stable_gains_test.cpp",
          "the region scales with m/T and m/T^2, and each boundary parts stable from unstable"}}},
    ExtremeRow{
        "quantum", "no limit cycle above 3 quanta at the default stiffness", measure_quantum, {}},
    ExtremeRow{"voxel size",
               "0.01 to 2 mm and 1:4: force is stiffness times depth, within the blur",
               measure_voxel_sizes,
               {}},
    ExtremeRow{
        "density",
        "empty gives no force; full, checkerboard and one voxel keep every rule; NaN is refused",
        measure_fields,
        {{"volume/refuse_test.cpp",
          "voxels that are not numbers are counted and the first is named"}}},
    ExtremeRow{"zero gradient",
               "a start in the solid is pushed out by a ramp, or refused; the paper's force is 0",
               nullptr,
               {{"proxy/proxy_contact_test.cpp",
                 "a start inside of the solid ends outside, by a force that grows"},
                {"proxy/proxy_contact_test.cpp",
                 "a start with nothing free near is refused, until the hand is out"},
                {"servo/servo_step_test.cpp", "no force in the air, none when immersed"}}},
    ExtremeRow{
        "tool size",
        "one more sample than the limit, and larger than the volume, are refused",
        nullptr,
        {{"tool/tool_shapes_test.cpp",
          "the largest tool has exactly the largest number of samples per side"},
         {"load/scene_load_test.cpp",
          "a tool that does not suit the volume is reported with its line and the numbers"},
         {"load/scene_load_test.cpp",
          "a tool with more surface than contact can read is reported with the scene and count"}}},
    ExtremeRow{"position",
               "outside is free; far goals and counts at their ends are bounded work and finite",
               nullptr,
               {{"servo/border_test.cpp",
                 "on a solid that ends at the volume's border a tool rests, slides and cuts"},
                {"proxy/proxy_contact_test.cpp", "a far goal is bounded work and a finite force"},
                {"servo/servo_safety_test.cpp",
                 "whatever counters and pots read, the tool keeps its size and the force its "
                 "limit"}}},
    ExtremeRow{
        "packets",
        "no number, stale, repeated: held 5 ms, gone at 20 ms, fault latched",
        nullptr,
        {{"servo/servo_safety_test.cpp",
          "reports stop: the force holds 5 ms, is zero at 20 ms, motors off, fault latched"},
         {"servo/servo_safety_test.cpp",
          "encoders that tell of no pose: motors off after 2 ms, until the device was parked"},
         {"proxy/proxy_contact_test.cpp",
          "a goal that is no number gives no force and changes nothing"}}},
    ExtremeRow{"jump",
               "faster than the limit in one tick: motors off, latched",
               nullptr,
               {{"servo/servo_safety_test.cpp", "faster than 10 m/s: motors off in the same tick"},
                {"servo/servo_safety_test.cpp",
                 "one packet with the docked bit neither moves the tip nor forgives a fault"}}},
    ExtremeRow{
        "jitter",
        "missed deadlines are skipped, never caught up; a stall fades in anew",
        nullptr,
        {{"shell/clock_test.cpp",
          "deadlines keep their distance, and missed ones are skipped and counted"},
         {"shell/watchdog_test.cpp",
          "a servo that stands still for 20 ms loses its motors, once per stall"},
         {"servo/servo_safety_test.cpp", "after a stall the force starts again from nothing"}}},
    ExtremeRow{"force step",
               "slew and clamp hold from any force to any other",
               nullptr,
               {{"servo/force_limits_test.cpp",
                 "whatever is wanted, peak and slew hold, also from the ends of the number range"},
                {"servo/servo_safety_test.cpp",
                 "a very stiff scene meets every limit and keeps the force below 3.3 N"}}},
    ExtremeRow{
        "accumulation",
        "what leaves the volume and what is owed are all that was computed",
        nullptr,
        {{"kernel/removal_carry_test.cpp",
          "what leaves the volume and what the carry holds are together all that was computed"},
         {"kernel/removal_carry_test.cpp",
          "20 000 slow ticks remove what they should, though each is less than a density step"}}},
    ExtremeRow{
        "reader",
        "a reader that is slow, dead or too many disturbs nobody",
        nullptr,
        {{"segment/mirror_test.cpp", "a slow reader skips ticks and never bricks"},
         {"segment/hand_over_test.cpp", "one reader too many is refused and the others stay"},
         {"shell/clean_loop_test.cpp",
          "the loop is clean: no allocation, no page fault, one call per sleep and packet"}}},
    ExtremeRow{"energy", "the ledger stays at the ends of its range", measure_energy, {}},
    ExtremeRow{"denormals",
               "no output is subnormal, after a force and after 20 minutes of rest",
               measure_denormals,
               {}},
    ExtremeRow{
        "thermal",
        "a peak held for long settles at the continuous force",
        nullptr,
        {{"servo/force_limits_test.cpp", "a peak held for long settles at the continuous force"}}},
};

}  // namespace

std::span<const ExtremeRow> extreme_rows() {
  return kRows;
}

}  // namespace kerf::ranges
