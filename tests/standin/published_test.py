# SPDX-License-Identifier: Apache-2.0
"""The stand-ins' numbers, units, axes and signs against what is published of both interfaces, by ctypes alone: positions that
the client reads itself are the measure of its velocities, angles and forces. In lock-step, so nothing depends on a clock.

    published_test.py ROOT PROGRAMS LIBRARIES

Sources. HD: the OpenHaptics reference and headers 3.0 to 3.30 (mm, mm/s, rad, N, mNm, N/mm; x right, y up, z to the user;
transform by columns; joints left +, thigh and shin up +, the shin against the base); the Touch's configuration file (3.3 N,
0.88 N, 0.5 N/mm, 0.003 N s/mm; all joints 0 is 0, -110, -35 mm; links of 133.35 mm); the data sheet's 160 x 120 x 70 mm;
SOFA's chain of the wrist; 1200 mm/s and 4 N as limits. dhd and drd: the headers of SDK 3.17 and the vendor's documentation as
forcedimension_core has it (m, m/s, N, rad; x to the user, y right, z up; watchdog in steps of 125 us; kHz); the product page of
the omega.3 (12 N)."""
import json
import math
import pathlib
import subprocess
import sys
import tempfile
import unittest

from published_client import joints_to_mm

HAND = """
unit_mm = 1.0
start_mm = [10, 5, -8]
[[step]]
move_mm = [10, 5, -8]
orientation_deg = [25, -5, 40]
seconds = 0.5
[[step]]
hold = 0.5
[[step]]
repeat = true
move_mm = [-20, 25, 12]
orientation_deg = [-30, 20, -10]
seconds = 0.4
[[step]]
move_mm = [20, -5, -18]
orientation_deg = [25, -5, 40]
seconds = 0.4
"""
FAST_HAND = """
unit_mm = 1.0
start_mm = [-50, 5, 0]
[[step]]
hold = 0.5
[[step]]
move_mm = [50, 5, 0]
seconds = 0.02
[[step]]
hold = 60
"""


def about(axis, angle):
    c, s = math.cos(angle), math.sin(angle)
    return {"x": [[1, 0, 0], [0, c, -s], [0, s, c]], "y": [[c, 0, s], [0, 1, 0], [-s, 0, c]], "z": [[c, -s, 0], [s, c, 0], [0, 0, 1]]}[axis]


def product(*matrices):
    result = matrices[0]
    for other in matrices[1:]:
        result = [[sum(result[i][k] * other[k][j] for k in range(3)) for j in range(3)] for i in range(3)]
    return result


def rotation_of(transform):
    """Sixteen numbers, column by column."""
    return [[transform[4 * column + row] for column in range(3)] for row in range(3)]


# -- The test

class Published(unittest.TestCase):
    @classmethod
    def run_program(cls, kind, *options, hand=HAND):
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            (folder / "hand.toml").write_text(hand)
            done = subprocess.run(
                ["/usr/bin/python3", "-B", ROOT / "standin", PROGRAMS, LIBRARIES, "--lockstep", "--hand", folder / "hand.toml",
                 "--report", folder / "report.json", *options, "--", "/usr/bin/python3", "-B", pathlib.Path(__file__).with_name("published_client.py"), kind,
                 folder / "out.json"], capture_output=True, text=True, check=False, timeout=300)
            if not (folder / "out.json").exists():
                raise AssertionError(done.stdout + done.stderr)
            return json.loads((folder / "out.json").read_text()), json.loads((folder / "report.json").read_text())

    def near(self, got, wanted, by):
        for a, b in zip(got, wanted, strict=True):
            self.assertLessEqual(abs(a - b), by, f"{got} and not {wanted}")


