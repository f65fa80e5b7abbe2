# SPDX-License-Identifier: Apache-2.0
"""Mass matrix, friction, delay, quantum and structural mode of a device from positions and forces of its ticks (docs/gains.md).

    M x'' + b x' + f sign(x') + k x + g = F(t - delay)      at the tip, per axis but for M, which is symmetric

Each is multiplied by bumps and integrated by parts (weak_form), which gives rows that are linear in all but the delay. Rows of the
acceleration have the noise of the positions, so the fit is one by instruments, the model's own acceleration (Young 2011, ch. 8),
repeated with a Gauss-Newton step of the delay until it stands still."""
import dataclasses

import numpy as np

import mode as modes
from motion import acting_force, directions, modal, model_speed, slope
from weak_form import Rows

AXES = "xyz"
PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
_AT = np.array([[0, 3, 4], [3, 1, 5], [4, 5, 2]])  # of a pair among the parameters
NAMES = [f"mass_{AXES[i]}{AXES[j]}" for i, j in PAIRS] + [f"{name}_{axis}" for name in ("viscous", "coulomb", "weight", "spring") for axis in AXES] + ["delay"]
_B, _F, _G, _K, _D = 6, 9, 12, 15, 18
_COUNT = 19
MOST_DELAY = 8         # periods
HALVES_S = (0.016, 0.04, 0.1, 0.25)  # of the bumps: from the mode's foot down to a slow sweep
BLOCK_S = 1.0
REPLICATES = 400
TRIMMED = 4.0          # usual sizes of a residual: beyond them lies a reversal that the model got wrong; at most 7 % of all rows
SPOILT = 0.3           # of the force of a block unexplained: something outside of the arm; of all of it: no arm of this model
POOR = 0.01            # of the force unexplained: worth a look at friction against the motion as a whole,
FINEST_M = 1e-7        # steps below it are those of the servo's numbers, 15 nm
SLIP, NEAR = 6.0, 20   # a slip is so many times what the ticks near it are off, and so many steps of the encoder
BETTER = 0.8           # which has to leave clearly less
# Half widths below which no interval is stated, as parts of the value (of the delay: periods): what reversals that are a part of a
# tick off leave, which no bootstrap shows. From the emulated arms of tests/identify/study.py.
FLOORS = np.array([0.003] * 6 + [0.02] * 3 + [0.005] * 3 + [0.005] * 3 + [0.005] * 3 + [0.02])


class NoEstimate(Exception):
    """One line."""


@dataclasses.dataclass
class Motion:
    """What an arm was asked for and what it did, tick by tick. place_m, force_n: (ticks, 3); good: ticks without a fault or gap."""
    period_s: float
    place_m: np.ndarray
    force_n: np.ndarray
    good: np.ndarray


@dataclasses.dataclass
class Estimate:
    """values, low, high: by NAMES, SI units, delay in periods; NaN: not in the log. The rest: see docs/gains.md."""
    values: np.ndarray
    low: np.ndarray
    high: np.ndarray
    quantum_m: np.ndarray
    mode: object
    joint_friction: bool   # against the direction of the whole motion, in place of each axis' own
    moved: list            # axes that moved
    unexplained: float     # share of the force's rms that no parameter explains
    whiteness: np.ndarray  # p of Ljung and Box, by axis
    together: list         # (name, name, correlation) of what the log cannot tell apart
    spoilt: list           # (from_s, to_s) left out: a hand, a knock
    slips: list            # (at_s, axes, mm of the largest): jumps of the positions that no force explains
    seconds: float         # of moving axes that were used

    @property
    def mass_kg(self):
        return self.values[_AT]


def quantum_of(place):
    """The common step of an axis' positions; 0 if they have none. Of joint encoders, whose steps vary: that with their noise."""
    steps = np.abs(np.diff(place))
    steps = steps[steps > FINEST_M]
    if len(steps) < 20:
        return 0.0
    step = np.quantile(steps, 0.02)
    small = steps[steps < 20.5 * step]
    for _ in range(3):
        turns = np.maximum(np.round(small / step), 1)
        step = (small @ turns) / (turns @ turns)
    off = np.abs(small / step - np.round(small / step))
    if np.mean(off < 0.12) > 0.95:
        return float(step)
    noise = place[2:-2] - np.convolve(place, np.array([-3, 12, 17, 12, -3]) / 35, "valid")
    # At rest there is none: where each tick moves, or at least one of five does. By the mean size, as of a normal distribution.
    stepped = np.lib.stride_tricks.sliding_window_view(np.abs(np.diff(place)) > FINEST_M, 4)
    moves = stepped.all(axis=1) if np.count_nonzero(stepped.all(axis=1)) > 20 else stepped.any(axis=1)
    return float(np.sqrt(12 / (1 - 17 / 35)) * np.sqrt(np.pi / 2) * np.mean(np.abs(noise[moves])))


