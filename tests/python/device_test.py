# SPDX-License-Identifier: Apache-2.0
"""`kerf.Device` against a controller and an emulated device: states come, a force is felt, the device is given back.

    device_test.py ROOT BIN        with PYTHONPATH=build/release/python"""
import math
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest

import kerf

ROOT, BIN = (pathlib.Path(path).resolve() for path in (sys.argv.pop(1), sys.argv.pop(1)))


class TestDevice(unittest.TestCase):
    def setUp(self):
        home = tempfile.TemporaryDirectory()
        self.addCleanup(home.cleanup)
        os.environ["XDG_RUNTIME_DIR"] = home.name
        socket = f"{home.name}/device"
        self.controller = self.start("kerf-controller", "--scene", ROOT / "scenes/external.toml", "--name", "python-device", "--torque-scale",
                                     "0.342,0.342,0.342", "--port", f"socket:{socket}", "--set", "force.stale_ms=500")
        self.start("kerf-emulator", "--socket", socket, "--hand", ROOT / "scenes/hands/touch.toml")
        while True:
            self.assertIsNone(self.controller.poll())
            try:
                return kerf.Device("python-device").close()
            except kerf.Error:  # not ready yet
                time.sleep(0.01)

    def start(self, name, *words):
        program = subprocess.Popen([BIN / name, *map(str, words)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.addCleanup(program.wait)
        self.addCleanup(program.kill)
        return program

    def test_a_force_is_felt_and_refused_ones_are_counted_and_the_end_is_seen(self):
        with kerf.Device("python-device") as device:
            self.assertEqual((device.arms, device.period_s, device.workspace_scale), (1, 0.001, 1))
            with self.assertRaisesRegex(kerf.Error, "a program has it"):
                kerf.Device("python-device")
            last = 0
            for state in device:
                self.assertGreater(state.tick, last)
                last = state.tick
                number = device.give(force_n=(0, 0.5, 0))
                if state.force_n[1] > 0.49 and state.phase == kerf.Phase.ACTIVE:
                    break
            self.assertEqual(state.fault, "none")
            self.assertGreater(number, 1)
            self.assertFalse(any(map(math.isnan, state.position_mm)))
            device.give(force_n=(math.nan, 0, 0))
            device.give(goal_mm=(0, 0, 0), stiffness_n_per_mm=9)
            while device.refused == 0:
                self.assertTrue(device.wait())
            self.controller.send_signal(signal.SIGINT)
            for state in device:
                pass
            self.assertFalse(device.alive)
        with self.assertRaisesRegex(kerf.Error, "it was closed"):
            device.wait()
        with self.assertRaisesRegex(kerf.Error, "no controller"):
            kerf.Device("python-device")

    def test_a_batch_of_worlds_at_its_own_rate_is_felt(self):
        example = ROOT / "examples/external/batch_loop.py"
        self.assertLessEqual(len(example.read_text().splitlines()), 40)
        done = subprocess.run([sys.executable, "-B", example, "python-device", "8"], capture_output=True, text=True, timeout=120, check=False)
        said = re.fullmatch(r"(\d+) steps, the first plate down to (-[\d.]+) mm, the others to (-?[\d.]+) mm\n", done.stdout)
        self.assertTrue(said, done.stdout + done.stderr)
        self.assertEqual(float(said[3]), 0)
        self.assertLess(float(said[2]), -0.3)

    def test_ctrl_c_ends_a_wait_for_a_controller_that_stands_still(self):
        with kerf.Device("python-device") as device:
            self.controller.send_signal(signal.SIGSTOP)
            threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT)).start()
            with self.assertRaises(KeyboardInterrupt):
                while device.wait():
                    pass
            self.controller.send_signal(signal.SIGCONT)


if __name__ == "__main__":
    unittest.main()
