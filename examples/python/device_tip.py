# SPDX-License-Identifier: Apache-2.0
"""The tip at the device to the last bit, from the counts of its joints: what `position_mm` is rounded from."""
import numpy as np

STEP_MM = {"inverse3": 0.01, "touch": 0.01, "omega": 0.004}  # of a count

def _rounded(wide, bits): return (wide + (1 << (bits - 1))) >> bits
def _fixed(value, bits): return int(np.floor(value * 2**bits + 0.5))

def _sine_cosine(angle):  # 28 bits after the point in, 30 out; the servo's own series
    square, sine, cosine = _rounded(angle * angle, 28), 1 << 28, 1 << 28
    for k in range(8, 0, -1):
        for_sine, for_cosine = _fixed(1 / (2 * k * (2 * k + 1)), 28), _fixed(1 / ((2 * k - 1) * 2 * k), 28)
        sine = (1 << 28) - _rounded(_rounded(square * for_sine, 28) * sine, 28)
        cosine = (1 << 28) - _rounded(_rounded(square * for_cosine, 28) * cosine, 28)
    return _rounded(angle * sine, 28) << 2, cosine << 2

def from_counts(ticks, device):
    """mm, a row for each tick; None for a device whose tip is not computed here (Falcon, WoodenHaptics)."""
    counts, step_mm = ticks["encoder_counts"][:, :3].astype(np.int64), STEP_MM.get(device["personality"])
    if step_mm: return _rounded(counts * int(step_mm * 2**40), 24) / 65536
    if device["personality"] != "omni": return None
    per_count = np.array([int(sign * 2 * np.pi / 15000 * 2**40) for sign in (1, -1, 1)])
    home = np.array([_fixed(angle, 28) for angle in device["dock_rad"]])
    (s1, c1), (s2, c2), (s3, c3) = map(_sine_cosine, (home + _rounded(counts * per_count, 12)).T)
    link, height, depth = (_fixed(mm, 16) for mm in (133.35, 23.35, 168.35))
    times = lambda unit, mm: _rounded(unit * mm, 30)
    reach = times(c2, link) + times(s3, link)
    return np.stack([-times(s1, reach), times(s2, link) - times(c3, link) + height, times(c1, reach) - depth], 1) / 65536