def _robust(values):
    return 1.4826 * np.median(np.abs(values)) if len(values) else np.inf


class _Fit:
    """The rows of a log, and the fit of all parameters to them."""

    def __init__(self, motion, axes, quantum_m, joint_friction):
        self.m, self.axes, self.joint_friction = motion, axes, joint_friction
        self.t = motion.period_s
        self.noise = np.maximum(quantum_m / np.sqrt(12), 1e-8)
        count = len(motion.place_m)
        self.scales = [Rows(max(8, round(s / self.t)), count, self.t, MOST_DELAY) for s in HALVES_S if 4 * s / self.t < count]
        self.unknown = [n for n, pair in enumerate(PAIRS) if pair[0] in axes and pair[1] in axes]
        self.unknown += [base + i for base in (_B, _F, _G, _K) for i in axes] + [_D]
        self.theta = np.zeros(_COUNT)
        self.mode = None
        self.good, self.slips = motion.good, []
        self.spoilt = np.zeros(count, bool)
        # Noise of the speed below a fiftieth of what moves, at the shortest window that has it.
        place = motion.place_m
        self.place = place - place[motion.good].mean(axis=0)  # springs and weight from there
        for self.half in (4, 6, 9, 13, 20, 30):
            self.speed = slope(place, self.half, self.t)
            self.noise_of_speed = self.noise * np.sqrt(3 / self.half**3) / self.t
            if (self.noise_of_speed[axes] < 0.02 * np.sqrt(np.mean(self.speed[:, axes]**2, axis=0))).all():
                break
        self.behind, self.around = self._directions()
        self.held = self._unmoved(12, 2.5)
        self.still = self._unmoved(5, 1.5)

    def _directions(self):
        if self.joint_friction:
            whole = np.linalg.norm(self.speed[:, self.axes], axis=1, keepdims=True)
            along = self.speed / np.maximum(whole, np.linalg.norm(self.noise_of_speed[self.axes]))
            return (along + np.concatenate([along[1:], along[-1:]])) / 2, along
        found = [directions(self.speed[:, i]) for i in range(3)]
        return np.stack([f[0] for f in found], 1), np.stack([f[1] for f in found], 1)

    def _unmoved(self, ticks, steps):
        """Samples around which an axis does not leave so many steps of its encoder."""
        views = np.lib.stride_tricks.sliding_window_view(np.pad(self.m.place_m, [(ticks, ticks), (0, 0)], mode="edge"), 2 * ticks + 1, axis=0)
        return np.ptp(views, axis=2) < steps * self.noise * np.sqrt(12)

    def resistance(self):
        """All that the force works against but the mass, over the period behind each tick."""
        th = self.theta
        return th[_B:_F] * self.speed + th[_F:_G] * self.behind + th[_G:_K] + th[_K:_D] * self.place

    def follow(self):
        """Speed, directions and sticking by the model as it is now."""
        th, i = self.theta, self.axes
        mean, way = acting_force(self.m.force_n, th[_D])
        mass = th[_AT][np.ix_(i, i)]
        def accelerations(force, share):
            total = np.zeros_like(force)
            resist = self.resistance()
            drive = force - share * resist
            drive[self.held] = 0.0
            total[:, i] = np.linalg.solve(mass, drive[:, i].T).T
            return total
        acceleration = accelerations(mean, 1.0)
        way = accelerations(way, 0.5) * self.t**2
        half = max(self.half, round(0.02 / self.t))
        swing = None
        # A mode rings as that of a free arm while the tip slides; one that sticks often clamps it.
        if self.mode is not None and self.held[:, i].mean() < 0.1:
            swing = modal(self.mode.ratio * acceleration, 2 * np.pi * self.mode.hz, self.mode.damping_ratio, self.t)
        self.speed = model_speed(self.m.place_m, acceleration, way, half, self.t, swing)
        self.noise_of_speed = self.noise * np.sqrt(3 / half**3) / self.t
        self.behind, self.around = self._directions()
        drive = mean - th[_G:_K] - th[_K:_D] * self.place
        for a in i:
            for b in i:
                if a != b:
                    drive[:, a] -= th[_AT[a, b]] * acceleration[:, b]
        # At a reversal under less than the friction the tip stays; static friction may be a quarter more.
        slow = np.abs(self.speed) < np.maximum(4 * self.noise_of_speed, np.abs(acceleration) * self.t)
        held = (slow | self.still) & (np.abs(drive) < 1.25 * th[_F:_G])
        if self.joint_friction:
            free = np.linalg.norm(drive[:, i], axis=1) > 1.25 * np.linalg.norm(th[_F:_G][i]) / np.sqrt(len(i))
            held = np.repeat(((slow | self.still)[:, i].all(axis=1) & ~free)[:, None], 3, axis=1)
        reach = 3
        wide = held.copy()
        for by in range(1, reach + 1):
            wide[by:] |= held[:-by]
            wide[:-by] |= held[by:]
        self.held = wide

    def rows(self, delay):
        """By scale: acceleration, speed, its instrument, direction, place, force, its change by the delay, usable; all (rows, 3)."""
        left, right = (None, None) if self.mode is None else (self.mode.left, self.mode.right)
        out = []
        for scale in self.scales:
            lost = scale.touches(~self.good, before=True) | scale.touches(self.spoilt, before=True)
            usable = np.stack([~(lost | scale.touches(self.held[:, i])) for i in range(3)], 1)
            out.append((scale.of(self.m.place_m, 2, left), scale.of(self.m.place_m, 1, right), scale.of(self.speed, 0, right),
                        scale.of(self.around, 0, right), scale.of(self.place, 0, right),
                        scale.of_force(self.m.force_n, delay, right),
                        scale.of_force(self.m.force_n, delay, right, by_delay=True), usable))
        return out

    def _design(self, part, i):
        acceleration, speed, smooth, direction, place, force, by_delay, usable = part
        x = np.zeros((len(force), _COUNT))
        for j in self.axes:
            x[:, _AT[i, j]] += acceleration[:, j]
        x[:, _B + i], x[:, _F + i], x[:, _G + i], x[:, _K + i] = speed[:, i], direction[:, i], 1.0, place[:, i]
        x[:, _D] = -by_delay[:, i]
        return x

    def _instruments(self, part, i, x):
        th = self.theta
        acceleration, speed, smooth, direction, place, force, by_delay, usable = part
        z = x.copy()
        mass = th[_AT][np.ix_(self.axes, self.axes)]
        if np.all(np.linalg.eigvalsh(mass) > 0):
            net = force - th[_B:_F] * smooth - th[_F:_G] * direction - th[_G:_K] - th[_K:_D] * place
            modelled = np.linalg.solve(mass, net[:, self.axes].T).T
            for n, j in enumerate(self.axes):
                z[:, _AT[i, j]] = modelled[:, n]
        z[:, _B + i] = smooth[:, i]
        return z

    def residuals(self, parts):
        """(rows, 3) by scale, N."""
        out = []
        for part in parts:
            r = np.full(part[5].shape, np.nan)
            for i in self.axes:
                th = self.theta.copy()
                th[_D] = 0.0
                r[:, i] = part[5][:, i] - self._design(part, i) @ th
            out.append(r)
        return out

    def normal(self, parts, with_instruments, blocks=False, only=None):
        """Sums of Z' W X and Z' W y, y the residual; by block of time if asked."""
        residuals = self.residuals(parts)
        count = int(np.ceil(len(self.m.place_m) * self.t / BLOCK_S)) if blocks else 1
        chosen = range(len(parts)) if only is None else only
        a, c, info = np.zeros((count, _COUNT, _COUNT)), np.zeros((count, _COUNT)), np.zeros((count, _COUNT, _COUNT))
        for scale, part, r in [(self.scales[n], parts[n], residuals[n]) for n in chosen]:
            for i in self.axes:
                use = part[7][:, i]
                if use.sum() < 8:
                    continue
                usual = _robust(r[use, i])
                kept = max(TRIMMED * usual, np.quantile(np.abs(r[use, i]), 0.93))
                use = use & (np.abs(r[:, i]) <= kept)
                weight = 1 / np.mean(r[use, i]**2)
                x = self._design(part, i)[use]
                z = self._instruments(part, i, x_all := self._design(part, i))[use] if with_instruments else x
                block = (scale.centre[use] * self.t / BLOCK_S).astype(int) if blocks else np.zeros(use.sum(), int)
                for b in np.unique(block):
                    at = block == b
                    a[b] += weight * z[at].T @ x[at]
                    info[b] += weight * x[at].T @ x[at]
                    c[b] += weight * z[at].T @ r[use, i][at]
        return a, c, info

    def step(self, with_instruments=True):
        """One fit of all parameters around the present ones. Returns how far the delay went."""
        a, c, _ = self.normal(self.rows(self.theta[_D]), with_instruments)
        u = self.unknown
        change = _solve(a[0][np.ix_(u, u)], c[0][u])
        change[-1] = np.clip(change[-1], -0.5, 0.5)
        self.theta[u] += change
        self.theta[_D] = np.clip(self.theta[_D], 0.0, MOST_DELAY - 1)
        return abs(change[-1])

    def scan_delay(self):
        """The delay whose rows fit best, from a quarter of a period to the next: the profile of the likelihood."""
        best = (np.inf, 0.0, None)
        for delay in np.arange(0.0, MOST_DELAY - 1, 0.25):
            self.theta[:] = 0.0
            self.theta[_D] = delay
            parts = self.rows(delay)
            known = [n for n in self.unknown if n != _D]
            a, c = np.zeros((_COUNT, _COUNT)), np.zeros(_COUNT)
            for part in parts:
                for i in self.axes:
                    use = part[7][:, i]
                    x = self._design(part, i)[use]
                    y = part[5][use, i]
                    w = 1 / max(np.mean(y**2), 1e-12) if len(y) else 0.0
                    a += w * x.T @ x
                    c += w * x.T @ y
            self.theta[known] = _solve(a[np.ix_(known, known)], c[known])
            cost = 0.0
            for part, r in zip(parts, self.residuals(parts)):
                for i in self.axes:
                    use = part[7][:, i]
                    if use.sum() > 8:
                        cost += use.sum() * np.log(np.mean(r[use, i]**2))
            if cost < best[0]:
                best = (cost, delay, self.theta.copy())
        self.theta = best[2]


