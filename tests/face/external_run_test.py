# SPDX-License-Identifier: Apache-2.0
"""A program of C, of which kerf has a header alone, gives the force of a controller with an emulated device: it is rendered, held
and faded as docs/own-law.md says, whatever becomes of the program, and the log replays to the bit.

    external_run_test.py ROOT BIN CC"""
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

ROOT, BIN = (pathlib.Path(sys.argv.pop(1)).resolve() for _ in range(2))
CC = sys.argv.pop(1)
sys.path.insert(0, str(ROOT / "python"))
try:
    from kerf_reader import Log
except ImportError:
    print("skipped: no NumPy; sudo apt install python3-numpy")
    sys.exit(77)
if not shutil.which(CC):
    print("skipped: no compiler for C; sudo apt install gcc")
    sys.exit(77)

# Gives 0.5 N upwards each millisecond, or what its words say: N, turns, microseconds between them.
PUSH = r'''
#include <kerf/external.h>
int main(int count, char** words) {
  kerf_external device;
  kerf_report now = {0};
  const char* const problem = kerf_external_open(&device, "external-run");
  kerf_force force = {.force_n = {0, count > 1 ? atof(words[1]) : 0.5, 0}};
  long turns = count > 2 ? atol(words[2]) : 1000000;
  const unsigned wait_us = count > 3 ? (unsigned)atoi(words[3]) : 1000;
  if (problem) return puts(problem), 1;
  if (turns == 0) {  // gives none, and waits for the end of another one's
    while (kerf_external_read(&device, 0, &now) && now.force_n[1] != 0) usleep(1000);
    return 0;
  }
  while (turns > 0 && kerf_external_read(&device, 0, &now)) {
    if (now.tick == 0) {
      usleep(1000);
      continue;
    }
    --turns;
    kerf_external_give(&device, 0, &force);
    if (now.force_n[1] > 0.49 && now.answers > 1) puts("rendered"), fflush(stdout);
    if (wait_us > 0) usleep(wait_us);
  }
  printf("refused %llu\n", (unsigned long long)now.refused);
  kerf_external_close(&device);
  return 0;
}
'''


def text(*words):
    return subprocess.run(list(map(str, words)), capture_output=True, text=True, timeout=600, check=True).stdout


