#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Position against velocity of the tip:  phase_portrait.py LOG-FOLDER PICTURE.png [AXIS]

A press that comes to rest winds into a point; a limit cycle is a closed loop. AXIS: 0, 1 (up) or 2."""
import pathlib
import sys

import matplotlib.pyplot as plt
import numpy as np

sys.path.append(str(pathlib.Path(__file__).resolve().parents[2] / "python"))  # or install that
from kerf_reader import Log

folder, picture = sys.argv[1:3]
axis = int(sys.argv[3]) if len(sys.argv) > 3 else 1
log = Log(folder)
position, velocity = log["position_mm"][:, axis], log["velocity_mm_per_s"][:, axis]  # NaN: not drawn
force = np.linalg.norm(log["commanded_force_n"], axis=1)
plt.plot(position, velocity, color="#bbbbbb", linewidth=0.5, zorder=1)
felt = force > 0.01
plt.colorbar(plt.scatter(position[felt], velocity[felt], c=force[felt], s=3, zorder=2), label="force (N)")
plt.gca().set(xlabel=f"position, axis {axis} (mm)", ylabel=f"velocity, axis {axis} (mm/s)")
shown = felt if felt.any() else np.isfinite(position)  # the way there is longer than what is felt
for limits, values in ((plt.xlim, position[shown]), (plt.ylim, velocity[shown])):
    margin = 0.1 * np.ptp(values) + 0.01
    limits(np.nanmin(values) - margin, np.nanmax(values) + margin)
plt.grid(alpha=0.3)
plt.savefig(picture, dpi=120)
