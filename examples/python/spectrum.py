#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Spectrum of the force that was sent:  spectrum.py LOG-FOLDER PICTURE.png

What hums stands out as a peak: the limit cycle of a wall that is too stiff, the spindle, a mode of the arm."""
import pathlib
import sys

import matplotlib.pyplot as plt
import numpy as np

sys.path.append(str(pathlib.Path(__file__).resolve().parents[2] / "python"))  # or install that
from kerf_reader import Log

folder, picture = sys.argv[1:]
log = Log(folder)
force = log["commanded_force_n"][log.started].astype(float)
window = np.hanning(len(force))[:, None]
# Amplitudes of a sine: twice the one-sided transform over the window's sum, along each axis of the device.
amplitude = 2 * abs(np.fft.rfft(window * (force - force.mean(axis=0)), axis=0)) / window.sum()
frequency = np.fft.rfftfreq(len(force), log.tick_s)
for axis, name in enumerate("xyz"):
    plt.loglog(frequency[1:], amplitude[1:, axis], label=name, linewidth=0.8)
plt.xlabel("frequency (Hz)")
plt.ylabel("amplitude of the force (N)")
plt.ylim(bottom=1e-6)
plt.grid(alpha=0.3)
plt.legend(title="axis")
plt.savefig(picture, dpi=120)
