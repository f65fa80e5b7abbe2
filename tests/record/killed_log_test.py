# SPDX-License-Identifier: Apache-2.0
"""Logs of recorders that were killed: what belongs to them is known all the same, and what does not is named.

    killed_log_test.py ROOT BIN [TEST]"""
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest
import warnings
import zlib

ROOT, BIN = (pathlib.Path(sys.argv.pop(1)).resolve() for _ in range(2))
sys.path[:0] = [str(ROOT / "tests/record"), str(ROOT / "python")]
from lockstep_run import record, record_killed, sealed, set_clock
try:
    import kerf_reader
except ImportError:
    kerf_reader = None  # no NumPy

HEADER, ROW = 4096, 496
TOUCH, TWO = {"touch.toml": []}, {"cut_cavity.toml": [], "groove.toml": ["--personality", "touch"]}


def run(program, *arguments):
    """Exit code, standard output, standard error."""
    done = subprocess.run([BIN / program, *arguments], capture_output=True, text=True, timeout=120)
    return done.returncode, done.stdout, done.stderr


def check(log):
    return run("kerf-record", "check", log)


class TestKilledLog(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = pathlib.Path(cls.temporary.name)
        for name in ("labels", "split", "two", "whole"):
            (cls.folder / name).mkdir()
        cls.log = record_killed(ROOT, BIN, cls.folder / "labels", ROOT / "scenes/caries.toml", TOUCH)
        cls.split = record_killed(ROOT, BIN, cls.folder / "split", ROOT / "scenes/wall.toml", TOUCH, "--split", "1s", parts=3, rows=100)
        cls.two = record_killed(ROOT, BIN, cls.folder / "two", ROOT / "scenes/two_arms.toml", TWO)
        record(ROOT, BIN, cls.folder / "whole", ROOT / "scenes/wall.toml", 2.5, recorder=("--split", "1s"))
        cls.whole = cls.folder / "whole/log"

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def copy(self, of):
        copy = pathlib.Path(tempfile.mkdtemp(dir=self.folder)) / "log"
        shutil.copytree(of, copy)
        return copy

    def assert_told(self, log, words, by=("check", "info", "replay", "reader")):
        """By each of them, with exit code 1."""
        commands = {"check": ("kerf-record", "check", log), "info": ("kerf-record", "info", log), "replay": ("kerf-replay", log)}
        for name in by:
            if name == "reader":
                if kerf_reader:
                    with self.assertRaises(ValueError) as raised:
                        kerf_reader.Log(log)
                    self.assertIn(words, str(raised.exception))
                continue
            code, _, said = run(*commands[name])
            self.assertEqual(code, 1, (name, said))
            self.assertIn(words, said)

    def test_they_are_sound_to_all(self):
        for log in (self.log, self.split, self.two):
            self.assertEqual(json.loads((log / "manifest.json").read_text())["end_reason"], "running")
            self.assertEqual(check(log)[0], 0, check(log))
            for command in (("kerf-record", "info", log), ("kerf-replay", log, "--until", "300")):
                self.assertEqual(run(*command)[0], 0, run(*command))
            if kerf_reader:
                self.assertGreater(len(kerf_reader.Log(log)), 1000)

    def test_each_byte_of_a_volume_is_covered_from_its_start_on(self):
        names = [path.name for path in (self.log / "volumes").iterdir()]
        self.assertEqual(sorted("labels" in name for name in names), [False, True])
        for name in names:
            for at in (3, 4, 8, 9, 200, -1):  # what a reader of gzip skips, too
                log = self.copy(self.log)
                data = bytearray((log / "volumes" / name).read_bytes())
                data[at] ^= 1
                (log / "volumes" / name).write_bytes(data)
                self.assert_told(log, f"volumes/{name}: its checksum is ", by=["check"])

    def test_the_clock_of_another_run_is_told_by_all(self):
        for log in (self.log, self.split):
            log = self.copy(log)
            shutil.copy(self.whole / "clock.npy", log / "clock.npy")
            self.assert_told(log, "clock.npy: its checksum is ")

    def test_a_recorder_may_be_killed_between_clock_and_manifest(self):
        log = self.copy(self.log)
        pairs = [(0, 10**18), (60 * 10**9, 10**18 + 60 * 10**9), (120 * 10**9, 10**18 + 120 * 10**9)]
        set_clock(log, pairs[0])
        before = (log / "manifest.json").read_text()
        for count, code in ((1, 0), (2, 0), (3, 1)):
            set_clock(log, *pairs[:count])
            (log / "manifest.json").write_text(before)
            self.assertEqual(check(log)[0], code, check(log))
            if kerf_reader and code == 0:
                kerf_reader.Log(log)
        self.assert_told(log, "clock.npy: its checksum is ")

    def test_a_last_file_of_a_log_that_is_lost_is_told_by_all(self):
        for of in (self.split, self.whole):
            log = self.copy(of)
            files = sorted(log.glob("ticks.npy.*"))
            files[-1].unlink()
            self.assert_told(log, f"{files[-1]}: missing, and the recorder had begun {len(files) + 1} files of this log; copy")

    def test_a_last_file_that_is_cut_in_its_header(self):
        for length in (0, 100, HEADER - 1):
            log = self.copy(self.split)
            *before, last = sorted(log.glob("ticks.npy*"))
            last.write_bytes(last.read_bytes()[:length])  # the recorder was killed as it began it
            self.assertEqual(check(log)[0], 0, check(log))
            if kerf_reader:
                self.assertEqual(len(kerf_reader.Log(log)), 1000 * len(before))
            log = self.copy(self.whole)
            last = log / "ticks.npy.0003"
            last.write_bytes(last.read_bytes()[:length])
            self.assert_told(log, f"{last}: cut in its header; copy")
            log = self.copy(self.whole)
            (log / "ticks.npy.0004").write_bytes(b"x" * length)
            self.assert_told(log, f"{log / 'ticks.npy.0004'}: no file of this log, which has 3; ")

    def test_files_that_no_recording_has_are_named(self):
        for of in (self.log, self.split, self.two, self.whole):
            for name in ("ticks.npy.1", "ticks.npy.0001", "ticks.npy.bak", "ticks-2.npy.2", "volumes/notes.txt", "inputs/000000000001.npy.gz",
                         *([] if of == self.two else ["ticks-2.npy", "ticks-2.npy.0002"])):
                with self.subTest(of=of.parent.name, name=name):
                    log = self.copy(of)
                    (log / name).parent.mkdir(exist_ok=True)
                    (log / name).write_bytes((log / "ticks.npy").read_bytes())
                    code, _, said = check(log)
                    self.assertEqual((code, said.count("\n")), (1, 1), said)
                    self.assertRegex(said, rf"^kerf-record: {log / name}: .*; remove it\n$")
                    if kerf_reader:  # as info it reads no such file
                        self.assertEqual((run("kerf-record", "info", log)[0], len(kerf_reader.Log(log)) > 1000), (0, True))

    def test_each_byte_of_a_header_is_compared_by_all(self):
        rows = (self.whole / "ticks.npy").read_bytes()
        for at in (0, 6, 7, 8, 9, 30, 2000, HEADER - 20, HEADER - 1):
            log = self.copy(self.whole)
            (log / "ticks.npy").write_bytes(rows[:at] + bytes([rows[at] ^ 2]) + rows[at + 1:])
            self.assert_told(log, f"{log / 'ticks.npy'}: ")


if __name__ == "__main__":
    unittest.main()
