# SPDX-License-Identifier: Apache-2.0
"""The estimator of `./kerf identify` on emulated arms whose values it never gets, and on logs that are wrong.

    identify_test.py ROOT LIBRARY          the library is arm.cpp beside it"""
import pathlib
import subprocess
import sys
import tempfile
import unittest
from unittest import mock

try:
    import numpy as np
except ImportError:
    print("skipped: python3 has no numpy")
    sys.exit(77)

ROOT, LIBRARY = sys.argv.pop(1), sys.argv.pop(1)
sys.path[:0] = [f"{ROOT}/identify", f"{ROOT}/python", str(pathlib.Path(__file__).parent)]
import arms as emulated
import boundary
import device_file
import estimate
import log_motion
import study
from experiment import SECONDS, Experiment
from kerf_reader.tick import TICK
from weak_form import Rows

LIB = emulated.library(LIBRARY)


def motion_of(places, forces, n):
    return estimate.Motion(emulated.PERIOD_S, places[:, n].copy(), forces[:, n].copy(), np.ones(len(places), bool))


class TestRows(unittest.TestCase):
    def test_rows_of_a_parabola_and_of_a_held_force_are_exact(self):
        count, t = 300, 0.001
        rows = Rows(40, count, t, 8)
        seconds = np.arange(count) * t
        self.assertLess(np.abs(rows.of(3.0 * seconds**2, 2) - 6.0).max(), 1e-6)
        self.assertLess(np.abs(rows.of(3.0 * seconds**2, 1) - 6.0 * seconds[rows.centre]).max(), 1e-9)
        force = np.random.default_rng(1).normal(size=count)
        for delay in (0.0, 1.3, 3.75):
            # A hundred points of each period, by the midpoint rule.
            fine = (np.arange(count * 100) + 0.5) / 100
            held = force[np.clip(np.floor(fine - delay).astype(int), 0, count - 1)]
            centre = rows.centre[3]
            u = (fine - centre) / 40
            bump = np.where(np.abs(u) < 1, np.clip(1 - u**2, 0, 1)**8, 0)
            self.assertAlmostEqual(rows.of_force(force, delay)[3], held @ bump / bump.sum(), places=5)
            step = 1e-5
            slope = (rows.of_force(force, delay + step) - rows.of_force(force, delay - step)) / (2 * step)
            self.assertLess(np.abs(slope - rows.of_force(force, delay, by_delay=True)).max(), 1e-6)

    def test_the_quantum_is_the_common_step(self):
        true = np.cumsum(np.random.default_rng(2).normal(size=5000)) * 3e-5
        for step in (2e-6, 5.5e-5):
            self.assertAlmostEqual(estimate.quantum_of(np.floor(true / step) * step) / step, 1.0, places=6)


