#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Spectrum of the force that was sent:  spectrum.py LOG-FOLDER PICTURE.png

What hums stands out as a peak: the limit cycle of a wall that is too stiff, the spindle, a mode of the arm."""
import one_line  # first: it tells of a package that lacks
import matplotlib.pyplot as plt
import numpy as np
from kerf_reader import Log

def draw(folder, picture):
    log = Log(folder)
    force = log["commanded_force_n"][log.started].astype(float)
    if not force.any(): raise ValueError(f"{folder}: no force was sent; give a log of a touch")
    # Amplitudes of a sine: twice the one-sided transform over the window's sum, along each axis of the device.
    window = np.hanning(len(force))[:, None]
    amplitude = 2 * abs(np.fft.rfft(window * (force - force.mean(axis=0)), axis=0)) / window.sum()
    frequency = np.fft.rfftfreq(len(force), log.tick_s)
    for axis, name in enumerate("xyz"): plt.loglog(frequency[1:], amplitude[1:, axis], label=name, linewidth=0.8)
    plt.gca().set(xlabel="frequency (Hz)", ylabel="amplitude of the force (N)", ylim=(1e-6, None))
    plt.legend(title="axis")
    plt.savefig(picture, dpi=120)

one_line.run(draw, __doc__)
