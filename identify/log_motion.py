# SPDX-License-Identifier: Apache-2.0
"""A recording as the estimator takes it: positions and forces at the device, tick by tick, gaps marked."""
import numpy as np

from estimate import Motion, NoEstimate

RAMPING, ACTIVE = 3, 4   # phases in which the motors are on
MOST_STALE = 3           # reports in a row that may be missing: a line between their neighbours is good to a fraction of a step
TORN_S = 0.5             # a gap longer than this begins another piece; the longest is taken
CLAMPED = 1 << 4         # of flags: a limit of the force acted
FAULTS = ("none", "stale_input", "not_finite", "overspeed", "force_law", "velocity_estimator", "stabiliser", "wrong_dock", "sparse_input")  # docs/log.md


def _pieces(tick, longest):
    """Slices of rows without a longer gap."""
    cuts = np.flatnonzero(np.diff(tick.astype(np.int64)) > longest) + 1
    return [slice(a, b) for a, b in zip([0, *cuts], [*cuts, len(tick)])]


def motion_of(ticks, period_s, workspace_scale, offset_mm, limits=None):
    """Of rows of a log: Motion, and lines about what is missing in it. limits: the scene's. Raises NoEstimate."""
    on = (ticks["phase"] == RAMPING) | (ticks["phase"] == ACTIVE)
    usable = on & np.isfinite(ticks["position_mm"]).all(axis=1)
    if not usable.any():
        raise NoEstimate("no tick with the motors on; record a run in which the device was armed and a program gave the force")
    rows = ticks[usable]
    pieces = _pieces(rows["tick"], TORN_S / period_s)
    rows = rows[max(pieces, key=lambda piece: piece.stop - piece.start)]
    first = int(rows["tick"][0])
    at = (rows["tick"] - first).astype(np.int64)
    count = int(at[-1]) + 1
    place, force, good = np.zeros((count, 3)), np.zeros((count, 3)), np.zeros(count, bool)
    fresh = rows["stale"] == 0
    known = at[fresh]
    if len(known) < 2:
        raise NoEstimate("no reports of the device in it; record a run with the device")
    mm = (rows["position_mm"][fresh] - offset_mm) / workspace_scale
    for axis in range(3):
        place[:, axis] = np.interp(np.arange(count), known, mm[:, axis]) * 1e-3
    force[at] = rows["commanded_force_n"]
    good[at] = True
    # A row that is missing has a force that nobody knows; a report that is missing has neighbours.
    since = np.arange(count) - np.maximum.accumulate(np.where(np.isin(np.arange(count), known), np.arange(count), 0))
    for end in np.flatnonzero(np.diff(np.concatenate([since, [0]])) < 0):
        if since[end] > MOST_STALE:
            good[end - since[end] + 1:end + 1] = False
    lines = [*_lines(len(pieces), good, period_s, first), *_end(ticks, int(rows["tick"][-1]), first, period_s),
             *_saturated(rows, first, period_s, limits or {})]
    return Motion(period_s, place, force, good), lines


def _end(ticks, last, first, period_s):
    """If a fault ended it: the device was unplugged, put back too fast, the loop stood still."""
    after = ticks[(ticks["tick"] > last) & (ticks["fault"] != 0)]
    if len(after):
        code = int(after["fault"][0])
        yield (f"the motors went off by a fault {(int(after['tick'][0]) - first) * period_s:.2f} s on: "
               f"{FAULTS[code] if code < len(FAULTS) else code}; the ticks before it are used")


def _saturated(rows, first, period_s, limits):
    """Where a limit took something of the force for longer than the slew limit alone may: a device that shall show more needs more."""
    asked, given = (np.linalg.norm(rows[name], axis=1) for name in ("contact_force_n", "commanded_force_n"))
    less = ((rows["flags"] & CLAMPED) != 0) & (given < asked - 0.01)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], less, [False]]).astype(int)))
    slowest_s = limits.get("force_n", 3.3) / limits.get("slew_n_per_ms", 0.5) / 1000
    spans = [(a, b) for a, b in zip(edges[::2], edges[1::2]) if (b - a) * period_s > slowest_s]
    if spans:
        total = sum(b - a for a, b in spans) * period_s
        begin = spans[0][0]
        worst = begin + int(np.argmax(asked[begin:spans[0][1]] - given[begin:spans[0][1]]))
        yield (f"a force limit acted for {total:.2f} s in all, the first time {(int(rows['tick'][begin]) - first) * period_s:.2f} s on: "
               f"{asked[worst]:.3g} N asked, {given[worst]:.3g} N applied; the applied force is used")


def _lines(pieces, good, period_s, first):
    if pieces > 1:
        yield f"the device was off {pieces - 1} times; its longest time with the motors on is used, from tick {first} on"
    lost = np.count_nonzero(~good)
    if lost:
        where = np.flatnonzero(~good)[0]
        yield (f"{lost} of {len(good)} ticks are missing or without a report, the first {where * period_s:.2f} s on: "
               "the motion under their forces is left out")


def read(folder):
    """Of a recording's folder. Raises NoEstimate, ValueError of kerf_reader."""
    import kerf_reader
    log = kerf_reader.Log(folder)
    device = log.scene["device"]
    return motion_of(log.ticks, log.manifest["tick_ns"] * 1e-9, device.get("workspace_scale", 1.0),
                     np.array(device.get("offset_mm", [0.0, 0.0, 0.0])), log.scene.get("limits"))
