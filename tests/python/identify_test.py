# SPDX-License-Identifier: Apache-2.0
"""`./kerf identify --scene`: an emulated omega is moved, recorded and identified; what ends it early keeps the recording.

    identify_test.py ROOT BIN        with PYTHONPATH=build/release/python
Exit code 77: skipped, for want of NumPy."""
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import types
import unittest

try:
    import numpy as np
except ImportError as lack:
    print(f"skipped: {lack}; apt-get install python3-numpy")
    sys.exit(77)
ROOT, BIN = (pathlib.Path(path).resolve() for path in (sys.argv.pop(1), sys.argv.pop(1)))
sys.path.insert(0, str(ROOT / "identify"))
import kerf  # noqa: E402, F401
import estimate  # noqa: E402
import guided  # noqa: E402
import log_motion  # noqa: E402

SCENE = str(ROOT / "scenes/external.toml")
SHORT_S = 16  # rest, three ramps, and half of a minute's sines
BEGINS = "a force that rises along x"


class TestGuided(unittest.TestCase):
    def setUp(self):
        home = tempfile.TemporaryDirectory()
        self.addCleanup(home.cleanup)
        self.home = pathlib.Path(home.name)
        os.environ["XDG_RUNTIME_DIR"] = home.name

    def begin(self, *words):
        """The command itself, moving."""
        process = subprocess.Popen([sys.executable, "-B", ROOT / "identify", ROOT, BIN, "--scene", "external", "--device", "omega", "--out",
                                    self.home / "omega.toml", *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        said = []
        while not said or BEGINS not in said[-1]:
            said.append(process.stdout.readline())
            self.assertTrue(said[-1], process.stderr.read() if not said[-1] else "")
        return process, said

    def children(self, process):
        return {pathlib.Path(f"/proc/{pid}/comm").read_text().strip(): int(pid)
                for pid in pathlib.Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()}

    def kept(self, process, line):
        """It ends with this one line, and has ended its programs; what was recorded can be read."""
        children = self.children(process)
        out, err = process.communicate()
        self.assertEqual((process.returncode, err.count("\n")), (1, 1), err)
        self.assertRegex(err, f"^kerf: identify: {line}; what was recorded is in {self.home}/omega.log: kerf identify --log ")
        self.assertFalse((self.home / "omega.toml").exists())
        self.assertFalse([pid for pid in children.values() if pathlib.Path(f"/proc/{pid}").exists()])
        log = kerf.Log(self.home / "omega.log")
        self.assertGreater(len(log), 100)
        self.assertEqual(log.check(), [])
        return log

    def test_a_device_that_was_identified_is_emulated_and_found_again(self):
        (self.home / "device.toml").write_text("[device]\nmass_kg = [0.12, 0.12, 0.12, 0, 0, 0]\nviscous_ns_per_mm = [0.0008, 0.0008, 0.0008]\n"
                                               "coulomb_n = [0.15, 0.15, 0.15]\nquantum_mm = [0.01, 0.01, 0.01]\ndelay_s = 0.0015\n")
        scene = self.home / "scene.toml"
        scene.write_text(pathlib.Path(SCENE).read_text().replace("[hand]\nscript = \"hands/touch.toml\"", "")
                         + "\n[device]\npersonality = \"omega\"\nidentified = \"device.toml\"\n")
        # Real time: of three tries one at least is not spoilt by what else the machine does.
        for attempt in range(3):
            options = types.SimpleNamespace(scene=str(scene), device=None, port=None, log=str(self.home / f"log{attempt}"))
            guided.record(BIN, options, SHORT_S)
            motion, lines = log_motion.read(options.log)
            self.assertEqual([line for line in lines if "fault" in line], [])
            try:
                found = estimate.estimate(motion)
                break
            except estimate.NoEstimate:
                if attempt == 2:
                    raise
        self.assertEqual(found.moved, ["x", "y", "z"])
        self.assertLess(np.abs(found.values[:3] / 0.12 - 1).max(), 0.05)
        self.assertLess(np.abs(found.values[9:12] / 0.15 - 1).max(), 0.1)
        self.assertTrue(1.3 < found.values[18] < 3, found.values[18])  # later on a busy machine

    def test_ctrl_c_keeps_what_was_recorded(self):
        process, said = self.begin()
        self.assertRegex("".join(said), "will move by itself for 60 s, by at most 2 N: free 25 mm around its tip\n.*hands off.*\n.*Ctrl-C")
        process.send_signal(signal.SIGINT)
        log = self.kept(process, r"stopped by Ctrl-C \d+\.\d s into the motion: the motors are off")
        self.assertEqual(int(log.ticks[-1]["fault"]), 0)

    def test_a_device_that_is_unplugged_ends_it(self):
        process, _ = self.begin()
        os.kill(self.children(process)["kerf-emulator"], signal.SIGKILL)
        log = self.kept(process, r"a fault, stale_input, switched the motors off \d+\.\d s into the motion")
        self.assertFalse(np.any(log.ticks[-1]["commanded_force_n"]))

    def test_a_controller_that_is_stopped_ends_it(self):
        process, _ = self.begin()
        os.kill(self.children(process)["kerf-controller"], signal.SIGTERM)
        self.kept(process, r"the controller ended \d+\.\d s into the motion, and switched the motors off")

    def test_what_is_wrong_is_one_line_before_anything_moves(self):
        (self.home / "there.log").mkdir()
        for words, line in ((["--scene", "touch"], 'force.model is "proxy", and the motion is a force of a program; give --scene external'),
                            (["--scene", "nosuch"], "nosuch: no such scene file"),
                            (["--scene", "external", "--device", "nix"], "--device"),
                            (["--scene", "external", "--log", self.home / "there.log"], "exists already; name a new folder"),
                            (["--scene", "external", "--port", "socket:nowhere"], "no device.torque_scale, so the motors stay off"),
                            (["--port", "fw"], "no --scene and no --log")):
            done = subprocess.run([sys.executable, "-B", ROOT / "identify", ROOT, BIN, *words], cwd=self.home, capture_output=True, text=True,
                                  check=False)
            self.assertEqual((done.returncode, done.stderr.count("\n"), done.stdout), (2, 1, ""), done.stderr + done.stdout)
            self.assertIn(line, done.stderr)
        self.assertEqual([path.name for path in self.home.iterdir() if path.name != "kerf"], ["there.log"])


if __name__ == "__main__":
    unittest.main()
