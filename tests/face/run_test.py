# SPDX-License-Identifier: Apache-2.0
"""A run by include/kerf alone is the run of the programs: each row of both logs is equal to the last bit, for a device of each kind, for two
arms, and with a removal. Other programs find the recording sound, and replay it.

    run_test.py ROOT BIN FACE_RUN"""
import os
import pathlib
import subprocess
import sys
import tempfile
import time
import unittest

ROOT, BIN, FACE_RUN = (pathlib.Path(sys.argv.pop(1)).resolve() for _ in range(3))
HEADER, ROW = 4096, 496
HANDS = ROOT / "scenes/hands"


def rows_of(log, name="ticks.npy"):
    data = (log / name).read_bytes()[HEADER:]
    return [data[at:at + ROW] for at in range(0, len(data) - ROW + 1, ROW)]


def run(*words):
    done = subprocess.run(list(map(str, words)), capture_output=True, text=True, timeout=600, check=False)
    if done.returncode or done.stderr:
        raise AssertionError(f"{words}: {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def run_programs(folder, scene, hands, devices, seconds):
    """The run of ./kerf demo --virtual, without its pictures. The log is `folder`/log."""
    scales = ",".join(run(BIN / "kerf-emulator", "--describe", "--personality", device).strip().removeprefix("torque_scale=") for device in devices)
    os.mkfifo(folder / "lead")
    quiet = {"stdout": subprocess.DEVNULL}
    ports = [word for number in range(len(hands)) for word in ("--port", f"socket:{folder}/device-{number}")]
    device = ["--device", devices[0]] if len(devices) == 1 else []
    controller = subprocess.Popen([BIN / "kerf-controller", "--scene", scene, *device, "--virtual", "--until", folder / "lead", "--name", "face-run",
                                   "--seconds", str(seconds), "--torque-scale", scales, "--emulator-args", folder / "facts", *ports], **quiet)
    while not (folder / "facts").exists() and controller.poll() is None:
        time.sleep(0.01)
    facts = dict(line.split("=", 1) for line in (folder / "facts").read_text().splitlines() if "=" in line)
    others = [subprocess.Popen([BIN / "kerf-recorder", "--name", "face-run", "--out", folder / "log", "--lead", folder / "lead"], **quiet)]
    for number, (hand, name) in enumerate(zip(hands, devices)):
        unit = facts["hand_unit_mm" if number == 0 else "second_hand_unit_mm"]
        others.append(subprocess.Popen([BIN / "kerf-emulator", "--personality", name, "--lockstep", "--rate", "1000", "--socket",
                                        folder / f"device-{number}", "--hand", hand, "--unit-mm", unit], **quiet))
    for program in (controller, *others):
        if program.wait(timeout=120):
            raise AssertionError(f"{program.args}: {program.returncode}")


class TestRuns(unittest.TestCase):
    def runs(self, scene, hands, devices, ticks=2000):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            run_programs(folder, scene, hands, devices, ticks / 1000)  # after arming: some more ticks
            setting = [f'device.personality="{devices[0]}"'] if len(devices) == 1 else []
            run(FACE_RUN, scene, ",".join(map(str, hands)), folder / "face", ticks, *setting)
            for each in ("ticks.npy", "ticks-2.npy")[:len(hands)]:
                ours, theirs = rows_of(folder / "face", each), rows_of(folder / "log", each)
                self.assertEqual(len(ours), ticks)
                self.assertGreaterEqual(len(theirs), ticks)
                self.assertEqual(next((i for i in range(ticks) if ours[i] != theirs[i]), None), None, each)
            run(BIN / "kerf-record", "check", folder / "face")
            run(BIN / "kerf-replay", folder / "face")

    def test_an_omni_cuts(self):
        self.runs(ROOT / "scenes/phantom.toml", [HANDS / "cut_cavity.toml"], ["omni"])

    def test_each_other_kind_of_device(self):
        for device in ("falcon", "woodenhaptics", "inverse3", "touch", "omega"):
            with self.subTest(device=device):
                self.runs(ROOT / "scenes/touch.toml", [HANDS / "touch.toml"], [device], ticks=1500)

    def test_two_arms(self):
        self.runs(ROOT / "scenes/two_arms.toml", [HANDS / "cut_cavity.toml", HANDS / "groove.toml"], ["omni", "touch"])


if __name__ == "__main__":
    unittest.main()