class Hd(Published):
    @classmethod
    def setUpClass(cls):
        told, cls.report = cls.run_program("hd")
        cls.frames, cls.figures = told["frames"], told["figures"]
        cls.moving = range(1500, 1990)  # the hand leads the stylus to its second place

    def test_figures_are_those_of_the_vendor(self):
        first = {name: values[0] if isinstance(values, list) and values else values for name, values in self.figures.items()}
        self.assertEqual({name: first[name] for name in ("0x2602", "0x2603", "0x2604", "0x2609", "0x2606", "0x2607", "0x2600", "0x2601")},
                         {"0x2602": 0.5, "0x2603": 3.3, "0x2604": 0.88, "0x2609": 0.003, "0x2606": 1200, "0x2607": 4,
                          "0x2600": 1000, "0x2601": 1000})
        self.assertEqual((self.figures["0x2553"], self.figures["0x2554"], self.figures["0x2555"]), (6, 3, 4))
        self.assertEqual(self.figures["0x2551"], [-80, -60, -35, 80, 60, 35])
        low, high = self.figures["0x2550"][:3], self.figures["0x2550"][3:]
        for most, least, usable in zip(high, low, (80, 60, 35)):
            self.assertGreaterEqual(min(most, -least), usable)
        self.assertEqual(self.figures["errors"], [])

    def test_it_begins_in_the_inkwell_with_all_joints_at_zero(self):
        self.near(self.frames[0]["position"], [0, -110, -35], 0.055)
        self.near(self.frames[0]["joints"], [0, 0, 0], 1e-3)

    def test_the_hand_is_where_it_leads_the_stylus_in_mm(self):
        self.near(self.frames[1200]["position"], [10, 5, -8], 0.2)
        xs, ys, zs = ([self.frames[at]["position"][axis] for at in self.moving] for axis in range(3))
        self.near([min(xs), max(ys), max(zs)], [-20, 25, 12], 0.5)

    def test_velocity_is_mm_per_s(self):
        fastest = 0
        for at in self.moving:
            now, before = self.frames[at]["position"], self.frames[at - 10]["position"]
            self.near(self.frames[at]["velocity"], [(a - b) / 0.010 for a, b in zip(now, before)], 1e-6)
            fastest = max(fastest, max(map(abs, self.frames[at]["velocity"])))
        self.assertGreater(fastest, 80)

    def test_last_values_are_those_of_the_frame_before(self):
        for at in self.moving:
            before, now = self.frames[at - 1], self.frames[at]
            for name in ("position", "velocity", "joints"):
                self.assertEqual(now["last_" + name], before[name])

    def test_joint_angles_lead_to_the_position(self):
        for at in self.moving:
            self.near(joints_to_mm(self.frames[at]["joints"]), self.frames[at]["position"], 1e-6)

    def test_the_transform_is_the_chain_of_the_wrist_at_the_position(self):
        for at in self.moving:
            frame = self.frames[at]
            j, transform = frame["joints"], frame["transform"]
            for scale, told in ((1, transform), (0.5, frame["scaled"])):  # as it is, and by hdScaleGimbalAngles
                g = [scale * angle for angle in frame["gimbal"]]
                chain = product(about("y", -j[0]), about("x", -j[2]), about("y", g[0]), about("x", -g[1]), about("z", -g[2]))
                self.near(sum(rotation_of(told), []), sum(chain, []), 1e-9)
            self.assertEqual([transform[3], transform[7], transform[11], transform[15]], [0, 0, 0, 1])
            self.assertEqual(transform[12:15], frame["position"])

    def test_the_hand_turns_the_stylus(self):
        """Yaw right, the handle towards the user, roll; the handle is z of the transform."""
        yaw, pitch, roll = (math.radians(angle) for angle in (25, -5, 40))
        tool = product(about("y", -yaw), about("x", pitch), about("y", roll))
        held = rotation_of(self.frames[1200]["transform"])
        self.near(sum(held, []), sum(product(tool, about("x", -math.pi / 2)), []), 1e-4)

    def test_angular_velocity_is_rad_per_s_about_the_axes_of_the_device(self):
        fastest = 0
        for at in self.moving:
            now, before = (rotation_of(self.frames[i]["transform"]) for i in (at, at - 10))
            turn = product(now, [list(column) for column in zip(*before)])
            axis = [turn[2][1] - turn[1][2], turn[0][2] - turn[2][0], turn[1][0] - turn[0][1]]
            length = math.hypot(*axis) or 1  # twice the sine of the angle
            speed = math.asin(length / 2) / 0.010
            self.near(self.frames[at]["turning"], [part / length * speed for part in axis], 0.01 + 0.001 * speed)
            fastest = max(fastest, speed)
        self.assertGreater(fastest, 2)

    def test_no_more_than_3_3_newtons_and_an_error_that_says_so(self):
        told = [error for frame in self.frames[2000:2101] for error in frame["errors"]]
        self.assertIn(0x201, told)
        self.assertEqual(self.report["force"]["peak_n"], 5)  # as the program asked
        self.assertLess(abs(self.report["force"]["given_peak_n"] - 3.3), 0.002)

    def test_joint_torques_are_mnm_and_give_the_force_that_does_their_work(self):
        for at in range(2201, 2300):
            self.near(self.frames[at]["last_force"], [0.5, -0.3, 0.2], 1e-5)

    def test_the_velocity_limit_is_mm_per_s(self):
        """50 mm/s is less than the hand does, 10 m/s more."""
        def errors(first, last):
            return [error for frame in self.frames[first:last] for error in frame["errors"]]
        self.assertIn(0x203, errors(2401, 2500))
        for at in range(2402, 2500):
            fast = math.hypot(*self.frames[at]["velocity"]) > 50
            self.assertEqual(0x203 in self.frames[at]["errors"], fast, at)
        self.assertEqual(errors(2501, 2600), [])