def _solve(a, c):
    """a x = c, each parameter in its own size; what the rows say nothing about stays as it is."""
    size = np.sqrt(np.maximum(np.abs(np.diag(a)), 1e-300))
    return np.linalg.lstsq(a / np.outer(size, size), c / size, rcond=1e-12)[0] / size


def _ljung_box(series, lags=10):
    """p that a white series has such correlations (Ljung and Box 1978)."""
    series = series - series.mean()
    n, power = len(series), series @ series
    if n < 4 * lags or power == 0:
        return np.nan
    r = np.array([series[k:] @ series[:-k] for k in range(1, lags + 1)]) / power
    q = n * (n + 2) * np.sum(r**2 / (n - np.arange(1, lags + 1)))
    # Chi-squared, `lags` (even) degrees: exact sum.
    terms = np.cumprod([1.0] + [q / 2 / k for k in range(1, lags // 2)])
    return float(np.exp(-q / 2) * terms.sum())


def _fitted(motion, axes, quantum_m, joint_friction):
    """Share of the force that is left, and the fit.

    The steps of an arm that sticks most of the time need not come closer: the best of the last rounds counts, but only if none of
    them, nor the directions that follow from the best, leave SPOILT of the force. Otherwise the next step leads away from it, and
    rounding errors decide how good it was: arm 28 of tests/identify/study.py, with forces that differ by 1e-12, ends with between 3 %
    and all of the force. Arms that are identified leave at most 18 % in each round."""
    fit = _Fit(motion, axes, quantum_m, joint_friction)
    fit.scan_delay()
    left = lambda: _checks(fit, fit.rows(fit.theta[_D]))[0]
    best, worst = (np.inf, fit.theta), 0.0
    for round_ in range(10):
        if round_ == 4:
            fit.mode = modes.find(motion, fit)
        fit.follow()
        fit.step(with_instruments=round_ >= 2)
        if round_ == 7:
            _leave_out_slips(fit)
            _leave_out_spoilt(fit)
        if round_ >= 7:
            share = left()
            worst = max(worst, share)
            if share < best[0]:
                best = share, fit.theta.copy()
    fit.theta = best[1]
    fit.follow()
    worst = max(worst, left())
    return best[0] if worst < SPOILT else worst, fit


def estimate(motion, seed=1):
    """Raises NoEstimate."""
    try:
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # of a fit that does not settle
            return _estimate(motion, seed)
    except np.linalg.LinAlgError:
        raise NoEstimate(f"the motion of these {motion.good.sum() * motion.period_s:.1f} s does not determine mass, friction and delay of all axes "
                         "that moved; record more of it") from None


def _estimate(motion, seed):
    place = motion.place_m
    count = len(place)
    if motion.good.sum() * motion.period_s < 2.0:
        raise NoEstimate(f"{motion.good.sum() * motion.period_s:.4g} s of sound ticks; at least 2 s of motion are needed")
    quantum_m = np.array([quantum_of(place[:, i]) for i in range(3)])
    travel = np.ptp(place[motion.good], axis=0)
    axes = [i for i in range(3) if travel[i] > 20 * max(quantum_m[i], 1e-6)]
    if not axes:
        raise NoEstimate("no axis moved by 20 steps of its encoder: the device is held, its motors are off, or its friction is above the force")
    share, fit = _fitted(motion, axes, quantum_m, False)
    if share > POOR and len(axes) > 1:
        other, joint = _fitted(motion, axes, quantum_m, True)
        if other < BETTER * share:
            share, fit = other, joint
    found = _with_intervals(fit, quantum_m, seed)  # first, because it tells a motion that is too short
    if not share < SPOILT:
        raise NoEstimate(f"mass, friction and delay explain less than {1 - SPOILT:.0%} of the force: friction may take most of it (a higher limit "
                         "helps), something else moves the device, or it is no arm of this model")
    if not np.all(np.linalg.eigvalsh(fit.theta[_AT][np.ix_(axes, axes)]) > 0):
        raise NoEstimate("the mass comes out negative: the force of the log has the other sign, its axes are not those of the positions, or it "
                         "is not all of the force")
    return found


def _leave_out_slips(fit):
    """Steps from one tick to the next that speed does not explain: a count that was lost, a joint that slipped. What the model gets
    wrong, as a reversal, a mode or a knock, goes on for some ticks: so a slip is SLIP times all of its neighbours, and steps of
    the encoder as well."""
    place, way = fit.m.place_m, fit.speed * fit.t
    off = np.diff(place, axis=0) - (way[:-1] + way[1:]) / 2
    near = np.abs(off)
    around = np.zeros_like(near)
    for by in range(1, NEAR + 1):
        around[by:] = np.maximum(around[by:], near[:-by])
        around[:-by] = np.maximum(around[:-by], near[by:])
    steps = fit.noise * np.sqrt(12)
    found = (near > SLIP * np.maximum(around, steps)) & (fit.good[:-1] & fit.good[1:])[:, None]
    found[:, [i for i in range(3) if i not in fit.axes]] = False
    at = np.flatnonzero(found.any(axis=1))
    if len(at):
        fit.good = fit.good.copy()
        fit.good[np.concatenate([at, at + 1])] = False
    fit.slips = [(n * fit.t, [AXES[i] for i in np.flatnonzero(found[n])], 1e3 * near[n][found[n]].max()) for n in at]


def _leave_out_spoilt(fit):
    """Blocks in which much of the force has no explanation, by the second width."""
    parts = fit.rows(fit.theta[_D])
    n = min(1, len(parts) - 1)
    part, r = parts[n], fit.residuals(parts)[n]
    ticks = int(round(BLOCK_S / fit.t))
    count = int(np.ceil(len(fit.m.place_m) / ticks))
    usual = sum(np.mean(part[5][part[7][:, i], i]**2) for i in fit.axes if part[7][:, i].any())
    spoilt = np.zeros(count, bool)
    for i in fit.axes:
        use = part[7][:, i]
        block = fit.scales[n].centre[use] // ticks
        rows = np.bincount(block, minlength=count)
        bad = np.bincount(block, r[use, i]**2, count) > SPOILT**2 * usual * np.maximum(rows, 1)
        spoilt |= bad & (rows >= 3)
    # A hand is there for a while; what goes on all the time is the model's.
    if spoilt.mean() < 0.3:
        fit.spoilt = np.repeat(spoilt, ticks)[:len(fit.spoilt)]


def _spans(bad, period_s):
    edges = np.flatnonzero(np.diff(np.concatenate([[0], bad.astype(int), [0]])))
    return [(a * period_s, b * period_s) for a, b in zip(edges[::2], edges[1::2])]


def _with_intervals(fit, quantum_m, seed):
    parts = fit.rows(fit.theta[_D])
    a, c, info = fit.normal(parts, True, blocks=True)
    u = fit.unknown
    used = [b for b in range(len(a)) if np.any(a[b])]
    a, c = a[used][:, u][:, :, u], c[used][:, u]
    size = np.sqrt(np.abs(np.diag(a.sum(0))))
    a, c = a / size / size[:, None], c / size
    random = np.random.Generator(np.random.PCG64(seed))
    picks = random.multinomial(len(used), np.full(len(used), 1 / len(used)), REPLICATES)
    moved = np.linalg.solve(np.tensordot(picks, a, 1), (picks @ c)[..., None])[..., 0] / size
    moved = moved + _between_widths(fit, parts, u, random, len(moved))
    values, low, high = np.full(_COUNT, np.nan), np.full(_COUNT, np.nan), np.full(_COUNT, np.nan)
    values[u] = fit.theta[u]
    # By the percentiles' distance to both sides.
    low[u] = fit.theta[u] - np.quantile(moved, 0.975, axis=0)
    high[u] = fit.theta[u] - np.quantile(moved, 0.025, axis=0)
    size = np.abs(fit.theta)
    for n, (i, j) in enumerate(PAIRS):
        size[n] = np.sqrt(abs(fit.theta[_AT[i, i]] * fit.theta[_AT[j, j]]))
    size[_D] = 1.0
    floor = (FLOORS * size)[u]
    low[u], high[u] = np.minimum(low[u], fit.theta[u] - floor), np.maximum(high[u], fit.theta[u] + floor)
    spread = moved.std(axis=0)
    correlation = np.corrcoef((moved / np.where(spread > 0, spread, 1)).T)
    together = [(NAMES[u[m]], NAMES[u[n]], float(correlation[m, n])) for m in range(len(u)) for n in range(m)
                if abs(correlation[m, n]) > 0.95]
    share, white = _checks(fit, parts)
    return Estimate(values, low, high, quantum_m, fit.mode, fit.joint_friction, [AXES[i] for i in fit.axes], share, white, together,
                    _spans(fit.spoilt, fit.t), fit.slips, float(fit.good.sum() * fit.t))


def _between_widths(fit, parts, u, random, replicates):
    """What the fits to short and to long bumps alone differ by beyond their own spread: an error of the model, which no bootstrap of a
    width shows. As random shifts of that size (the between-group variance of DerSimonian and Laird 1986, two groups)."""
    if len(parts) < 4:
        return 0.0
    found = []
    for only in ((0, 1), (2, 3)):
        a, c, _ = fit.normal(parts, True, blocks=True, only=only)
        used = [b for b in range(len(a)) if np.any(a[b])]
        a, c = a[used][:, u][:, :, u], c[used][:, u]
        whole = a.sum(0)
        if len(used) < 8 or not np.isfinite(np.linalg.cond(whole)):
            return 0.0
        picks = random.multinomial(len(used), np.full(len(used), 1 / len(used)), 100)
        shift = _solve(whole, c.sum(0))
        spread = np.array([_solve(whole, d) for d in picks @ c]).std(axis=0)
        found.append((shift, spread))
    (one, of_one), (two, of_two) = found
    between = np.maximum(0.0, (one - two)**2 - of_one**2 - of_two**2) / 2
    return np.sqrt(between) * random.normal(size=(replicates, len(u)))


def _checks(fit, parts):
    """Share of the force that stays unexplained, and whiteness of rows that do not overlap, at the second width."""
    n = min(1, len(parts) - 1)
    part, r = parts[n], fit.residuals(parts)[n]
    white = np.full(3, np.nan)
    squares = total = 0.0
    for i in fit.axes:
        use = part[7][:, i]
        squares += np.sum(r[use, i]**2)
        total += np.sum(part[5][use, i]**2)
        apart = r[::4, i][use[::4]]
        white[i] = _ljung_box(apart)
    return float(np.sqrt(squares / total)) if total else np.nan, white
