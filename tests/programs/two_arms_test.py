# SPDX-License-Identifier: Apache-2.0
"""`./kerf demo --scene scenes/two_arms.toml` in lock-step, as a user runs it, and its replay.

    two_arms_test.py ROOT PROGRAMS"""
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT, PROGRAMS = (str(pathlib.Path(word).resolve()) for word in sys.argv[1:3])
del sys.argv[1:3]
ENVIRONMENT = {**os.environ, "KERF_BIN": PROGRAMS, "LIBGL_ALWAYS_SOFTWARE": "1"}


def run(*words):
    return subprocess.run(words, capture_output=True, text=True, timeout=600, check=False, env=ENVIRONMENT)


def demo(out, *words, scene="two_arms"):
    done = run(ROOT + "/kerf", "demo", "--headless", "--size", "160x120", "--virtual", "--scene", scene, "--out", out, *words)
    return done.returncode, done.stdout + done.stderr


class TestTwoArms(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.out = os.path.join(cls.folder.name, "out")
        cls.code, cls.said = demo(cls.out, "--seconds", "2.5")
        cls.log = os.path.join(cls.out, "log")

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def setUp(self):
        self.assertEqual(self.code, 0, self.said)
        self.report = json.loads(pathlib.Path(self.out, "report.json").read_text())

    def test_both_touch_and_cut(self):
        report, second = self.report, self.report["second"]
        self.assertEqual((report["device"], second["device"], second["tool"]), ("omni", "touch", "flame"))
        for arm in (report, second):
            self.assertGreater(arm["contact_ticks"], 1000)
            self.assertGreater(arm["peak_force_n"], 0.2)
            self.assertEqual((arm["fault_count"], arm["lost_packets"], arm["refused_packets"]), (0, 0, 0))
            self.assertGreater(arm["energy_by_source_j"]["cutting"], 0)  # the bur's drag on that hand
        self.assertGreater(report["removed_mm3"], 1)

    def test_each_device_got_the_force_of_its_arm(self):
        for name, arm in (("emulator.json", self.report), ("emulator-2.json", self.report["second"])):
            device = json.loads(pathlib.Path(self.out, name).read_text())
            self.assertLess(abs(device["peak_motor_force_n"] - arm["peak_force_n"]), 0.02, name)
            # Of opposite sign; the Touch's steps of 55 um are a third of the little work of its light hand.
            self.assertLess(abs(device["motor_work_mj"] / (1000 * arm["energy_j"]) + 1), 0.5, name)

    def test_the_second_time_has_the_same_bits(self):
        with tempfile.TemporaryDirectory() as folder:
            out = os.path.join(folder, "out")
            code, said = demo(out, "--seconds", "2.5")
            self.assertEqual(code, 0, said)
            again = json.loads(pathlib.Path(out, "report.json").read_text())
        for arm, other in ((self.report, again), (self.report["second"], again["second"])):
            self.assertEqual(arm["output_hash"], other["output_hash"])
        self.assertEqual(self.report["volume_hash"], again["volume_hash"])

    def test_it_replays_to_the_same_bits_and_a_change_of_the_second_arm_is_found(self):
        report = os.path.join(self.folder.name, "replay.json")
        done = run(PROGRAMS + "/kerf-replay", self.log, "--report", report)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn("each equal to the last bit", done.stdout)
        replayed = json.loads(pathlib.Path(report).read_text())
        self.assertEqual(replayed["output_hash"], self.report["output_hash"])
        self.assertEqual(replayed["second_output_hash"], self.report["second"]["output_hash"])
        self.assertEqual(replayed["volume_hash"], self.report["volume_hash"])

        done = run(PROGRAMS + "/kerf-replay", self.log, "--set", "force.stiffness_n_per_mm=0.3")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

        # Without the rows of the second arm, and with another run's.
        copy = os.path.join(self.folder.name, "copy")
        shutil.copytree(self.log, copy)
        os.rename(copy + "/ticks-2.npy", copy + "/kept")
        done = run(PROGRAMS + "/kerf-replay", copy)
        self.assertEqual(done.returncode, 1, done.stdout)
        self.assertIn("ticks-2.npy", done.stderr)
        shutil.copy(copy + "/ticks.npy", copy + "/ticks-2.npy")
        done = run(PROGRAMS + "/kerf-replay", copy)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn("arm 2, ", done.stdout)

    def test_burs_that_wear_replay_to_the_same_bits_each_by_its_own_wear(self):
        scenes = pathlib.Path(self.folder.name, "scenes")
        shutil.copytree(ROOT + "/scenes", scenes, dirs_exist_ok=True)
        scene = scenes / "two_arms.toml"
        text = scene.read_text()
        tool = "[[tool]]\n"
        scene.write_text(text.replace(tool, tool + 'grit = "medium"\nwear_half_n_s = 1\n'))
        out = os.path.join(self.folder.name, "worn")
        code, said = demo(out, "--seconds", "2.5", scene=str(scene))
        self.assertEqual(code, 0, said)
        report = json.loads(pathlib.Path(out, "report.json").read_text())
        first, second = report["sharpness"], report["second"]["sharpness"]
        self.assertTrue(0.2 < first < 0.9 and 0.2 < second < 0.9 and first != second, (first, second))
        self.assertLess(report["removed_mm3"], self.report["removed_mm3"])
        self.assertEqual((self.report["sharpness"], self.report["second"]["sharpness"]), (1, 1))
        replay = os.path.join(self.folder.name, "worn.json")
        done = run(PROGRAMS + "/kerf-replay", out + "/log", "--report", replay)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        replayed = json.loads(pathlib.Path(replay).read_text())
        self.assertEqual(replayed["output_hash"], report["output_hash"])
        self.assertEqual(replayed["second_output_hash"], report["second"]["output_hash"])
        self.assertEqual(replayed["volume_hash"], report["volume_hash"])

    def test_a_cut_log_of_the_second_arm_is_reported_by_every_export_and_plot(self):
        copy = os.path.join(self.folder.name, "cut")
        shutil.copytree(self.log, copy)
        with open(copy + "/ticks-2.npy", "r+b") as file:
            file.truncate((os.path.getsize(copy + "/ticks-2.npy") + 4096) // 2)
        record = PROGRAMS + "/kerf-record"
        for words in (("export", copy, "--arm", "2", "--csv", copy + "/a.csv"), ("export", copy, "--mcap", copy + "/a.mcap"),
                      ("plot", copy, "--arm", "2", "--out", copy + "/a.svg"), ("plot", copy, "--out", copy + "/b.svg")):
            done = run(record, *words)
            self.assertEqual(done.returncode, 1, done.stdout + done.stderr)
            self.assertIn("ticks-2.npy: cut after ", done.stderr)
            self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
        manifest = pathlib.Path(copy, "manifest.json")
        manifest.write_text(manifest.read_text().replace('"end_reason": "', '"end_reason": "\\u001b[2J'))
        self.assertNotIn("\x1b", run(record, "info", self.log).stdout + run(record, "info", copy).stdout)

    def test_wrong_numbers_of_ports_are_one_line(self):
        for ports, says in (([], "--port is missing"), (["socket:a"], "1 given, and the scene has two [[device]]"),
                            (["socket:a", "socket:a"], "is that of the first device too"),
                            (["socket:a", "socket:b", "socket:c"], "3 given, and the scene has two [[device]]")):
            words = [word for port in ports for word in ("--port", port)]
            done = run(PROGRAMS + "/kerf-controller", "--scene", ROOT + "/scenes/two_arms.toml", *words, "--virtual")
            self.assertEqual((done.returncode, done.stderr.count("\n")), (2, 1), done.stderr)
            self.assertIn(says, done.stderr)
        done = run(PROGRAMS + "/kerf-controller", "--scene", ROOT + "/scenes/touch.toml", "--port", "socket:a", "--port", "socket:b")
        self.assertIn("2 given, and the scene has one [device]", done.stderr)


unittest.main()