class Dhd(Published):
    @classmethod
    def setUpClass(cls):
        cls.told, cls.report = cls.run_program("dhd", "--device", "omega")
        cls.frames = cls.told["frames"]

    def test_axes_and_metres(self):
        """Where the hand leads it: kerf's x, y, z in mm are dhd's y, z, x."""
        self.near(self.frames[1000]["position"], [-0.008, 0.010, 0.005], 2e-4)
        x, y, z = ([frame["position"][axis] for frame in self.frames[1400:]] for axis in (1, 2, 0))
        self.near([min(x), max(y), max(z)], [-0.020, 0.025, 0.012], 5e-4)

    def test_velocity_is_m_per_s_over_20_ms(self):
        fastest = 0
        for at in range(1400, 1990):
            now, before = self.frames[at]["position"], self.frames[at - 20]["position"]
            self.near(self.frames[at]["velocity"], [(a - b) / 0.020 for a, b in zip(now, before)], 1e-9)
            fastest = max(fastest, max(map(abs, self.frames[at]["velocity"])))
        self.assertGreater(fastest, 0.08)
        self.assertLess(fastest, 0.5)

    def test_12_newtons_then_saturated(self):
        code, force, _ = self.told["too strong"]
        self.assertEqual(code, 2)
        self.near(force, [0, 0, 12], 1e-9)

    def test_a_limit_of_the_program_shortens_the_force(self):
        code, force, limit = self.told["limited"]
        self.assertEqual((code, limit), (0, 2.5))
        self.near(force, [1.5, 0, 2], 1e-9)

    def test_commands_are_counted_in_khz(self):
        self.assertAlmostEqual(self.told["kHz"], 1, delta=1e-6)

    def test_degrees_and_radians(self):
        self.assertAlmostEqual(self.told["90 degrees"], math.pi / 2)
        self.assertAlmostEqual(self.told["pi/6"], 30)

    def test_the_velocity_threshold_is_m_per_s(self):
        self.assertEqual(self.told["modes below 1 m/s"], [[0, 1, 0]])  # force all the time
        told, _ = self.run_program("fast", "--device", "omega", hand=FAST_HAND)
        first = next(i for i, (_, mode, _) in enumerate(told) if mode == [0, 0, 1])
        self.assertLessEqual(max(speed for speed, _, _ in told[:first - 1]), 1)
        self.assertGreater(told[first - 1][0], 1)
        self.assertEqual(told[first][2], 2)  # by its velocity

    def test_a_watchdog_of_160_steps_is_20_ms_and_brakes(self):
        self.assertEqual(self.told["watchdog without expert mode"], [-1, 9])
        force_and_brake, passed_s = self.told["after 18 ms"]
        self.assertEqual(force_and_brake, [1, 0])
        self.assertLess(passed_s, 0.0200001)
        self.assertEqual(self.told["after 23 ms"], [[0, 1], 3])  # by the watchdog


if __name__ == "__main__":
    ROOT, PROGRAMS, LIBRARIES = (pathlib.Path(path).resolve() for path in sys.argv[1:4])
    unittest.main(argv=sys.argv[:1])
