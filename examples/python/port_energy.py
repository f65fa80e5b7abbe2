#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The energy at the port, recomputed from forces and positions of a log:  port_energy.py LOG-FOLDER"""
import device_tip
import one_line
import numpy as np
from kerf_reader import Log

def port_energy_j(ticks, device, tip_mm=None):
    def steps(value): return np.floor(np.asarray(value, float) * 65536 + 0.5) / 65536  # the servo's, of mm and N
    rows = np.flatnonzero((ticks["stale"] == 0) & np.isfinite(ticks["position_mm"]).all(axis=1))
    scale, offset_mm = steps(device["workspace_scale"]), steps(device["offset_mm"])
    if tip_mm is None: tip_mm = steps((ticks["position_mm"] - offset_mm) / scale)  # from the scene to the device
    sent_n = np.vstack([np.zeros(3), ticks["commanded_force_n"].cumsum(axis=0, dtype=float)])
    mean_n = steps(np.diff(sent_n[rows], axis=0) / np.diff(rows)[:, None])  # of the ticks since the last report
    taken_j = np.zeros(len(ticks))
    taken_j[rows[1:]] = -(mean_n * np.diff(tip_mm[rows], axis=0)).sum(axis=1) / 1000
    return taken_j.cumsum()

def main(folder):
    log = Log(folder)
    for arm, ticks in enumerate(table for table in (log.ticks, log.second) if table is not None):
        device = log.scene[("device", "second_device")[arm]]
        energy_j = port_energy_j(ticks, device, device_tip.from_counts(ticks, device))
        off_j = np.abs(energy_j - ticks["port_energy_j"]).max()
        print(f"arm {arm + 1}: port_energy_j {ticks['port_energy_j'][-1]:.9f} J, recomputed within {off_j:.1e} J")

if __name__ == "__main__": one_line.run(main, __doc__)
