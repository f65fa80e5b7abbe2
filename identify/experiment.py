# SPDX-License-Identifier: Apache-2.0
"""What a device is asked for while it is identified: a force, and a spring to a goal, tick by tick.

Nothing is known of the device at first, from 5 g to 2 kg, from 0.02 to 1 N of friction. So friction and mass are guessed from a force
that rises until the tip moves, and set the spring; the size of each later force follows from how far the tip goes.
All arrays are (devices, 3): the tests step many at once. mm, N, s; places from where the tip was released."""
import numpy as np

WAY_MM = 8.0         # the tip shall swing so far
MOST_MM = 25.0       # and is only pulled back from here on
MOVED_MM = 1.5
RAMP_N_PER_S = 1.5
REST_S, RAMP_S, SWING_S, STEPS_S, SLOW_S, HIGH_S = 1.0, 2.5, 24.0, 8.0, 10.0, 10.0
STAGES = ("rest", "ramp x", "ramp y", "ramp z", "swing", "steps", "slow", "high")
ENDS_S = np.cumsum([REST_S, RAMP_S, RAMP_S, RAMP_S, SWING_S, STEPS_S, SLOW_S, HIGH_S])
SECONDS = float(ENDS_S[-1])
WORST_DELAY_S = 0.004
LINES = 14           # of the swing's spectrum, each axis
HIGH_HZ = (25.0, 420.0)


def _triangle(phase):
    """-1 to 1, period 1, from 0 upwards."""
    return 2 * np.abs(2 * ((phase + 0.75) % 1.0) - 1) - 1


