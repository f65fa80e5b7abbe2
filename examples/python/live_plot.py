#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Force and depth of a running controller, drawn anew every second:  live_plot.py NAME SECONDS PICTURE.png
NAME is the controller's, `kerf` if it was given none. The servo is not touched. Ends after SECONDS, or with the run."""
import one_line  # first: it tells of a package that lacks
import time
import matplotlib.pyplot as plt
import numpy as np
from kerf_reader import Segment, SegmentError

def draw(name, seconds, picture):
    end, ticks = time.monotonic() + float(seconds), []
    try:
        with Segment(name) as segment:
            at = segment.head  # from now on; the ring has the last 4096 ticks
            while time.monotonic() < end and segment.alive:
                time.sleep(max(0, min(1, end - time.monotonic())))
                new, at = segment.records(at)
                if len(new): plot(np.concatenate([*ticks, new]), picture), ticks.append(new)
    except SegmentError as error: raise ValueError(str(error)) from None
    if not ticks: raise ValueError(f"{name}: no tick came in {seconds} s; is its device there?")

def plot(ticks, picture):
    plt.clf(), plt.xlabel("time (s)")
    for column, unit in (("commanded_force_n", "force (N)"), ("penetration_mm", "depth (mm)")):
        plt.plot(ticks["start_ns"] * 1e-9, np.linalg.norm(ticks[column].reshape(len(ticks), -1), axis=1), label=unit)
    plt.legend(), plt.savefig(picture, dpi=120)

one_line.run(draw, __doc__)
