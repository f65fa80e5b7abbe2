# SPDX-License-Identifier: Apache-2.0
"""Exact boundary of a sampled wall, written for these tests: the loop as a matrix of one period, its eigenvalues, a bisection."""
import numpy as np


def _held(mass_kg, viscous, seconds):
    """Place and speed after a held force: by the closed form. Returns the matrix and the column of 1 N."""
    if seconds <= 0:
        return np.eye(2), np.zeros(2)
    rate = viscous / mass_kg
    fall = -np.expm1(-rate * seconds)
    way = fall / rate
    return np.array([[1.0, way], [0.0, 1 - fall]]), np.array([(seconds - way) / viscous, fall / viscous])


def highest_stiffness(mass_kg, viscous, delay_s, period_s, damping):
    """N/m, of a wall K x + B (x - x before) / T without friction; SI units."""
    whole, part = divmod(delay_s / period_s, 1.0)
    whole = int(whole)
    first, first_n = _held(mass_kg, viscous, part * period_s)
    last, last_n = _held(mass_kg, viscous, (1 - part) * period_s)
    # State: place, speed, place before, then the forces of the last `whole` + 1 periods, the newest first.
    size = 3 + whole + 1

    def stable(k):
        a = np.zeros((size, size))
        asked = np.zeros(size)
        asked[0], asked[2] = -(k + damping / period_s), damping / period_s
        queue = [asked] + [np.eye(size)[3 + i] for i in range(whole + 1)]  # newest first
        a[:2, :2] = last @ first
        a[:2] += np.outer(last @ first_n, queue[whole + 1]) + np.outer(last_n, queue[whole])
        a[2, 0] = 1
        a[3] = asked
        for i in range(whole):
            a[4 + i, 3 + i] = 1
        return np.max(np.abs(np.linalg.eigvals(a))) < 1

    low, high = 1e-3, 1e-3
    if not stable(low):
        return 0.0
    while stable(high) and high < 1e9:
        low, high = high, high * 1.1
    for _ in range(30):
        middle = np.sqrt(low * high)
        low, high = (middle, high) if stable(middle) else (low, middle)
    return low


def of_axes(mass, viscous, delay, period_s, damping):
    """The lowest of a wall across x, y and z: the mass that moves along one axis alone while the others are free."""
    free = 1 / np.diag(np.linalg.inv(mass))
    return min(highest_stiffness(free[i], max(viscous[i], 1e-9), delay * period_s, period_s, damping) for i in range(3))