class Experiment:
    """limit_n: of the whole force; (devices,). most_stiffness: N/mm a goal may have."""

    def __init__(self, limit_n, most_stiffness=0.4, most_damping=0.002, seed=1):
        self.limit_n = np.asarray(limit_n, float)[:, None]
        n = len(self.limit_n)
        self.n, self.most_stiffness, self.most_damping = n, most_stiffness, most_damping
        random = np.random.Generator(np.random.PCG64(seed))
        self.phases = random.uniform(0, 2 * np.pi, (3, LINES))
        self.steps = random.choice([-1.0, 1.0], (64, 3)) * random.uniform(0.5, 1.0, (64, 3))
        self.friction_n = np.full((n, 3), np.nan)      # at which the tip broke loose
        self.loose_s = np.full((n, 3), np.nan)
        self.mass_kg = np.full((n, 3), np.nan)         # a guess, within a factor of two
        self.done = np.zeros((n, 3), bool)
        self.stage = 0
        self.gain = np.zeros((n, 3))
        self.far_mm = np.zeros((n, 3))
        self.heavy = np.zeros((n, 1), bool)
        self.stiffness = np.full((n, 1), min(0.03, most_stiffness))
        self.damping = np.full((n, 1), min(0.0002, most_damping))

    def stage_at(self, seconds):
        return min(int(np.searchsorted(ENDS_S, seconds, side="right")), len(STAGES) - 1)

    def ask(self, seconds, place_mm):
        """Force, goal, stiffness, damping for this moment."""
        stage = self.stage_at(seconds)
        if stage != self.stage:
            self.stage = stage
            self._enter(stage)
        since = seconds - (ENDS_S[stage - 1] if stage else 0.0)
        goal = np.zeros((self.n, 3))
        force = np.zeros((self.n, 3))
        if stage == 0:
            return force, goal, np.zeros((self.n, 1)), np.zeros((self.n, 1))
        if stage <= 3:
            self._ramp(stage - 1, since, place_mm, force)
        elif stage == 4:
            self._swing(since, place_mm, force)
        elif stage == 5:
            goal = WAY_MM * self.steps[int(since / 0.8) % 64] * np.ones((self.n, 1))
            goal = goal + np.sign(goal) * self._known_friction() / self.stiffness
            goal = np.clip(goal, -MOST_MM, MOST_MM) * self._turn(since / STEPS_S, together=1)
        else:
            goal, force = self._sweeps(stage, since, place_mm, goal, force)
        outside = np.abs(place_mm) > MOST_MM
        force = np.where(outside, -np.sign(place_mm) * (self._known_friction() + 0.1), force)
        whole = np.linalg.norm(force, axis=1, keepdims=True)
        force = force * np.minimum(1, 0.9 * self.limit_n / np.maximum(whole, 1e-9))
        return force, goal, self.stiffness, self.damping

    def _turn(self, part, together):
        """1 for the axes whose turn it is: all at once, or so many if friction takes most of the force."""
        first = min(int(part * 3), 2)
        mine = np.array([(axis - first) % 3 < together for axis in range(3)], float)
        return np.where(self.heavy, mine, 1.0)

    def _known_friction(self):
        return np.where(np.isnan(self.friction_n), 0.2, self.friction_n)

    def _ramp(self, axis, since, place_mm, force):
        """A force that rises along one axis until the tip has moved, then lets go."""
        if since < 0.05:
            self.start_mm = place_mm[:, axis].copy()
            self.floor_mm = np.zeros(self.n)
            return
        asked = np.minimum(RAMP_N_PER_S * (since - 0.05), 0.9 * self.limit_n[:, 0])
        way = np.abs(place_mm[:, axis] - self.start_mm)
        loose = (way > 0.25) & np.isnan(self.loose_s[:, axis])
        self.loose_s[loose, axis] = since
        self.friction_n[loose, axis] = asked[loose]
        far = (way > MOVED_MM) & ~self.done[:, axis]
        # From a quarter of a millimetre to 1.5 under a force that goes on rising.
        took = np.maximum(since - self.loose_s[far, axis], 1e-3)
        self.mass_kg[far, axis] = asked[far] * took**2 / (2e-3 * (MOVED_MM - 0.25)) / 2
        self.done[far, axis] = True
        force[:, axis] = np.where(self.done[:, axis] | (since > RAMP_S - 0.7), 0.0, asked)

    def _enter(self, stage):
        if stage < 4:
            return
        if stage == 4:
            friction = self._known_friction()
            mass = np.where(np.isnan(self.mass_kg), 0.1, np.clip(self.mass_kg, 0.003, 5.0))
            stiffness = np.maximum(0.03, 1.3 * np.max(friction, axis=1) / WAY_MM)
            self.stiffness[:, 0] = np.minimum(stiffness, self.most_stiffness)
            lightest = np.min(mass, axis=1)
            self.damping[:, 0] = np.minimum(0.05 * lightest / WORST_DELAY_S / 1000, self.most_damping)
            self.mass_guess = mass
            self.guess_hz = np.sqrt(self.stiffness * 1000 / mass) / (2 * np.pi)
            low = np.clip(0.5 * self.guess_hz, 0.5, 8.0)
            high = np.clip(8 * self.guess_hz, 25.0, 60.0)
            self.lines_hz = low[..., None] * (high / low)[..., None] ** (np.arange(LINES) / (LINES - 1))
            self.lines_hz *= 1 + 0.03 * (np.arange(3)[:, None] - 1)
            self.gain = 0.8 * friction + 0.05
            # Three axes that break loose at once, with as much again to move the mass.
            self.heavy = (np.linalg.norm(friction, axis=1) > 0.3 * self.limit_n[:, 0])[:, None]
        self.far_mm[:] = 0.0

    def _swing(self, since, place_mm, force):
        angle = 2 * np.pi * self.lines_hz * since + self.phases
        wave = np.sin(angle).sum(axis=2) / np.sqrt(LINES / 2)  # rms 1
        # A second of memory; by so much a second that the size of the motion settles within a few.
        self.far_mm = np.maximum(self.far_mm * 0.998, np.abs(place_mm))
        self.gain *= np.where(self.far_mm > 1.2 * WAY_MM, 0.997, np.where(self.far_mm < 0.8 * WAY_MM, 1.001, 1.0))
        self.gain = np.clip(self.gain, 0.5 * self._known_friction(), 0.6 * self.limit_n)
        force += self.gain * wave * self._turn(since / SWING_S, together=2)

    def _sweeps(self, stage, since, place_mm, goal, force):
        """A goal that goes to and fro, at two speeds; in the last stage with a chirp on top of it, each axis in its turn."""
        slow = stage == 6 and since < SLOW_S / 2
        period = np.array([2.0, 2.6, 3.3]) * (1.0 if slow else 0.4)
        side = _triangle(since / period)
        rising = np.sign(_triangle(since / period + 1e-3) - side)
        goal = WAY_MM * side + rising * 1.1 * self._known_friction() / self.stiffness
        goal = np.clip(goal, -MOST_MM, MOST_MM)
        length = SLOW_S / 2 if stage == 6 else HIGH_S
        goal = goal * self._turn(since % length / length, together=1)
        if stage == 7:
            axis_s = HIGH_S / 3
            axis, at = min(int(since / axis_s), 2), since % axis_s
            span = np.log(HIGH_HZ[1] / HIGH_HZ[0])
            angle = 2 * np.pi * HIGH_HZ[0] * axis_s / span * (np.exp(at / axis_s * span) - 1)
            # No further than a millimetre, whatever the mass.
            hz = HIGH_HZ[0] * np.exp(at / axis_s * span)
            size = np.minimum(0.45 * self.limit_n[:, 0], self.mass_guess[:, axis] * (2 * np.pi * hz)**2 * 1e-3)
            force[:, axis] += size * np.sin(angle)
        return goal, force
