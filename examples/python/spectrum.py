#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Spectrum of the force that was sent:  spectrum.py LOG-FOLDER PICTURE.png

What hums stands out as a peak: the limit cycle of a wall that is too stiff, the spindle, a mode of the arm."""
import json
import sys

import matplotlib.pyplot as plt
import numpy as np

folder, picture = sys.argv[1:]
log = np.load(folder + "/ticks.npy", mmap_mode="r")
tick_s = json.load(open(folder + "/manifest.json"))["tick_ns"] * 1e-9
force = log["commanded_force_n"][(log["flags"] & 512) != 0].astype(float)  # from the first tick in hand
window = np.hanning(len(force))[:, None]
# Amplitudes of a sine: twice the one-sided transform over the window's sum, along each axis of the device.
amplitude = 2 * abs(np.fft.rfft(window * (force - force.mean(axis=0)), axis=0)) / window.sum()
frequency = np.fft.rfftfreq(len(force), tick_s)
for axis, name in enumerate("xyz"):
    plt.loglog(frequency[1:], amplitude[1:, axis], label=name, linewidth=0.8)
plt.xlabel("frequency (Hz)")
plt.ylabel("amplitude of the force (N)")
plt.ylim(bottom=1e-6)
plt.grid(alpha=0.3)
plt.legend(title="axis")
plt.savefig(picture, dpi=120)
