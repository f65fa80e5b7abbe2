# SPDX-License-Identifier: Apache-2.0
"""`./kerf demo --device touch|omega|inverse3`, as a user runs it, without a window.

    demo_devices_test.py lockstep|realtime ROOT PROGRAMS

lockstep: nothing depends on the machine's speed. The Inverse3 is behind its emulated service; Touch and omega are behind a socket,
as a vendor's library keeps its own time. realtime: these two over kerf-arm and kerf's stand-ins for the vendors' libraries."""
import concurrent.futures
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

MODE, ROOT, PROGRAMS = sys.argv[1], *(str(pathlib.Path(word).resolve()) for word in sys.argv[2:4])
del sys.argv[1:4]
sys.path.insert(0, ROOT + "/tests/support")
import lack


def demo(*words):
    """The exit code of a demo, the report of its controller with the emulator's as `emulator`, and what it printed."""
    with tempfile.TemporaryDirectory() as folder:
        out = os.path.join(folder, "out")
        done = subprocess.run([ROOT + "/kerf", "demo", "--headless", "--size", "160x120", "--out", out, *words], capture_output=True,
                              text=True, timeout=600, check=False, env={**os.environ, "KERF_BIN": PROGRAMS, "LIBGL_ALWAYS_SOFTWARE": "1"})
        try:
            report = json.loads(pathlib.Path(out, "report.json").read_text())
            report["emulator"] = json.loads(pathlib.Path(out, "emulator.json").read_text())
        except OSError:
            report = {}
        frames = len(list(pathlib.Path(out).glob("frame-*.png")))
    return done.returncode, report, frames, done.stdout + done.stderr


@unittest.skipUnless(MODE == "lockstep", "in real time")
class TestLockStep(unittest.TestCase):
    def mills(self, *words):
        """Twice at once: the tooth is touched and cut, without a fault, the work of the emulated motors is that of the controller's force,
        and both runs have the same bits. A mirrored axis gives contact too, but its motors work with the hand, not against it."""
        hashes = set()
        with concurrent.futures.ThreadPoolExecutor(2) as pool:
            runs = [pool.submit(demo, "--virtual", "--seconds", "2", *words) for _ in range(2)]
        for code, report, frames, said in (run.result() for run in runs):
            self.assertEqual(code, 0, said)
            self.assertEqual((report["end"], report["ticks"], frames), ("finished", 2000, 12))
            self.assertGreater(report["contact_ticks"], 500)
            self.assertGreater(report["removed_mm3"], 0.5)
            self.assertEqual((report["fault_count"], report["lost_packets"], report["refused_packets"]), (0, 0, 0))
            its = report["emulator"]
            self.assertLess(abs(its["peak_motor_force_n"] - report["peak_force_n"]), 0.02)
            self.assertLess(abs(its["motor_work_mj"] / (1000 * report["energy_j"]) + 1), 0.15)
            hashes.add((report["output_hash"], report["volume_hash"]))
        self.assertEqual(len(hashes), 1)

    def test_touch(self):
        self.mills("--device", "touch")

    def test_omega(self):
        self.mills("--device", "omega")

    def test_inverse3_by_its_service(self):
        if not lack.has_network():
            print("skipped: " + lack.NETWORK)
            return
        self.mills("--device", "inverse3", "--port", "arm")


@unittest.skipUnless(MODE == "realtime", "in lock-step")
class TestRealTime(unittest.TestCase):
    def touches(self, device):
        """By the third try at the latest: a machine that stands still for 20 ms is a fault of the run, as it has to be."""
        for _ in range(3):
            code, report, _, said = demo("--device", device, "--scene", "touch", "--seconds", "4")
            if code == 0 and re.search(r"contact +[1-9]", said):
                break
        self.assertEqual(code, 0, said)
        self.assertGreater(report["contact_ticks"], 0)

    def test_touch_by_kerf_arm(self):
        self.touches("touch")

    def test_omega_by_kerf_arm(self):
        self.touches("omega")


unittest.main()
