# SPDX-License-Identifier: Apache-2.0
"""A spring about the origin by pyhaptic, as its own example has it, and what it read and sent.

    pyhaptic_spring.py SECONDS NEWTONS_PER_METRE      in lock-step at 1 kHz: a force is a millisecond"""
import sys

import pyhaptic

turns, stiffness = int(float(sys.argv[1]) * 1000), float(sys.argv[2])
device = pyhaptic.Device()
device.enable_force(True)
squares = work_j = 0.0
last, force = device.get_position(), (0.0, 0.0, 0.0)
for _ in range(turns):
    now = device.get_position()
    work_j += sum(f * (a - b) for f, a, b in zip(force, now, last))
    last, force = now, tuple(-stiffness * x for x in now)
    squares += sum(f * f for f in force)
    device.set_force(*force)
for _ in range(2000):  # the hand comes to rest
    device.set_force(0, 0, 0)
print("position_mm", *(1000 * x for x in device.get_position()), "rms_n", (squares / turns) ** 0.5, "seconds", turns / 1000,
      "work_mj", 1000 * work_j)
device.enable_force(False)
device.close()
