#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Position against velocity of the tip:  phase_portrait.py LOG-FOLDER PICTURE.png [AXIS]

A press that comes to rest ends at velocity 0; a limit cycle is a closed loop. AXIS: 0, 1 (up, the default) or 2."""
import one_line  # first: it tells of a package that lacks
import matplotlib.pyplot as plt
import numpy as np
from kerf_reader import Log

def draw(folder, picture, axis="1"):
    if axis not in ("0", "1", "2"): raise ValueError(f"{axis}: no axis; give 0, 1 or 2")
    log, along = Log(folder), int(axis)
    position, velocity = log["position_mm"][:, along], log["velocity_mm_per_s"][:, along]
    force = np.linalg.norm(log["commanded_force_n"], axis=1)
    known = np.isfinite(position) & np.isfinite(velocity)  # in hand
    if not known.any(): raise ValueError(f"{folder}: the device was never in hand; give a log of a motion")
    felt = known & (force > 0.01)
    shown = felt if felt.any() else known  # the way there is longer than what is felt
    plt.plot(position, velocity, color="#bbbbbb", linewidth=0.5, zorder=1)
    plt.colorbar(plt.scatter(position[shown], velocity[shown], c=force[shown], s=3, zorder=2), label="force (N)")
    for limits, values in ((plt.xlim, position[shown]), (plt.ylim, velocity[shown])):
        limits(values.min() - 0.1 * np.ptp(values) - 0.01, values.max() + 0.1 * np.ptp(values) + 0.01)
    plt.gca().set(xlabel=f"position, axis {axis} (mm)", ylabel=f"velocity, axis {axis} (mm/s)")
    plt.savefig(picture, dpi=120)

one_line.run(draw, __doc__)
