# SPDX-License-Identifier: Apache-2.0
"""What NumPy, by the lines of docs/log.md, and kerf_reader find in a log that was killed and in one that was split; and the programs.

    log_files_test.py ROOT BIN"""
import json
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
import warnings

import numpy as np

ROOT, BIN = (pathlib.Path(sys.argv.pop(1)).resolve() for _ in range(2))
sys.path[:0] = [str(ROOT / "tests/record"), str(ROOT / "python")]
from kerf_reader import Log
from lockstep_run import record, sealed


def all_rows(log):
    """By the lines of docs/log.md."""
    page = (ROOT / "docs/log.md").read_text(encoding="utf-8")
    lines = re.search(r"\n(    from pathlib import Path\n(?:    .*\n)+)", page).group(1)
    names = {"np": np}
    exec(re.sub("^    ", "", lines, flags=re.M).replace("DIR/log", str(log)), names)
    return names["log"]


def run(program, *words, code=0):
    done = subprocess.run([BIN / program, *words], capture_output=True, text=True)
    assert done.returncode == code, done.stderr
    return done.stdout


def rows_of_info(log):
    return int(re.search(r"^rows +(\d+)$", run("kerf-record", "info", log), re.M).group(1))


class TestLogFiles(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.folder = pathlib.Path(self.temporary.name)

    def tearDown(self):
        self.temporary.cleanup()

    def test_all_rows_of_a_killed_log(self):
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "env": os.environ | {"XDG_RUNTIME_DIR": str(self.folder)}}
        device, log = self.folder / "device", self.folder / "log"
        ticks = log / "ticks.npy"
        programs = [subprocess.Popen([BIN / "kerf-emulator", "--socket", device, "--hand", ROOT / "scenes/hands/touch.toml"], **quiet),
                    recorder := subprocess.Popen([BIN / "kerf-recorder", "--wait", "300", "--name", "killed", "--out", log], **quiet)]
        try:
            while not device.exists():
                time.sleep(0.02)
            programs.append(subprocess.Popen([BIN / "kerf-controller", "--scene", ROOT / "scenes/wall.toml", "--name", "killed", "--port",
                                              f"socket:{device}", "--torque-scale", "1,1,1"], **quiet))
            while True:  # killed between two of its headers: it stands still while the file is looked at
                recorder.send_signal(signal.SIGSTOP)
                os.waitid(os.P_PID, recorder.pid, os.WSTOPPED)
                if ticks.exists() and ticks_in(ticks) >= 500 and len(np.load(ticks, mmap_mode="r")) < ticks_in(ticks):
                    break
                recorder.send_signal(signal.SIGCONT)
                time.sleep(0.01)
            recorder.kill()
        finally:
            for program in programs:
                program.terminate()
                program.wait()
        rows = all_rows(log)
        self.assertEqual(len(rows), ticks_in(ticks))
        self.assertEqual(len(rows), rows_of_info(log))
        self.assertGreater(len(rows), len(np.load(ticks, mmap_mode="r")))
        self.assertEqual(rows["tick"].tolist(), list(range(int(rows["tick"][0]), int(rows["tick"][-1]) + 1)))
        self.assertTrue(Log(log).ticks.tobytes() == rows.tobytes())

    def test_a_log_that_grows_is_read_without_a_word(self):
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "env": os.environ | {"XDG_RUNTIME_DIR": str(self.folder)}}
        log, ports, programs = self.folder / "log", [], []
        for number, (hand, *options) in enumerate((["cut_cavity.toml"], ["groove.toml", "--personality", "touch"])):
            device = self.folder / f"device-{number}"
            ports += ["--port", f"socket:{device}"]
            programs.append(subprocess.Popen([BIN / "kerf-emulator", "--socket", device, "--hand", ROOT / "scenes/hands" / hand, *options], **quiet))
        programs.append(recorder := subprocess.Popen([BIN / "kerf-recorder", "--wait", "300", "--name", "grows", "--out", log, "--split", "1s"], **quiet))
        try:
            while not all((self.folder / f"device-{number}").exists() for number in (0, 1)):
                time.sleep(0.02)
            programs.append(subprocess.Popen([BIN / "kerf-controller", "--scene", ROOT / "scenes/two_arms.toml", "--name", "grows", *ports,
                                              "--seconds", "3", "--torque-scale", "0.05,0.05,0.05,1,1,1"], **quiet))
            while not (log / "manifest.json").exists():
                time.sleep(0.005)
            lengths = []
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                while recorder.poll() is None:
                    read = Log(log)
                    self.assertEqual(read["tick"].tolist(), read.second["tick"].tolist())
                    lengths.append(len(read))
        finally:
            for program in programs:
                program.terminate()
                program.wait()
        self.assertEqual((lengths, len(set(lengths)) > 1), (sorted(lengths), True))

    def test_a_split_log_is_read_as_one(self):
        record(ROOT, BIN, self.folder, ROOT / "scenes/touch.toml", 4, recorder=("--split", "1s"))
        log, whole = self.folder / "log", self.folder / "whole"
        parts = sorted(log.glob("ticks.npy*"))
        self.assertEqual([path.name for path in parts], ["ticks.npy", *(f"ticks.npy.{n:04}" for n in range(2, 6))])
        rows = np.concatenate([np.load(path) for path in parts])
        self.assertTrue(all_rows(log).tobytes() == rows.tobytes())
        self.assertTrue(Log(log).ticks.tobytes() == rows.tobytes())
        self.assertEqual(rows["tick"].tolist(), list(range(1, len(rows) + 1)))
        # The same rows in one file: each program finds in both the same.
        manifest = json.loads((log / "manifest.json").read_text())
        manifest.pop("parts")  # as an earlier version wrote it: it may be of any number of files
        (log / "manifest.json").write_text(sealed(manifest))
        shutil.copytree(log, whole)
        for path in whole.glob("ticks.npy.*"):
            path.unlink()
        header = parts[0].read_bytes()[:4096].replace(b"'shape': (1000,), }", b"'shape': (%d,), }" % len(rows))
        (whole / "ticks.npy").write_bytes(header + rows.tobytes())
        for words in (("info",), ("info", "--from", "990", "--until", "2010")):
            self.assertEqual(run("kerf-record", words[0], log, *words[1:]), run("kerf-record", words[0], whole, *words[1:]))
        for form in ("csv", "mcap", "hdf5"):
            split, one = (self.folder / f"{name}.{form}" for name in ("split", "one"))
            run("kerf-record", "export", log, f"--{form}", split)
            run("kerf-record", "export", whole, f"--{form}", one)
            self.assertEqual(split.read_bytes(), one.read_bytes(), form)
        self.assertIn(f"{len(rows)} ticks, each equal to the last bit", run("kerf-replay", log))
        for number in ("0004", "0005"):  # by number and not by text
            shutil.copy(log / f"ticks.npy.{number}", whole / f"ticks.npy.{'9999' if number == '0004' else '10000'}")
        shutil.copy(parts[0], whole / "ticks.npy")
        self.assertEqual(all_rows(whole).tobytes(), np.concatenate([rows[:1000], rows[3000:]]).tobytes())
        parts[2].unlink()
        done = subprocess.run([BIN / "kerf-record", "info", log], capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stderr), (1, f"kerf-record: {parts[2]}: missing, or cut in its header, and ticks.npy.0004 is there; "
                                                          "copy the recording again\n"))
        with self.assertRaisesRegex(ValueError, "ticks.npy.0003: missing, or cut in its header, and ticks.npy.0004 is there"):
            Log(log)


def ticks_in(path):
    return (path.stat().st_size - 4096) // 496


if __name__ == "__main__":
    unittest.main()
