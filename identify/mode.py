# SPDX-License-Identifier: Apache-2.0
"""The lowest structural mode, from what the encoders show and a rigid arm does not.

    x = M^-1 Fnet [ kappa / s^2 + rho / (s^2 + 2 zeta w s + w^2) ]     Fnet: force less friction, at the motor's side

Power of the misfit at frequencies of short segments under a Hann window, searched over w and zeta; kappa and rho are linear."""
import dataclasses

import numpy as np

from motion import acting_force

SEGMENT_S = 1.0
LOWEST_HZ, HIGHEST_HZ = 40.0, 410.0


@dataclasses.dataclass
class Mode:
    hz: float
    low_hz: float
    high_hz: float
    damping_ratio: float
    ratio: float  # rho / kappa: the mode's share; mass behind the joint's spring over that before it

    @property
    def left(self):
        """Of the weak form: left(d/dt) M x'' = right(d/dt) Fnet, by rising order."""
        w = 2 * np.pi * self.hz
        return 1.0, 2 * self.damping_ratio / w, 1 / w**2

    @property
    def right(self):
        one, first, second = self.left
        return one, first, second * (1 + self.ratio)


def _spectra(motion, fit):
    """By segment, axis: spectrum of the place, and of the rigid model's acceleration; frequencies in rad/s."""
    t, theta, axes = motion.period_s, fit.theta, fit.axes
    n = int(round(SEGMENT_S / t))
    mean, _ = acting_force(motion.force_n, theta[-1])
    net = mean - fit.resistance()
    net[fit.held] = 0.0
    from estimate import _AT
    acceleration = np.zeros_like(net)
    acceleration[:, axes] = np.linalg.solve(theta[_AT][np.ix_(axes, axes)], net[:, axes].T).T
    window = np.hanning(n + 2)[1:-1]
    # A mean over the period behind a tick is half a period later than its tick.
    w = 2 * np.pi * np.fft.rfftfreq(n, t)
    starts = np.arange(0, len(net) - n + 1, n // 2)
    places, drives = [], []
    k = np.arange(n) - (n - 1) / 2
    for start in starts:
        part = slice(start, start + n)
        if not motion.good[part].all() or fit.spoilt[part].any():
            continue
        x = motion.place_m[part][:, axes]
        x = x - x.mean(axis=0) - np.outer(k, (k @ x) / (k @ k))
        places.append(np.fft.rfft(x * window[:, None], axis=0))
        drives.append(np.fft.rfft(acceleration[part][:, axes] * window[:, None], axis=0) * np.exp(-0.5j * w * t)[:, None])
    use = (w > 2 * np.pi * LOWEST_HZ) & (w < min(2 * np.pi * HIGHEST_HZ, 0.9 * np.pi / t))
    noise = (fit.noise[axes]**2) * np.sum(window**2)
    return w[use], np.array(places)[:, use], np.array(drives)[:, use], noise


def _gain(w, xx, xd, dd, w_mode, zeta):
    """Fall of the chi-squared by a mode, and rho, kappa. xx, xd, dd: by frequency, over segments and axes and the noise."""
    one = -1 / w**2
    two = 1 / (w_mode**2 - w**2 + 2j * zeta * w_mode * w)
    a11, a12, a22 = np.sum(dd * one**2), np.sum(dd * (one * two).real), np.sum(dd * np.abs(two)**2)
    c1, c2 = np.sum((xd * one).real), np.sum((xd * np.conj(two)).real)
    det = a11 * a22 - a12**2
    kappa, rho = (c1 * a22 - c2 * a12) / det, (c2 * a11 - c1 * a12) / det
    return kappa * c1 + rho * c2 - c1**2 / a11, rho, kappa


def _search(w, xx, xd, dd, grid_w, grid_zeta):
    best = (-np.inf,)
    for zeta in grid_zeta:
        for w_mode in grid_w:
            gain, rho, kappa = _gain(w, xx, xd, dd, w_mode, zeta)
            if rho > 0 and kappa > 0 and gain > best[0]:
                best = (gain, w_mode, zeta, rho / kappa)
    return best


def find(motion, fit, replicates=60, seed=1):
    """None without one that the log shows."""
    w, places, drives, noise = _spectra(motion, fit)
    if len(places) < 4:
        return None
    cross, power = np.sum(places * np.conj(drives) / noise, axis=2), np.sum(np.abs(drives)**2 / noise, axis=2)
    whole = np.sum(np.abs(places)**2 / noise, axis=2)
    sums = lambda picks: (picks @ whole, picks @ cross, picks @ power)
    ones = np.ones(len(places))
    xx, xd, dd = sums(ones)
    zetas = (0.005, 0.01, 0.02, 0.04, 0.08)
    coarse = np.exp(np.arange(np.log(w[0]), np.log(w[-1]), 0.01))
    best = _search(w, xx, xd, dd, coarse, zetas)
    if len(best) == 1:
        return None
    # Misfit of the rigid arm that is left: noise has one for each number of a spectrum.
    left = (np.sum(xx) - best[0] - np.sum((xd * -1 / w**2).real)**2 / np.sum(dd / w**4)) / xx.size / len(places) / places.shape[2]
    # Three parameters, over as many independent frequencies as the band has: 1e-4 for the whole search.
    needed = 2 * np.log(len(w) * len(zetas) / 1e-4) * max(1.0, left)
    # What changes the arm below it by less than a tenth, or lies at the end of the band, is the misfit of something else.
    if best[0] < needed or best[3] < 0.1 or not 1.03 * w[0] < best[1] < w[-1] / 1.03:
        return None
    fine = lambda at, by, n: np.exp(np.log(at) + np.linspace(-by, by, n))
    def refine(xx, xd, dd, start):
        now = start
        for by in (0.01, 0.0025, 0.0006):
            now = max(now, _search(w, xx, xd, dd, fine(now[1], by, 9), fine(now[2], by * 60, 5)), key=lambda one: one[0])
        return now
    best = refine(xx, xd, dd, best)
    random = np.random.Generator(np.random.PCG64(seed))
    found = []
    for _ in range(replicates):
        picks = np.bincount(random.integers(len(places), size=len(places)), minlength=len(places)).astype(float)
        s = sums(picks)
        found.append(refine(*s, (_gain(w, *s, best[1], best[2])[0], *best[1:]))[1])
    half = max(1.96 * np.std(np.log(found)), 0.01)
    hz = best[1] / (2 * np.pi)
    return Mode(hz, hz * np.exp(-half), hz * np.exp(half), best[2], best[3])
