# SPDX-License-Identifier: Apache-2.0
"""Test functions: the equation of motion, multiplied by a smooth bump and integrated by parts, needs positions alone.

phi(u) = (1 - u^2)^8, |u| < 1, over `half` ticks to both sides of a centre. A row is the mean of a signal under the bump, so each
row of a force is in N. Shinbrot 1957; Bortz et al., "WENDy", Bull. Math. Biol. 85, 2023."""
import numpy as np
from numpy.polynomial import Polynomial

_BUMP = Polynomial([1.0, 0.0, -1.0]) ** 8  # four derivatives are smooth at the ends
_DERIVATIVES = [_BUMP.integ(), _BUMP, _BUMP.deriv(1), _BUMP.deriv(2), _BUMP.deriv(3), _BUMP.deriv(4)]
_AREA = float(_DERIVATIVES[0](1.0) - _DERIVATIVES[0](-1.0))


def _phi(order, u):
    """Derivative `order` of the bump by u; -1: its integral."""
    inside = np.clip(u, -1.0, 1.0)
    value = _DERIVATIVES[order + 1](inside)
    return value if order < 0 else np.where(np.abs(u) < 1.0, value, 0.0)


class Rows:
    """The rows of all bumps of one width over a log of `count` ticks of `period_s`, four to a width."""

    def __init__(self, half, count, period_s, most_delay):
        self.half, self.period_s = half, period_s
        self.before = half + int(most_delay) + 2  # ticks of a force that may still act
        self.centre = np.arange(self.before, count - half - 1, max(1, half // 2))
        self._k = np.arange(-half, half + 1)

    def _windows(self, signal, low, high):
        views = np.lib.stride_tricks.sliding_window_view(signal, high - low + 1, axis=0)
        return views[self.centre + low]

    def _kernel(self, order, operator):
        """Of the bump under the operator's adjoint, derived `order` times by the time."""
        width_s = self.half * self.period_s
        u = self._k / self.half
        kernel = sum((-1)**n * c * _phi(order + n, u) / width_s**(order + n) for n, c in enumerate(operator or (1.0,)))
        return kernel / (self.half * _AREA)

    def of(self, signal, order=0, operator=None):
        """Of samples at the ticks: the mean of operator(d/dt) of the signal's derivative `order`, without deriving it. operator:
        coefficients by rising order; None: 1."""
        sign = -1.0 if order % 2 else 1.0
        return sign * self._windows(signal, -self.half, self.half) @ self._kernel(order, operator)

    def of_force(self, force, delay, operator=None, by_delay=False):
        """Of a force that is held from its tick plus `delay` periods on, for a period: exact for any part of a period.
        by_delay: derived by the delay."""
        k = np.arange(-self.before, self.half + 1)
        width_s = self.half * self.period_s
        edges = (np.arange(-self.before, self.half + 2) + delay) / self.half
        more = 0 if by_delay else -1
        kernel = sum((-1)**n * c * np.diff(_phi(n + more, edges)) / width_s**n for n, c in enumerate(operator or (1.0,)))
        return self._windows(force, k[0], k[-1]) @ kernel / (_AREA * (self.half if by_delay else 1.0))

    def touches(self, bad, before=False):
        """Rows under whose bump a sample is bad; before: or among the forces that act there."""
        total = np.concatenate([[0], np.cumsum(bad)])
        low = self.centre - (self.before if before else self.half)
        return total[self.centre + self.half + 1] - total[low] > 0

    @property
    def noise_of_acceleration(self):
        """Standard deviation of a row of the second derivative for white noise of 1 in the samples."""
        return float(np.linalg.norm(self._kernel(2, None)))