class TestExternal(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.made = tempfile.TemporaryDirectory()
        cls.push = pathlib.Path(cls.made.name) / "push"
        source = cls.push.with_suffix(".c")
        source.write_text(PUSH)
        subprocess.run([CC, "-std=c99", "-D_DEFAULT_SOURCE", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror", f"-I{ROOT}/include",
                        source, "-o", cls.push], check=True)

    @classmethod
    def tearDownClass(cls):
        cls.made.cleanup()

    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        os.environ["XDG_RUNTIME_DIR"] = str(self.folder)
        self.programs = []

    def tearDown(self):
        for program in self.programs:
            if program.poll() is None:
                program.kill()
            program.communicate()
        shutil.rmtree(self.folder)

    def start(self, *words):
        program = subprocess.Popen(list(map(str, words)), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.programs.append(program)
        return program

    def controller(self, *words, device="omni"):
        scale = text(BIN / "kerf-emulator", "--describe", "--personality", device).strip().removeprefix("torque_scale=")
        # A busy machine keeps a program waiting, too: what is asked here does not depend on how long.
        program = self.start(BIN / "kerf-controller", "--scene", ROOT / "scenes/external.toml", "--device", device, "--torque-scale", scale, "--name",
                             "external-run", "--port", f"socket:{self.folder}/device", "--set", "force.stale_ms=500", *words)
        self.start(BIN / "kerf-emulator", "--personality", device, "--socket", self.folder / "device", "--hand", ROOT / "scenes/hands/touch.toml")
        page = self.folder / "kerf/external-external-run.page"
        while not page.exists() and program.poll() is None:
            time.sleep(0.01)
        return program

    def until_rendered(self, program):
        for line in program.stdout:
            if line == "rendered\n":
                return
        self.fail("the force was never rendered")

    def recorded(self, *words):
        recorder = self.start(BIN / "kerf-recorder", "--name", "external-run", "--out", self.folder / "log", *words)
        if words:
            return recorder
        while not (self.folder / "log/ticks.npy").exists():
            self.assertIsNone(recorder.poll())
            time.sleep(0.01)
        return recorder

    @staticmethod
    def catches(program, number):
        caught = re.search(r"SigCgt:\s*(\w+)", pathlib.Path(f"/proc/{program.pid}/status").read_text())[1]
        return int(caught, 16) >> number - 1 & 1 == 1

    def ended(self, program, expected=0):
        program.send_signal(signal.SIGINT)
        out = program.communicate(timeout=60)[0]
        self.assertEqual(program.returncode, expected, out)
        return out

    def test_a_force_is_rendered_and_fades_when_the_program_is_killed_and_the_log_replays(self):
        for device in ("omni", "omega"):
            with self.subTest(device=device):
                controller, recorder = self.controller(device=device), self.recorded()
                for _ in range(2):  # killed, and the next one goes on
                    program = self.start(self.push)
                    self.until_rendered(program)
                    program.kill()
                    program.wait()
                    waits = self.start(self.push, "0", "0")
                    waits.communicate(timeout=60)
                    self.assertEqual(waits.returncode, 0)
                out = self.ended(controller)
                self.assertNotIn("refused", out)
                recorder.communicate(timeout=60)
                log = Log(self.folder / "log")
                force = log["commanded_force_n"][:, 1]
                self.assertGreater(force.max(), 0.49)
                self.assertLess(abs(log["commanded_force_n"]).max(), 0.51)
                self.assertEqual(force[-1], 0)
                self.assertFalse(log["fault"].any())
                self.assertIn("equal", text(BIN / "kerf-replay", self.folder / "log"))
                shutil.rmtree(self.folder / "log")

    def test_a_flight_recording_lacks_the_forces_before_it_and_its_replay_is_refused(self):
        controller, recorder = self.controller(), self.recorded("--flight", "1")
        program = self.start(self.push)
        self.until_rendered(program)
        while not self.catches(recorder, signal.SIGUSR1):
            self.assertIsNone(recorder.poll())
            time.sleep(0.01)
        time.sleep(1.5)  # more than the recorder keeps
        recorder.send_signal(signal.SIGUSR1)
        while not list((self.folder / "log").glob("*-signal/manifest.json")):
            self.assertIsNone(controller.poll())
            time.sleep(0.1)
        program.kill()
        self.ended(controller)
        recorder.communicate(timeout=60)
        flight, = (self.folder / "log").glob("*-signal")
        replay = subprocess.run([BIN / "kerf-replay", flight], capture_output=True, text=True, timeout=60, check=False)
        self.assertEqual((replay.returncode, replay.stdout), (2, ""), replay.stderr)
        self.assertRegex(replay.stderr, r"of the first \d+ ticks the force of the program is not in it; record the run whole")

    def test_what_is_no_force_is_refused_and_counted_and_nothing_is_rendered(self):
        controller = self.controller()
        program = self.start(self.push, "nan", "20000", "0")
        out = program.communicate(timeout=60)[0]
        self.assertNotIn("rendered", out)
        out = self.ended(controller)
        self.assertRegex(out, r"warning: (\d+) of \1 forces of the program were refused")

    def test_two_programs_and_none(self):
        controller = self.controller()
        first = self.start(self.push)
        self.until_rendered(first)
        self.assertIn("a program has it", self.start(self.push).communicate(timeout=60)[0])
        controller.kill()
        out = first.communicate(timeout=60)[0]
        self.assertEqual(first.returncode, 0, out)  # it was told that the controller has ended
        self.assertIn("its controller has ended", self.start(self.push).communicate(timeout=60)[0])

    def test_a_run_without_a_program_says_so(self):
        controller = self.controller("--seconds", "0.2")
        out = controller.communicate(timeout=60)[0]
        self.assertEqual(controller.returncode, 0, out)
        self.assertIn("no program gave a force", out)


if __name__ == "__main__":
    unittest.main()
