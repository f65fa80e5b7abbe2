# SPDX-License-Identifier: Apache-2.0
"""kerf-controller and kerf-arm over kerf-emulator's service, in lock-step: each run has the same bits, by each version of the service,
and a handle's parking button arms it; kerf-arm ends with its only controller.

    lockstep_test.py PROGRAMS ROOT"""
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

PROGRAMS, ROOT = (pathlib.Path(word).resolve() for word in sys.argv[1:3])
del sys.argv[1:3]
sys.path.insert(0, str(ROOT / "tests/support"))
import lack

lack.need_network()


def run(folder, profile, *words):
    """The report of a controller's run of 2 s, and the one of the emulator."""
    mine, its = folder / "controller.json", folder / "emulator.json"
    emulator = subprocess.Popen(
        [PROGRAMS / "kerf-emulator", "--personality", "inverse3", "--front", "websocket", "--ws", "0", "--profile", profile, "--lockstep",
         "--hand", ROOT / "scenes/hands/touch.toml", "--report", its, *words], stdout=subprocess.PIPE, text=True)
    arm = None
    try:
        port = re.search(r"ws port (\d+)", emulator.stdout.readline())[1]
        name = f"inverse3-{port}"
        arm = subprocess.Popen([PROGRAMS / "kerf-arm", "--device", "inverse3", "--service", port, "--name", name,
                                *(["--handle", "40213"] if profile == "3.5" else [])], stdout=subprocess.DEVNULL)  # which has two
        done = subprocess.run(
            [PROGRAMS / "kerf-controller", "--scene", ROOT / "scenes/touch.toml", "--device", "inverse3", "--torque-scale", "1,1,1",
             "--port", f"arm:{name}", "--virtual", "--seconds", "2", "--name", name, "--report", mine],
            capture_output=True, text=True, timeout=300, check=False)
        code = arm.wait(timeout=60)  # with its only controller
        emulator.wait(timeout=60)
    finally:
        for program in filter(None, (arm, emulator)):
            program.kill()
            program.wait()
        emulator.stdout.close()
    assert code == 0
    assert done.returncode == 0, done.stderr
    return json.loads(mine.read_text()), json.loads(its.read_text())


class TestLockStep(unittest.TestCase):
    def test_the_same_bits_in_each_run_and_by_each_version(self):
        with tempfile.TemporaryDirectory() as folder:
            runs = [run(pathlib.Path(folder), profile) for profile in ("3.5-wireless", "3.5-wireless", "3.5", "3.4")]
        mine = [report for report, _ in runs]
        self.assertEqual(len({report["output_hash"] for report in mine}), 1)
        first, its = runs[0]
        self.assertEqual(first["ticks"], 2000)
        self.assertGreater(first["contact_ticks"], 100)
        self.assertEqual(first["lost_packets"], 0)
        self.assertEqual(first["faults"], [])
        # The force of the device in steps of 14 mN.
        self.assertLess(abs(its["peak_motor_force_n"] - first["peak_force_n"]), 0.02)


unittest.main()
