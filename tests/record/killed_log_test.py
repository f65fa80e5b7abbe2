# SPDX-License-Identifier: Apache-2.0
"""Logs of recorders that were killed: what belongs to them is known all the same, and what does not is named.

    killed_log_test.py ROOT BIN [TEST]"""
import itertools
import json
import os
import pathlib
import shutil
import tempfile
import unittest
import warnings

from lockstep_run import record, record_killed, sealed, set_clock
from recordings import BIN, HEADER, ROOT, ROW, check, kerf_reader, run

TOUCH, TWO = {"touch.toml": []}, {"cut_cavity.toml": [], "groove.toml": ["--personality", "touch"]}


class TestKilledLog(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = pathlib.Path(cls.temporary.name)
        for name in ("labels", "two", "whole"):
            (cls.folder / name).mkdir()
        cls.log = record_killed(ROOT, BIN, cls.folder / "labels", ROOT / "scenes/caries.toml", TOUCH)
        for attempt in range(5):  # one whose manifest does not count rows of the last file yet: on a busy machine it may
            (folder := cls.folder / f"split-{attempt}").mkdir()
            cls.split = record_killed(ROOT, BIN, folder, ROOT / "scenes/wall.toml", TOUCH, "--split", "1s", parts=3, rows=100)
            if json.loads((cls.split / "manifest.json").read_text())["rows"] == 2000:
                break
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

    def assert_said(self, log, words, by=("check", "info", "replay", "reader")):
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
                self.assert_said(log, f"volumes/{name}: its checksum is ", by=["check"])

    def test_the_clock_of_another_run_is_reported_by_all(self):
        for log in (self.log, self.split):
            log = self.copy(log)
            shutil.copy(self.whole / "clock.npy", log / "clock.npy")
            self.assert_said(log, "clock.npy: its checksum is ")

    def test_logs_of_two_arms_that_are_exchanged_are_reported_by_all(self):
        folder = pathlib.Path(tempfile.mkdtemp(dir=self.folder))
        log = record_killed(ROOT, BIN, folder, ROOT / "scenes/two_arms.toml", TWO, synced=True)
        (log / "ticks.npy").rename(log / "one.npy")
        (log / "ticks-2.npy").rename(log / "ticks.npy")
        (log / "one.npy").rename(log / "ticks-2.npy")
        self.assert_said(log, "ticks.npy: does not begin with the row that its recorder wrote first")
        path = log / "manifest.json"
        path.write_text(path.read_text().replace('"compiler": "', '"compiler": "b', 1))
        code, said, wrong = run("kerf-record", "check", log, "--repair")
        self.assertEqual((code, said, wrong.count("\n")), (1, "", 1), wrong)
        self.assertIn("ticks.npy: does not begin with the row that manifest.json has the checksum of, so no manifest is rebuilt; copy", wrong)

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
        self.assert_said(log, "clock.npy: its checksum is ")

    def test_a_last_file_of_a_log_that_is_lost_is_reported_by_all(self):
        for of in (self.split, self.whole):
            log = self.copy(of)
            files = sorted(log.glob("ticks.npy.*"))
            files[-1].unlink()
            self.assert_said(log, f"{files[-1]}: missing, and the recorder had begun {len(files) + 1} files of this log; copy")

    def test_a_last_file_that_is_cut_in_its_header(self):
        for length in (0, 100, HEADER - 1):
            log = self.copy(self.split)
            *before, last = sorted(log.glob("ticks.npy*"))
            for data in (last.read_bytes()[:length], bytes(HEADER + length)):  # killed as it began it, or the power was cut then
                last.write_bytes(data)
                self.assertEqual(check(log)[0], 0, check(log))
                if kerf_reader:
                    self.assertEqual(len(kerf_reader.Log(log)), 1000 * len(before))
            log = self.copy(self.whole)
            last = log / "ticks.npy.0003"
            last.write_bytes(last.read_bytes()[:length])
            self.assert_said(log, f"{last}: cut in its header; copy")
            log = self.copy(self.whole)
            (log / "ticks.npy.0004").write_bytes(b"x" * length)
            self.assert_said(log, f"{log / 'ticks.npy.0004'}: no file of this log, which has 3; ")

    def torn(self, of, tears, damaged=None, counted=True):
        """A copy whose last files count 300 rows less than they have, as manifest.json does if `counted`, and lost their last bytes to a power
        cut: {file: bytes}. The row of this number from the end on is damaged. Returns the log, and how many rows of each file are left."""
        log, left = self.copy(of), {}
        files = {name: sorted(log.glob(f"{name}*"))[-1] for name in ("ticks.npy", "ticks-2.npy") if (log / name).exists()}
        # A recorder may be killed between the rows of two arms.
        rows = min((last.stat().st_size - HEADER) // ROW for last in files.values())
        for name, last in files.items():
            data = bytearray(last.read_bytes())
            del data[HEADER + rows * ROW:]
            begin, behind = bytes(data[:HEADER]).split(b"'shape': (")
            data[:HEADER] = (begin + b"'shape': (%d,), }" % max(rows - 300, 10)).ljust(HEADER - 1) + b"\n"
            if (size := tears.get(name, 0)):
                data[-size:] = bytes(size + 1234)
            if damaged:
                data[HEADER + (rows - damaged) * ROW + 50] ^= 1
            last.write_bytes(data)
            left[last] = rows - -(-size // ROW)
        # Rows are on the disk before a header counts them, and the headers before manifest.json does.
        manifest = json.loads((log / "manifest.json").read_text())
        before = sum((path.stat().st_size - HEADER) // ROW for path in sorted(log.glob("ticks.npy*"))[:-1])
        manifest["rows"] = before + max(rows - 300, 10) if counted else 0
        (log / "manifest.json").write_text(sealed(manifest))
        return log, left

    def test_what_a_power_cut_tore_is_left_out(self):
        size = 250 * ROW - 77
        cases = ((self.log, {"ticks.npy": size}), (self.split, {"ticks.npy": 5 * ROW}), (self.two, {"ticks.npy": size}),
                 (self.two, {"ticks-2.npy": size}), (self.two, {"ticks.npy": 3 * ROW, "ticks-2.npy": size}))
        for (of, tears), counted in itertools.product(cases, (False, True)):
            with self.subTest(of=of.parent.name, tears=tears, counted=counted):
                log, left = self.torn(of, tears, counted=counted)
                first = next(iter(left))
                rows = min(left.values()) + sum((path.stat().st_size - HEADER) // ROW for path in log.glob("ticks.npy*") if path < first)
                said = [f"{path}: {path.stat().st_size - HEADER - own * ROW} bytes behind its {own} rows are left out, since they are torn"
                        for path, own in left.items() if path.stat().st_size - HEADER >= (own + 1) * ROW]
                self.assertEqual([line.split(": ")[0] for line in said], [str(path) for path in left if path.name.split(".npy")[0] + ".npy" in tears])
                csv, mcap = log.parent / "out.csv", log.parent / "out.mcap"
                for program, *arguments in (("kerf-record", "check", log), ("kerf-record", "info", log), ("kerf-record", "export", log, "--csv", csv),
                                            ("kerf-record", "export", log, "--mcap", mcap), ("kerf-replay", log),
                                            ("kerf-record", "plot", log, "--out", log.parent / "out.svg")):
                    if arguments[0] == "plot" and not (BIN / "../../../lab/report").exists():
                        continue  # its libraries are beside the tree
                    code, out, wrong = run(program, *arguments)
                    self.assertEqual((code, wrong.count("\n")), (0, len(said)), (program, arguments, wrong))
                    for line in said:
                        self.assertIn(f"{program}: {line}", wrong)
                    if arguments[0] == "info":
                        self.assertRegex(out, rf"\nrows +{rows}\n")
                    if program == "kerf-replay":
                        self.assertIn(f"{rows} ticks, each equal", out)
                self.assertEqual(len(csv.read_text().splitlines()), 1 + rows)
                if of == self.two:
                    self.assertEqual(run("kerf-record", "export", log, "--csv", csv, "--arm", "2")[0], 0)
                    self.assertEqual(len(csv.read_text().splitlines()), 1 + rows)
                    self.assertRegex(run("kerf-record", "info", log, "--arm", "2")[1], rf"\nrows +{rows}\n")
                if kerf_reader:
                    with warnings.catch_warnings(record=True) as warned:
                        warnings.simplefilter("always")
                        read = kerf_reader.Log(log)
                    self.assertEqual([len(arm) for arm in (read.ticks, read.second) if arm is not None], [rows] * (1 + (of == self.two)))
                    self.assertEqual([line in str(warning.message) for line, warning in zip(said, warned)], [True] * len(said))

    def test_a_manifest_made_anew_counts_the_ticks_that_both_arms_have(self):
        for torn in ("ticks.npy", "ticks-2.npy"):
            log, left = self.torn(self.two, {torn: 100 * ROW})
            (log / "manifest.json").unlink()
            code, said, wrong = run("kerf-record", "check", log, "--repair")
            self.assertEqual((code, "made anew" in said, wrong.count("\n")), (0, True, 1), wrong)
            self.assertEqual(json.loads((log / "manifest.json").read_text())["rows"], min(left.values()))
            self.assertEqual(check(log)[0], 0)

    def test_a_second_arm_without_ticks_that_the_first_counts_is_an_error(self):
        log, left = self.torn(self.two, {"ticks-2.npy": 301 * ROW}, counted=False)
        second = log / "ticks-2.npy"
        data = second.read_bytes()
        begin, _ = data[:HEADER].split(b"'shape': (")
        second.write_bytes((begin + b"'shape': (10,), }").ljust(HEADER - 1) + b"\n" + data[HEADER:])
        self.assert_said(log, f"{second}: {left[second]} rows, and ticks.npy has ")
        (log / "manifest.json").unlink()
        code, said, wrong = run("kerf-record", "check", log, "--repair")
        self.assertEqual((code, said, wrong.count("\n"), (log / "manifest.json").exists()), (1, "", 1, False), wrong)
        self.assertIn(f"{second}: {left[second]} rows, and ticks.npy has ", wrong)

    def test_a_row_that_is_damaged_among_sound_ones_stays_an_error(self):
        for of in (self.log, self.two):
            log, _ = self.torn(of, {}, damaged=200)
            self.assert_said(log, " has a wrong checksum; copy it again")
            log, _ = self.torn(of, {"ticks.npy": 100 * ROW, "ticks-2.npy": 100 * ROW}, damaged=200)
            self.assert_said(log, " has a wrong checksum; copy it again")
            log, left = self.torn(of, {"ticks.npy": 301 * ROW})  # one of them was on the disk
            self.assert_said(log, " has a wrong checksum; copy it again")

    def test_lost_ticks_among_counted_rows_are_reported_by_all(self):
        log = self.copy(self.split)
        for name, rows, lost in (("ticks.npy.0002", 990, 10), ("ticks.npy.0003", 50, 0)):
            data = (log / name).read_bytes()
            head = data[:HEADER].split(b"'shape': (")[0] + b"'shape': (%d,), }" % rows
            (log / name).write_bytes(head.ljust(HEADER - 1) + b"\n" + data[HEADER:len(data) - lost * ROW])
        self.assert_said(log, "manifest.json: gaps lacks 10 records from index 1990, which are in no row", by=["check", "info", "reader"])

    def test_a_log_that_ended_has_no_torn_rows(self):
        log = self.copy(self.whole)
        last = log / "ticks.npy.0003"
        last.write_bytes(last.read_bytes() + bytes(3 * ROW))
        self.assert_said(log, f"{last}: {3 * ROW} bytes behind its last row; copy")

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

    def test_what_stands_in_place_of_a_file_of_a_log_is_reported_in_one_line(self):
        for of, name in ((self.whole, "ticks.npy.0002"), (self.whole, "ticks.npy.0003"), (self.whole, "ticks.npy.0004"), (self.split, "ticks.npy.0003"),
                         (self.log, "ticks.npy.0002"), (self.two, "ticks-2.npy.0002")):
            for make, words in ((pathlib.Path.mkdir, "no regular file; copy"), (os.mkfifo, "no regular file; copy"),
                                (lambda path: path.symlink_to("nowhere"), "cannot be read; copy")):
                with self.subTest(of=of.parent.name, name=name, words=words):
                    log = self.copy(of)
                    (log / name).unlink(missing_ok=True)
                    make(log / name)
                    for program, *arguments in (("kerf-record", "check", log), ("kerf-record", "info", log), ("kerf-replay", log)):
                        code, _, said = run(program, *arguments)
                        self.assertEqual((code, said), (1, f"{program}: {log / name}: {words} the recording again\n"))

    def test_each_byte_of_a_header_is_compared_by_all(self):
        rows = (self.whole / "ticks.npy").read_bytes()
        for at in (0, 6, 7, 8, 9, 30, 2000, HEADER - 20, HEADER - 1):
            log = self.copy(self.whole)
            (log / "ticks.npy").write_bytes(rows[:at] + bytes([rows[at] ^ 2]) + rows[at + 1:])
            self.assert_said(log, f"{log / 'ticks.npy'}: ")


if __name__ == "__main__":
    unittest.main()