class TestArms(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        # Of the study's: little friction, a mode with coarse encoders, 1.4 kg, and 16 to 32 g with 1 N of friction.
        cls.arms = emulated.draw(29, 1)[[4, 5, 6, 7]]
        experiment = Experiment(np.full(len(cls.arms), emulated.LIMIT_N))
        cls.places, cls.forces = emulated.run(LIB, cls.arms, experiment, SECONDS)

    def test_hidden_values_are_found_within_their_intervals(self):
        for n in range(3):
            arm, found = self.arms[n], estimate.estimate(motion_of(self.places, self.forces, n))
            truth = study.truth_of(arm)
            claimed = [i for i, name in enumerate(estimate.NAMES) if not name.startswith("spring")]
            inside = (found.low <= truth) & (truth <= found.high)
            self.assertGreaterEqual(np.count_nonzero(inside[claimed]), len(claimed) - 1, [n, found.low, truth, found.high])
            self.assertLess(np.abs(found.values[:3] / truth[:3] - 1).max(), 0.03)
            self.assertLess(np.abs(found.values[6:9] / truth[6:9] - 1).max(), 0.10)
            self.assertLess(np.abs(found.values[9:12] / truth[9:12] - 1).max(), 0.05)
            self.assertLess(abs(found.values[18] - truth[18]), 0.1)
            self.assertLess(np.abs(found.quantum_m / arm["quantum"] - 1).max(), 0.01)
            self.assertEqual(found.mode is not None, arm["mode"] > 0)
            if found.mode:
                self.assertLess(abs(found.mode.hz * 2 * np.pi / arm["mode"] - 1), 0.02)
            self.assertEqual((found.moved, found.spoilt, found.slips), (["x", "y", "z"], [], []))

    def test_an_arm_whose_friction_takes_the_force_is_refused(self):
        with self.assertRaisesRegex(estimate.NoEstimate, "friction may take most of it"):
            estimate.estimate(motion_of(self.places, self.forces, 3))

    def test_a_fit_that_does_not_settle_is_refused(self):
        motion = motion_of(self.places[:4000], self.forces[:4000], 0)
        # What is left after each of the last rounds, and with the directions that follow from the best: one above SPOILT is enough.
        good = [0.12, 0.10, 0.11, 0.11]
        for spoilt in (None, 0, 1, 2, 3):
            left = [0.4 if n == spoilt else share for n, share in enumerate(good)]
            with mock.patch.object(estimate, "_checks", side_effect=[(share, None) for share in left]):
                self.assertEqual(estimate._fitted(motion, [0, 1, 2], self.arms[0]["quantum"], False)[0], 0.10 if spoilt is None else 0.4)

    def test_a_force_of_the_other_sign_is_refused(self):
        motion = motion_of(self.places[:20000], -self.forces[:20000], 0)
        with self.assertRaisesRegex(estimate.NoEstimate, "^the mass comes out negative: the force of the log has the other sign"):
            estimate.estimate(motion)

    def test_a_gap_costs_a_part_of_the_log_alone(self):
        motion = motion_of(self.places, self.forces, 0)
        motion.good[20000:23000] = False
        motion.force_n[20000:23000] = 99.0
        motion.place_m[20000:23000] = 99.0
        found = estimate.estimate(motion)
        truth = study.truth_of(self.arms[0])
        self.assertLess(np.abs(found.values[:3] / truth[:3] - 1).max(), 0.03)

    def test_a_slip_is_named_with_its_time_and_costs_nothing(self):
        motion = motion_of(self.places, self.forces, 0)
        motion.place_m[30000:, 0] += 4e-4
        found = estimate.estimate(motion)
        self.assertEqual([(round(at, 3), axes) for at, axes, _ in found.slips], [(29.999, ["x"])])
        self.assertLess(abs(found.slips[0][2] - 0.4), 0.05)
        self.assertLess(np.abs(found.values[:3] / study.truth_of(self.arms[0])[:3] - 1).max(), 0.03)
        self.assertRegex("\n".join(device_file.remarks(found)), "a slip at 30.00 s: x jumped by 0.39 mm in one tick")

    def test_a_motion_that_ended_in_its_first_seconds_is_refused_in_one_line(self):
        motion = motion_of(self.places, self.forces, 0)
        with self.assertRaisesRegex(estimate.NoEstimate, "^the motion of these 3.6 s does not determine .*; record more of it$"):
            estimate.estimate(estimate.Motion(motion.period_s, motion.place_m[:3600], motion.force_n[:3600], motion.good[:3600]))

    def test_an_axis_that_is_held_is_named_and_a_device_that_is_held_has_nothing(self):
        motion = motion_of(self.places, self.forces, 0)
        motion.place_m[:, 2] = motion.place_m[0, 2]
        found = estimate.estimate(motion)
        self.assertEqual(found.moved, ["x", "y"])
        self.assertTrue(np.isnan(found.values[2]) and np.isnan(found.values[11]))
        self.assertRegex("\n".join(device_file.remarks(found)), "z did not move")
        self.assertNotIn("mass_kg", device_file.text_of(found, 0.001, "log"))
        motion.place_m[:] = motion.place_m[0]
        with self.assertRaisesRegex(estimate.NoEstimate, "no axis moved"):
            estimate.estimate(motion)


class TestFrictionOfTheWholeMotion(unittest.TestCase):
    def test_friction_against_the_motion_as_a_whole_is_told_from_that_of_each_axis(self):
        mass, viscous, coulomb, quantum, parts = 0.12, 0.8, 0.15, 1e-5, 10
        ticks, h = 20000, 0.001 / parts
        random = np.random.Generator(np.random.PCG64(3))
        hz, phases = np.geomspace(1.0, 40.0, 12), random.uniform(0, 2 * np.pi, (12, 3))
        place, speed, before = np.zeros(3), np.zeros(3), np.zeros(3)
        places, forces = np.zeros((ticks, 3)), np.zeros((ticks, 3))
        for tick in range(ticks):
            places[tick] = np.floor(place / quantum) * quantum
            forces[tick] = 0.2 * np.sin(2 * np.pi * hz[:, None] * tick * 0.001 + phases).sum(axis=0) - 30.0 * places[tick]
            for _ in range(parts):  # the force of the tick before acts
                kick = speed + h / mass * (before - viscous * speed)
                size = np.sqrt(kick @ kick)
                kick = kick * max(0.0, 1 - h * coulomb / mass / max(size, 1e-12))
                place, speed = place + h * (speed + kick) / 2, kick
            before = forces[tick]
        found = estimate.estimate(estimate.Motion(0.001, places, forces, np.ones(ticks, bool)))
        self.assertTrue(found.joint_friction)
        self.assertLess(found.unexplained, 0.05)
        self.assertLess(np.abs(found.values[:3] / mass - 1).max(), 0.03)
        self.assertLess(np.abs(found.values[6:9] / viscous - 1).max(), 0.10)
        self.assertLess(np.abs(found.values[9:12] / coulomb - 1).max(), 0.05)
        self.assertLess(abs(found.values[18] - 1), 0.1)
        self.assertRegex("\n".join(device_file.remarks(found)), "motion as a whole")


class TestHand(unittest.TestCase):
    def test_a_push_from_outside_is_noticed_and_left_out(self):
        arms = emulated.draw(5, 1)[[4]]

        def push(now, tick, sent):
            now["weight"][0] = arms["weight"][0] + (0.8 if 20000 <= tick < 21500 and tick % 300 < 150 else 0.0)

        experiment = Experiment(np.full(1, emulated.LIMIT_N))
        found = estimate.estimate(motion_of(*emulated.run(LIB, arms, experiment, SECONDS, push), 0))
        self.assertTrue(found.spoilt)
        for begin, end in found.spoilt:
            self.assertTrue(18.9 <= begin and end <= 22.6, found.spoilt)
        self.assertLess(np.abs(found.values[:3] / study.truth_of(arms[0])[:3] - 1).max(), 0.03)
        self.assertRegex("\n".join(device_file.remarks(found)), "something else moved the tip")


class TestLog(unittest.TestCase):
    def rows(self, count=400):
        ticks = np.zeros(count, TICK)
        ticks["tick"] = np.arange(count) + 1000
        ticks["phase"] = log_motion.ACTIVE
        ticks["position_mm"] = np.arange(count)[:, None] * [1.0, 2.0, 3.0] + 5.0
        ticks["commanded_force_n"] = 0.5
        return ticks

    def test_a_late_report_is_on_the_line_of_its_neighbours_and_a_gap_is_marked(self):
        ticks = self.rows()
        ticks["stale"][50], ticks["position_mm"][50] = 1, ticks["position_mm"][49]
        ticks["stale"][100:110] = np.arange(1, 11)
        ticks = np.delete(ticks, slice(200, 230))
        motion, lines = log_motion.motion_of(ticks, 0.001, 2.0, np.array([5.0, 5.0, 5.0]))
        self.assertEqual(len(motion.place_m), 400)
        self.assertAlmostEqual(motion.place_m[50, 0], 50 / 2e3)
        self.assertEqual(list(np.flatnonzero(~motion.good)), [*range(100, 110), *range(200, 230)])
        self.assertRegex(lines[0], "40 of 400 ticks")

    def test_a_force_limit_that_acted_for_longer_than_a_step_is_named_with_its_time(self):
        ticks = self.rows()
        ticks["contact_force_n"] = ticks["commanded_force_n"]
        limits = {"force_n": 3.0, "slew_n_per_ms": 0.5}
        ticks["contact_force_n"][50:56], ticks["flags"][50:56] = 2.0, log_motion.CLAMPED  # the slew limit, for the six ticks that it may
        self.assertEqual(log_motion.motion_of(ticks, 0.001, 1.0, np.zeros(3), limits)[1], [])
        ticks["contact_force_n"][120:170], ticks["flags"][120:170] = 2.0, log_motion.CLAMPED
        ticks["contact_force_n"][150] = 4.0
        self.assertEqual(log_motion.motion_of(ticks, 0.001, 1.0, np.zeros(3), limits)[1],
                         ["a force limit acted for 0.05 s in all, the first time 0.12 s on: 6.93 N asked, 0.866 N applied; the applied force is used"])

    def test_a_fault_that_ended_it_is_named_with_its_time(self):
        ticks = self.rows()
        ticks["phase"][300:], ticks["fault"][300:] = 5, 1
        motion, lines = log_motion.motion_of(ticks, 0.001, 1.0, np.zeros(3))
        self.assertEqual(len(motion.place_m), 300)
        self.assertEqual(lines, ["the motors went off by a fault 0.30 s on: stale_input; the ticks before it are used"])
        page = (pathlib.Path(ROOT) / "docs/log.md").read_text().split("## Faults")[1]
        self.assertEqual([row.split("|")[2].strip() for row in page.splitlines() if row.startswith("|")][2:2 + len(log_motion.FAULTS)],
                         list(log_motion.FAULTS))

    def test_a_log_without_a_force_is_refused_in_one_line(self):
        ticks = self.rows()
        ticks["phase"] = 1
        with self.assertRaisesRegex(estimate.NoEstimate, "no tick with the motors on"):
            log_motion.motion_of(ticks, 0.001, 1.0, np.zeros(3))

    def test_the_command_says_in_one_line_what_is_wrong(self):
        with tempfile.TemporaryDirectory() as folder:
            for words, code, line in (([], 2, "no --scene and no --log"), (["--log", folder], 2, "ticks.npy"), (["--log", folder, "--out", "a"], 2, "is no .toml"),
                                      (["--lag", "a"], 2, "unrecognized arguments: --lag a")):
                done = subprocess.run([sys.executable, "-B", f"{ROOT}/identify", ROOT, f"{ROOT}/nowhere", *words], capture_output=True, text=True, check=False)
                self.assertEqual((done.returncode, done.stderr.count("\n"), done.stdout), (code, 1, ""), done.stderr)
                self.assertIn(line, done.stderr)


class TestBoundary(unittest.TestCase):
    def test_the_boundary_of_a_short_delay_is_that_of_diolaiti(self):
        # b + B over half a period, for a large mass and a little damping.
        self.assertAlmostEqual(boundary.highest_stiffness(5.0, 0.5, 0.0, 0.001, 0.0) / (0.5 / 0.0005), 1.0, places=1)


if __name__ == "__main__":
    unittest.main()
