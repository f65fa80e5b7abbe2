# SPDX-License-Identifier: Apache-2.0
"""independent_test.py ROOT BIN: figures of `import kerf` against computations in NumPy that share nothing with it: boundaries of six
devices by the eigenvalues of the closed loop, one run of a wall step by step.

PYTHONPATH=build/python/python. Exit code 77: skipped, for want of NumPy."""
import sys
import unittest

try:
    import numpy as np
except ImportError as lack:
    print(f"skipped: {lack}; apt-get install python3-numpy")
    sys.exit(77)
import kerf


class Mass:
    """x'' = (1000 / m) (F - b x') in mm, s, N, kg, exact over one period of held force: (x, v) -> free (x, v) + driven F."""

    def __init__(self, loop):
        rate = 1000 * loop.viscous_ns_per_mm / loop.mass_kg
        decay = np.exp(-rate * loop.period_s)
        self.free = np.array([[1, (1 - decay) / rate], [0, decay]])
        self.driven = np.array([loop.period_s - (1 - decay) / rate, 1 - decay]) / loop.viscous_ns_per_mm


def boundary(loop, damping):
    """The lowest K that is not stable: F[k] = -K x[k] - B (x[k] - x[k-1]) / T acts `delay` periods later."""
    mass, delay = Mass(loop), round(loop.delay_s / loop.period_s)

    def stable(stiffness):
        step = np.zeros((3 + delay, 3 + delay))  # of x, v, the x before, the forces on their way
        step[:2, :2], step[:2, 2 + delay], step[2, 0] = mass.free, mass.driven, 1
        step[3, 0], step[3, 2] = -stiffness - damping / loop.period_s, damping / loop.period_s
        for i in range(1, delay):
            step[3 + i, 2 + i] = 1
        return np.abs(np.linalg.eigvals(step)).max() < 1

    high = 0.01
    while stable(high):
        high *= 1.01
    low = high / 1.01
    for _ in range(50):
        middle = (low + high) / 2
        low, high = (middle, high) if stable(middle) else (low, middle)
    return low


class TestIndependent(unittest.TestCase):
    def test_boundaries_are_those_of_the_eigenvalues(self):
        for device in ("omni", "falcon", "woodenhaptics", "inverse3", "touch", "omega"):
            for loop in (kerf.map_loop(device), kerf.device_loop(device)):
                for damping in (0.0, 0.002, 0.004):
                    found = kerf.highest_stiffness(loop, damping)
                    self.assertLess(abs(found / boundary(loop, damping) - 1), 1e-6, (device, damping))

    def test_a_run_without_friction_and_steps_is_that_of_the_formulas(self):
        stiffness, damping, push_n = 1.0, 0.004, 0.5
        loop = kerf.map_loop("falcon")
        loop.coulomb_n = loop.quantum_mm = 0
        run = kerf.cell(stiffness, damping, loop=loop, law="two_sided", estimator="difference", numeric="double", limits=False,
                        push_n=push_n, hit_mm_per_s=50, seconds=1, seed=0)
        mass, moves = Mass(loop), np.array([0.1, -50.0])
        before_mm, waiting_n, rows = moves[0], 0.0, []
        for _ in run.trajectory:
            acting_n = waiting_n - push_n
            waiting_n = -stiffness * moves[0] - damping * (moves[0] - before_mm) / loop.period_s
            before_mm = moves[0]
            moves = mass.free @ moves + mass.driven * acting_n
            rows.append(moves)
        self.assertEqual(len(rows), 1000)
        self.assertLess(np.abs(np.array(rows) - run.trajectory).max(), 1e-9)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
