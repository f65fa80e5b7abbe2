# SPDX-License-Identifier: Apache-2.0
"""A hand in one of 64 worlds that a simulator steps at once, at 200 Hz: in each a plate on a spring, and the hand presses the first
one. The servo renders the contact at its own rate, since the loop gives a goal, the plate's surface, and no force.

    ./kerf demo --scene external --name mine --seconds 20 &
    python3 batch_loop.py mine 5

A simulator takes the place of `Worlds`, in metres: MuJoCo has data.xfrc_applied for the force, mujoco.mj_step(model, data) and
data.xpos; Isaac Lab set_external_force_and_torque, sim.step() and root_pos_w, tensors with a row for each world."""
import math
import sys
import kerf
import numpy as np
STEP_S, STIFF_N_PER_MM = 0.005, 0.3
class Worlds:
    def __init__(self, count):
        self.height_mm, self.speed_mm_per_s = np.zeros(count), np.zeros(count)

    def step(self, pushes_n):
        """Plates of 0.05 kg on 0.1 N/mm with 0.003 N s/mm; semi-implicit Euler. pushes_n: upwards, a force for each world."""
        forces_n = pushes_n - 0.1 * self.height_mm - 0.003 * self.speed_mm_per_s
        self.speed_mm_per_s += 1000 * forces_n / 0.05 * STEP_S
        self.height_mm += self.speed_mm_per_s * STEP_S

name, seconds = sys.argv[1], float(sys.argv[2])
worlds, pushes_n, lowest_mm, due, above, steps = Worlds(64), np.zeros(64), np.zeros(64), 0, False, 0
with kerf.Device(name) as device:
    for state in device:                                        # ends with the controller
        if state.tick < due or math.isnan(state.position_mm[1]):
            continue
        due, steps = state.tick + round(STEP_S / device.period_s), steps + 1
        x, y, z = state.position_mm
        above = above or y > 0                                  # the tip begins in its dock, below
        depth_mm = max(0.0, worlds.height_mm[0] - y) if above else 0.0
        pushes_n[0] = -STIFF_N_PER_MM * depth_mm
        worlds.step(pushes_n)
        np.minimum(lowest_mm, worlds.height_mm, out=lowest_mm)
        device.give(goal_mm=(x, worlds.height_mm[0], z), stiffness_n_per_mm=STIFF_N_PER_MM if depth_mm > 0 else 0)
        if steps * STEP_S > seconds: break
print(f"{steps} steps, the first plate down to {lowest_mm[0]:.2f} mm, the others to {lowest_mm[1:].min():.2f} mm")
