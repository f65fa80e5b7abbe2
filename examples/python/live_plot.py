#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Force and depth of a running controller, while it runs:  live_plot.py NAME SECONDS PICTURE.png

NAME is that of the controller (`kerf` if it was given none). The picture is drawn anew every second, so a viewer that
reloads its file shows the run; the servo is not touched. Ends after SECONDS, or with the controller."""
import one_line  # first: it tells of a package that lacks
import time
import matplotlib.pyplot as plt
import numpy as np
from kerf_reader import Segment, SegmentError

def draw(name, seconds, picture):
    end, rows, at = time.monotonic() + float(seconds), [], 0
    try:
        with Segment(name) as segment:
            at = segment.head  # from now on
            while time.monotonic() < end and segment.alive:
                time.sleep(min(1, max(0, end - time.monotonic())))
                new, at = segment.records(at)  # the ring has the last 4096 ticks
                rows.append(new)
                if len(new): plot(np.concatenate(rows), picture)
    except SegmentError as error: raise ValueError(str(error)) from None
    if not sum(map(len, rows)): raise ValueError(f"{name}: no tick came in {seconds} s; is its device there?")

def plot(ticks, picture):
    seconds = (ticks["start_ns"] - ticks["start_ns"][0]) * 1e-9
    figure, (force, depth) = plt.subplots(2, sharex=True)
    force.plot(seconds, np.linalg.norm(ticks["commanded_force_n"], axis=1), color="tab:red", linewidth=0.8)
    force.set(ylabel="force (N)")
    depth.plot(seconds, ticks["penetration_mm"], color="tab:blue", linewidth=0.8)
    depth.set(ylabel="depth (mm)", xlabel="time (s)")
    figure.savefig(picture, dpi=120)
    plt.close(figure)

one_line.run(draw, __doc__)
