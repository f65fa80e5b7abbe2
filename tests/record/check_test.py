# SPDX-License-Identifier: Apache-2.0
"""What a recording contradicts itself in is named, by every reader alike; a lost manifest is made again.

    check_test.py ROOT BIN [EDITS [SEED]] [TEST]"""
import json
import os
import pathlib
import random
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest
import zlib

ROOT, BIN = (pathlib.Path(sys.argv.pop(1)).resolve() for _ in range(2))
EDITS = int(sys.argv.pop(1)) if len(sys.argv) > 1 and sys.argv[1].isdigit() else 200
SEED = int(sys.argv.pop(1)) if len(sys.argv) > 1 and sys.argv[1].isdigit() else 68
sys.path[:0] = [str(ROOT / "tests/record"), str(ROOT / "python")]
from lockstep_run import record, sealed, set_clock
try:
    import kerf_reader
except ImportError:
    kerf_reader = None  # no NumPy

HEADER, ROW = 4096, 496


def run(program, *arguments):
    """Exit code, standard output, standard error."""
    done = subprocess.run([BIN / program, *arguments], capture_output=True, text=True, timeout=120)
    return done.returncode, done.stdout, done.stderr


def check(log, *options):
    return run("kerf-record", "check", log, *options)


def figures(log):
    """What info and replay print of a log, without what depends on the machine."""
    return run("kerf-record", "info", log)[:2] + (re.sub(r"in [0-9.]+ s", "", run("kerf-replay", log)[1]),)


class TestCheck(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        """A run whose device is silent for a while: its log, and a flight recording with the inputs before it. And a log of
        several files."""
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = pathlib.Path(cls.temporary.name)
        (cls.folder / "silence.toml").write_text('latches = "stale_input"\n[[fault]]\nkind = "silence"\nat_s = 1.4\nfor_s = 0.3\n')
        record(ROOT, BIN, cls.folder, ROOT / "scenes/phantom.toml", 2.5, flight=True, fault=cls.folder / "silence.toml")
        (cls.folder / "other").mkdir()
        record(ROOT, BIN, cls.folder / "other", ROOT / "scenes/wall.toml", 1.5, recorder=("--split", "1s"))
        cls.split = cls.folder / "other/log"
        cls.log = cls.folder / "log"
        cls.flight, = (cls.folder / "flights").iterdir()
        cls.manifest = json.loads((cls.log / "manifest.json").read_text())
        cls.rows = (cls.log / "ticks.npy").read_bytes()

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def copy(self, of=None):
        copy = pathlib.Path(tempfile.mkdtemp(dir=self.folder)) / "log"
        shutil.copytree(of or self.log, copy)
        return copy

    def with_manifest(self, change, seal=True):
        log = self.copy()
        manifest = json.loads(json.dumps(self.manifest))
        change(manifest)
        (log / "manifest.json").write_text(sealed(manifest) if seal else json.dumps(manifest, indent=2))
        return log

    def with_ticks(self, data):
        log = self.copy()
        (log / "ticks.npy").write_bytes(data)
        return log

    def row(self, number):
        return self.rows[HEADER + number * ROW:HEADER + (number + 1) * ROW]

    def assert_told(self, log, words, reader=None):
        """By all programs, with exit code 1; and raised by the reader in Python, with its own words if they are others."""
        out = log.parent / "out.csv"
        for program, *arguments in (("kerf-record", "info", log), ("kerf-record", "export", log, "--csv", out),
                                    ("kerf-record", "plot", log, "--out", log.parent / "out.svg"),
                                    ("kerf-record", "check", log), ("kerf-replay", log)):
            code, _, said = run(program, *arguments)
            self.assertEqual(code, 1, (program, arguments, said))
            self.assertIn(words, said)
        if kerf_reader:
            with self.assertRaises(ValueError) as raised:
                kerf_reader.Log(log)
            self.assertIn(reader or words, str(raised.exception))

    def test_sound_recordings_are_sound_to_all(self):
        self.assertEqual(len(list(self.split.glob("ticks.npy*"))), 2)
        for log in (self.log, self.flight, self.split):
            self.assertEqual(check(log), (0, f"{log}: all files agree, and all checksums are right\n", ""))
            self.assertEqual(run("kerf-record", "info", log)[0], 0)
            if kerf_reader:
                self.assertGreater(len(kerf_reader.Log(log)), 500)
        again = self.folder / "replayed"
        self.assertEqual(run("kerf-replay", self.log, "--out", again)[0], 0)
        self.assertEqual(check(again)[0], 0, check(again))

    def test_what_the_manifest_says_against_scene_and_rows_is_told_by_all(self):
        def volume(**members):
            return lambda manifest: manifest["volumes"][0].update(members)

        def put(**members):
            return lambda manifest: manifest.update(members)
        wrong = "is {}, and {} by "
        for change, words, reader in (
                (volume(spacing_mm=[0.925] * 3), "volumes[0].spacing_mm is [0.925,0.925,0.925], and ", "volumes[0].spacing_mm is"),
                (volume(size_vox=[1, 2, 3]), "volumes[0].size_vox is [1,2,3], and ", "volumes[0].size_vox is"),
                (put(tick_ns=9000000), "tick_ns " + wrong.format(9000000, 1000000) + "scene.json", None),
                (put(rows=-1), "rows is -1, and ", "by manifest.json"),
                (put(rows=10**23), "rows is 9.999999999999999e+22, and ", "by manifest.json"),
                (put(rows=str(self.manifest["rows"])), f"rows is \"{self.manifest['rows']}\", and ", "by manifest.json"),
                (put(arms=2), "arms is 2, and 1 by scene.json", "No such file"),
                (put(config_hash="00" * 8), 'config_hash is "0000000000000000", and "', ""),
                (put(session_id="other"), 'session_id is "other", and not 16 hex', ""),
                (put(lost_ticks=3), "lost_ticks is 3, and 0 by its rows", None),
                (put(gaps=[{"first_index": 5, "count": 2}], lost_ticks=2), "gaps has 2 records from index 5", None),
                (put(start_ns=0, tick_ns=500000), "tick_ns " + wrong.format(500000, 1000000) + "scene.json", None),
                (put(end_reason="stopped"), 'summary.end_reason is "clean end"', ""),
                (lambda manifest: manifest["summary"].update(peak_force_n=77.5), "summary.peak_force_n is 77.5, and ", ""),
                (lambda manifest: manifest["summary"].update(rows=1), "summary.rows is 1, and ", ""),
                (lambda manifest: manifest["volumes"].append(manifest["volumes"][0]), "volumes has 2 volumes, and scene.json 1",
                 "volumes is 2, and 1"),
                (lambda manifest: manifest["files"].update({"scene.json": "00000000"}), "scene.json: its checksum is ", None)):
            with self.subTest(words):
                log = self.with_manifest(change)
                if reader == "":  # the reader has no scene in canonical form and no figures: the seal covers these
                    code, _, said = check(log)
                    self.assertEqual((code, words in said), (1, True), said)
                    log = self.with_manifest(change, seal=False)
                self.assert_told(log, words, reader or None if reader != "" else "its checksum is wrong")

    def test_facts_that_nothing_else_says_are_under_the_checksum_of_the_manifest(self):
        text = (self.log / "manifest.json").read_text()
        for key in ("kerf", "compiler", "cpu", "build_id", "abi_hash", "session_id", "end_reason"):
            with self.subTest(key):
                log = self.copy()
                changed = re.sub(rf'"{key}": "(.)', lambda match: match[0][:-1] + ("b" if match[1] != "b" else "c"), text, count=1)
                (log / "manifest.json").write_text(changed)
                self.assert_told(log, "its checksum is wrong")
        log = self.copy()
        (log / "manifest.json").write_text(text.replace('  "rows":', '  "rows": 7,\n  "rows":', 1))
        self.assert_told(log, '"rows" stands twice in it')
        scene = (self.log / "scene.json").read_text()
        (log := self.copy()).joinpath("scene.json").write_text('{"servo":{},' + scene[1:])
        self.assertIn('"servo" stands twice in it', check(log)[2])

    def test_a_member_of_another_kind_is_named_by_all(self):
        again = "; copy the recording again, or kerf record check --repair makes it anew"
        for key, text, kind in (("missed_before_start", "-1", "a number of ticks"), ("missed_before_start", str(10**30), "a number of ticks"),
                                ("missed_before_start", "null", "a number of ticks"), ("lost_ticks", "0.5", "a number of ticks"),
                                ("tick_ns", "0", "a whole number of ns above 0"), ("tick_ns", str(1 << 32), "a whole number of ns above 0"),
                                ("tick_ns", "true", "a whole number of ns above 0"), ("gaps", "null", "a list of gaps with first_index and count"),
                                ("gaps", '[{"first_index":5}]', "a list of gaps with first_index and count"), ("end_reason", "null", "a text"),
                                ("session_id", "7", "a text"), ("start_ns", "-5", "a time in ns"), ("arms", "3", "1 or 2, which this version knows"),
                                ("volumes", '[{"spacing_mm":[1,1,0]}]', "a list of volumes with a spacing_mm above 0")):
            with self.subTest(key=key, text=text):
                shown = "1e+30" if text == str(10**30) else text
                log = self.with_manifest(lambda manifest: manifest.update({key: json.loads(text)}))
                self.assert_told(log, f"manifest.json: {key} is {shown}, and not {kind}{again}\n",
                                 re.escape(f"manifest.json: {key} is ").replace("\\", "") + (text if key != "arms" else ""))
        log = self.with_manifest(lambda manifest: manifest.pop("gaps"))
        self.assert_told(log, "manifest.json: gaps is missing, and not a list")
        for word in ("NaN", "Infinity", "1e999"):
            with self.subTest(word):
                log = self.with_manifest(lambda manifest: manifest.update(lost_ticks="WORD"))
                text = (log / "manifest.json").read_text().replace('"WORD"', word).rpartition(',\n  "crc32"')[0]
                (log / "manifest.json").write_text(f'{text},\n  "crc32": "{zlib.crc32(text.encode()):08x}"\n}}\n')
                self.assert_told(log, "manifest.json: not a manifest of this version" if word != "1e999" else "manifest.json: ", "manifest.json: ")

    def test_a_recording_that_is_damaged_ends_all_with_1_and_no_recording_with_2(self):
        def header(log):
            (log / "ticks.npy").write_bytes(self.rows[:HEADER - 9] + b"x" + self.rows[HEADER - 8:])

        def labels(log):
            for path in (log / "volumes").iterdir():
                path.write_bytes(b"")

        for damage, words in ((lambda log: (log / "manifest.json").unlink(), "manifest.json: "), (lambda log: (log / "scene.json").unlink(), "scene.json: "),
                              (lambda log: (log / "scene.json").write_text("{"), "scene.json: "), (header, "ticks.npy: "),
                              (lambda log: (log / "ticks.npy").write_bytes(b""), "ticks.npy: ")):
            log = self.copy()
            damage(log)
            with self.subTest(words):
                self.assert_told(log, words)
        labels(log := self.copy())  # read by check and replay alone
        self.assertEqual([check(log)[0], run("kerf-replay", log)[0]], [1, 1])
        (log := self.copy()).joinpath("ticks.npy").unlink()
        for program, *arguments in (("kerf-record", "info", log), ("kerf-record", "export", log, "--csv", log.parent / "out.csv"),
                                    ("kerf-record", "plot", log, "--out", log.parent / "out.svg"), ("kerf-record", "check", log),
                                    ("kerf-replay", log), ("kerf-record", "info", self.log, "--arm", "2"),
                                    ("kerf-replay", self.log, "--from", "1000000")):
            code, _, said = run(program, *arguments)
            self.assertEqual((code, said.count("\n")), (2, 1), (program, arguments, said))

    def test_the_figures_of_info_come_from_scene_and_rows(self):
        was = run("kerf-record", "info", self.log)[1]
        for change in ({"tick_ns": 9000000}, {"volumes": [{**self.manifest["volumes"][0], "spacing_mm": [0.925] * 3}]}):
            self.assertEqual(run("kerf-record", "info", self.with_manifest(lambda manifest: manifest.update(change)))[1], was)

    def test_info_of_a_large_log_says_that_it_reads_no_row(self):
        """Of holes: of a log above 256 MB the header counts as many rows as the file has."""
        rows = (1 << 28) // ROW + 1
        log = self.with_manifest(lambda manifest: manifest.update(rows=rows, summary={**manifest["summary"], "rows": rows}))
        header = self.rows[:HEADER].replace(b"(%d,)" % ((len(self.rows) - HEADER) // ROW), b"(%d,)" % rows)
        header = header[:-1].rstrip().ljust(HEADER - 1) + b"\n"
        with open(log / "ticks.npy", "r+b") as file:
            file.write(header)
            file.truncate(HEADER + rows * ROW)
        said = "no row was read, --scan reads all"
        self.assertIn(said, run("kerf-record", "info", log)[1])
        self.assertNotIn(said, run("kerf-record", "info", log, "--scan")[1])
        self.assertNotIn(said, run("kerf-record", "info", self.log)[1])

    def test_rows_that_are_damaged_doubled_exchanged_or_appended_are_told_by_all(self):
        rows, at = self.rows, HEADER + 700 * ROW
        flipped = bytearray(rows)
        flipped[at + 5] ^= 8  # of seq: 8,796,093,022,208 records
        small = bytearray(rows)
        small[at] ^= 8
        other = struct.pack("<Q", 2) + self.row(0)[8:]
        count = (len(rows) - HEADER) // ROW
        longer = rows[:HEADER].replace(b"%d,)" % count, b"%d,)" % (count + 1)) + rows[HEADER:]
        for data, words in ((flipped, "row 700 has seq 8796093"), (small, "row 700 (tick 701, seq 1394) cannot follow tick 700"),
                            (rows[:at] + self.row(699) + rows[at:], "row 700 (tick 700, seq 1400) cannot follow tick 700"),
                            (rows[:at] + self.row(701) + self.row(700) + rows[at + 2 * ROW:], "row 701 (tick 701, seq 1402) cannot"),
                            (longer + other, f"row {count} (tick 1, seq 2) cannot follow tick {count}, seq"),
                            (longer + self.row(count - 1), f"row {count} (tick {count}, seq {2 * count}) cannot follow")):
            with self.subTest(words):
                log = self.with_ticks(data)
                out = log.parent / "out.csv"
                for arguments in (("info", log), ("export", log, "--csv", out), ("check", log)):
                    code, _, said = run("kerf-record", *arguments)
                    self.assertEqual((code, words in said, out.exists()), (1, True, False), said)
                code, said, wrong = run("kerf-replay", log)
                self.assertEqual((code, words in wrong, "stopped: " in said), (1, True, True), wrong)
                if kerf_reader:
                    with self.assertRaises(ValueError) as raised:
                        kerf_reader.Log(log)
                    self.assertRegex(str(raised.exception), rf"{words.split(' cannot')[0].split(' has')[0].split(' (')[0]}[ :]|bytes behind|rows, and")

    def test_a_range_before_the_damage_is_sound(self):
        data = bytearray(self.rows)
        data[HEADER + 700 * ROW + 100] ^= 1
        log = self.with_ticks(data)
        self.assertEqual(run("kerf-record", "info", log, "--until", "700")[0], 0)
        self.assertEqual(run("kerf-record", "info", log, "--until", "701")[0], 1)

    def test_a_cut_log_is_told_in_one_line_and_its_manifest_stays(self):
        log = self.with_ticks(self.rows[:HEADER + 700 * ROW + 100])
        count = (len(self.rows) - HEADER) // ROW
        line = f"kerf-record: {log / 'ticks.npy'}: cut after 700 of {count} rows; copy the recording again\n"
        self.assertEqual(check(log, "--repair"), (1, "", line))
        self.assertEqual((log / "manifest.json").read_bytes(), (self.log / "manifest.json").read_bytes())
        code, said, wrong = run("kerf-record", "info", log)
        self.assertEqual((code, wrong), (1, line))
        self.assertIn(f"cut after 700 of {count} rows", said)

    def killed(self):
        """A log as a recorder that was killed leaves it: more rows than header and manifest say, and a part of one."""
        def started(manifest):
            del manifest["summary"]
            manifest.update(rows=0, end_reason="running", files={"scene.json": manifest["files"]["scene.json"]})
        log = self.with_manifest(started)
        count = (len(self.rows) - HEADER) // ROW
        header = self.rows[:HEADER].replace(b"(%d,)" % count, b"(200,)")
        (log / "ticks.npy").write_bytes(header + b" " * (HEADER - len(header) - 1) + b"\n" + self.rows[HEADER:-100]
                                        if len(header) == HEADER else header[:-1] + b" " * (HEADER - len(header)) + b"\n" + self.rows[HEADER:-100])
        return log, count - 1

    def test_a_killed_recorder_leaves_a_sound_log(self):
        log, rows = self.killed()
        sound = "all files agree, and all checksums are right; manifest.json has none of clock.npy, volumes"
        self.assertEqual(check(log), (0, f"{log}: {sound}\n", ""))
        code, said, wrong = run("kerf-record", "info", log)
        self.assertEqual((code, wrong), (0, ""))
        self.assertRegex(said, rf"rows +{rows}\n")
        code, said, wrong = run("kerf-replay", log)
        self.assertEqual((code, wrong), (0, ""), said)
        self.assertIn(f"{rows} ticks, each equal", said)
        if kerf_reader:
            self.assertGreaterEqual(len(kerf_reader.Log(log)), 200)

    def test_a_lost_or_wrong_manifest_is_made_anew(self):
        was = figures(self.log)
        for how in ("lost", "no JSON", "wrong", "foreign"):
            with self.subTest(how):
                log = self.copy()
                path = log / "manifest.json"
                path.unlink()
                if how != "lost":
                    path.write_text({"no JSON": "{", "wrong": json.dumps({**self.manifest, "tick_ns": 5, "lost_ticks": 9}), "foreign": "[]"}[how])
                code, _, said = check(log)
                self.assertEqual(code, 1)
                self.assertIn("--repair", said)
                if how == "lost":
                    code, _, said = run("kerf-record", "info", log)
                    self.assertEqual((code, "--repair" in said), (1, True), said)
                code, said, wrong = check(log, "--repair")
                self.assertEqual((code, wrong), (0, ""))
                self.assertIn("manifest.json: made anew", said)
                self.assertEqual(figures(log)[0], 0)
                anew, info = figures(log)[1].split("\n", 1)
                self.assertRegex(anew, r"^manifest +made anew by kerf [0-9.]+")
                self.assertEqual(info.replace("unknown", "clean end"), was[1])
                # What only the old one said is not proved.
                manifest = json.loads(path.read_text())
                self.assertEqual((manifest["session_id"], manifest["end_reason"]), ("0" * 16, "unknown"))
                self.assertFalse({"kerf", "compiler", "build_id", "abi_hash", "summary"} & manifest.keys())
                self.assertEqual(figures(log)[2], was[2])
                if kerf_reader:
                    kerf_reader.Log(log)
                self.assertEqual((log / "manifest-old.json").exists(), how != "lost")
                self.assertNotIn("made anew", check(log, "--repair")[1])  # there is nothing left to repair
        log = self.copy(self.flight)
        (log / "manifest.json").unlink()
        self.assertEqual(check(log, "--repair")[0], 0)
        self.assertEqual(figures(log)[2], figures(self.flight)[2])

    def test_a_killed_recorder_may_lose_its_manifest(self):
        log, rows = self.killed()
        (log / "manifest.json").unlink()
        code, said, wrong = check(log, "--repair")
        self.assertEqual((code, wrong), (0, ""), said)
        self.assertRegex(run("kerf-record", "info", log)[1], rf"rows +{rows}\n")

    def test_a_manifest_that_is_right_hides_no_change_of_other_files(self):
        def scene(log):
            text = (log / "scene.json").read_text()
            (log / "scene.json").write_text(text.replace('"stiffness_n_per_mm":', '"stiffness_n_per_mm":1'))

        def last_row(log):
            count = (len(self.rows) - HEADER) // ROW
            header = self.rows[:HEADER].replace(b"(%d,)" % count, b"(%d,)" % (count - 1))
            (log / "ticks.npy").write_bytes(header + self.rows[HEADER:-ROW])

        for change in (scene, last_row):
            with self.subTest(change.__name__):
                log = self.copy()
                change(log)
                before = (log / "manifest.json").read_bytes()
                code, said, wrong = check(log, "--repair")
                self.assertEqual(code, 1)
                self.assertNotIn("made anew", said + wrong)
                self.assertEqual((log / "manifest.json").read_bytes(), before)

    def test_a_repair_hides_no_change_that_the_old_manifest_tells(self):
        def scene(log):
            text = (log / "scene.json").read_text()
            (log / "scene.json").write_text(text.replace('"stiffness_n_per_mm":', '"stiffness_n_per_mm":1'))

        def clock(log):
            before = (log / "manifest.json").read_text()
            set_clock(log, (0, 10**18))
            (log / "manifest.json").write_text(before)

        def volume(log):
            path = next((log / "volumes").iterdir())
            path.write_bytes(path.read_bytes()[:4] + b"\1" + path.read_bytes()[5:])  # the date in the header of gzip

        def lost_clock(log):
            (log / "clock.npy").unlink()

        def rows(log):
            (log / "ticks.npy").write_bytes((self.flight / "ticks.npy").read_bytes())

        for change, name in ((scene, "scene.json"), (clock, "clock.npy"), (volume, "volumes/"), (lost_clock, "clock.npy"), (rows, "ticks.npy")):
            for damage in (('"compiler": "', '"compiler": "b'), ('"tick_ns": ', '"tick_ns": -'), ('"session_id": "', '"session_id": "x')):
                with self.subTest(change=change.__name__, damage=damage):
                    log = self.copy()
                    change(log)
                    path = log / "manifest.json"
                    path.write_text(path.read_text().replace(*damage, 1))
                    was = path.read_bytes()
                    code, said, wrong = check(log, "--repair")
                    self.assertEqual((code, said), (1, ""))
                    self.assertRegex(wrong, rf"^kerf-record: {log}/{name}[^\n]*(checksum|begin)[^\n]*, so no manifest is made anew; copy the recording again\n$")
                    self.assertEqual((path.read_bytes(), (log / "manifest-old.json").exists()), (was, False))

    def test_a_wrong_scene_is_not_repaired_in_a_log_without_its_checksum(self):
        log = self.with_manifest(lambda manifest: manifest.pop("files"), seal=False)  # of an earlier version
        text = (log / "scene.json").read_text()
        (log / "scene.json").write_text(text.replace('"stiffness_n_per_mm":', '"stiffness_n_per_mm":1'))
        (log / "manifest.json").write_text((log / "manifest.json").read_text().replace('"tick_ns": ', '"tick_ns": 1', 1))
        code, said, wrong = check(log, "--repair")
        self.assertEqual((code, said, wrong.count("\n")), (1, "", 1), wrong)
        self.assertIn("scene.json: its config_hash is ", wrong)

    def test_a_checksum_of_another_form_and_a_wrong_config_hash_are_repaired(self):
        for change in (lambda manifest: manifest["files"].update({"scene.json": "0000000g"}), lambda manifest: manifest["files"].update({"scene.json": 7}),
                       lambda manifest: manifest["files"].update({"../scene.json": "00000000", "notes.txt": "00000000"}),
                       lambda manifest: manifest.update(files=[]), lambda manifest: manifest.update(first_rows="x"),
                       lambda manifest: manifest.update(first_rows=[-1]), lambda manifest: manifest.update(config_hash="00" * 8)):
            log = self.with_manifest(change, seal=False)
            code, said, wrong = check(log, "--repair")
            self.assertEqual((code, "made anew" in said, wrong), (0, True, ""), said)

    def test_a_repair_lists_no_file_that_no_recording_has(self):
        for of, names in ((self.log, ("volumes/notes.txt", "inputs/000000000001.npy.gz", "inputs-2/000000000001.npy.gz", "volumes/0123456789abcdef.npy.gz")),
                          (self.flight, ("inputs/notes.txt", "inputs/000000000002.npy.gz", "inputs/000001048577.npy.gz"))):
            for name in names:
                log = self.copy(of)
                (log / "manifest.json").unlink()
                (log / name).parent.mkdir(exist_ok=True)
                (log / name).write_bytes(b"notes")
                code, said, wrong = check(log, "--repair")
                self.assertEqual((code, "made anew" in said), (1, True), said)
                self.assertEqual(wrong, f"kerf-record: {log / name}: manifest.json does not list it; remove it\n")
                self.assertNotIn(name, json.loads((log / "manifest.json").read_text())["files"])

    def test_missing_rights_end_a_check_with_2(self):
        user = ["setpriv", "--reuid", "65534", "--clear-groups"]
        if os.geteuid() or subprocess.run([*user, BIN / "kerf-record", "--help"], capture_output=True).returncode:
            self.skipTest("no right to be another user")
        self.folder.chmod(0o755)
        for name in ("volumes", "volumes/*", "inputs", "inputs/*"):
            for rights in (0, 0o444):
                log = self.copy(self.flight)
                log.parent.chmod(0o755)
                path = min(log.glob(name))
                if rights and path.is_file():
                    continue
                path.chmod(rights)
                for program, *arguments in (("kerf-record", "check", log), ("kerf-replay", log)):
                    with self.subTest(name=name, rights=rights, program=program):
                        done = subprocess.run([*user, BIN / program, *arguments], capture_output=True, text=True, timeout=120)
                        self.assertEqual((done.returncode, done.stderr.count("\n")), (2, 1), done.stderr)
                        self.assertRegex(done.stderr, rf"^{program}: {path}[^ ]*: cannot be (read|reached) \(Permission denied\); check ")

    def test_a_part_of_a_log_behind_lost_ones_is_told(self):
        for log in (self.copy(), self.killed()[0]):
            shutil.copy(log / "ticks.npy", log / "ticks.npy.0004")
            self.assertIn("ticks.npy.0002: missing, or cut in its header, and ticks.npy.0004 is there", check(log)[2])
            self.assertNotEqual(run("kerf-record", "info", log)[0], 0)

    def test_what_cannot_be_repaired_says_why(self):
        log = self.copy()
        (log / "manifest.json").unlink()
        (log / "scene.json").unlink()
        code, _, said = check(log, "--repair")
        self.assertEqual((code, said.count("\n")), (1, 1), said)
        self.assertIn("scene.json: cannot be read", said)
        code, _, said = check(self.folder)
        self.assertEqual((code, said.count("\n")), (2, 1), said)
        self.assertIn(f"ticks.npy: cannot be read; give {self.log}", said)

    def test_a_log_on_a_disk_that_cannot_be_written(self):
        log = self.copy()
        disk = log.parent
        if subprocess.run(["mount", "--bind", "-r", disk, disk], stderr=subprocess.DEVNULL).returncode:
            self.skipTest("no right to mount")
        try:
            self.assertEqual(figures(log), figures(self.log))
            self.assertEqual(check(log, "--repair")[0], 0)
            self.assertEqual(run("kerf-record", "export", log, "--csv", self.folder / "from-there.csv")[0], 0)
        finally:
            subprocess.run(["umount", disk], check=True)
        (log / "manifest.json").unlink()
        subprocess.run(["mount", "--bind", "-r", disk, disk], check=True)
        try:
            code, _, said = check(log, "--repair")
            self.assertEqual((code, said.count("\n")), (2, 1), said)
            self.assertIn("manifest.json: cannot be written (Read-only file system); ", said)
        finally:
            subprocess.run(["umount", disk], check=True)

    def edit(self, log, dice):
        """Changes one file of a log somehow; returns how."""
        files = sorted(path for path in log.rglob("*") if path.is_file())
        path = dice.choice(files)
        data = bytearray(path.read_bytes())
        how = dice.choice(["bit", "byte", "cut", "double", "swap", "drop", "append", "number", "files", "gone"])
        at = dice.randrange(len(data))
        size = dice.choice([1, 4, 8, ROW, dice.randrange(1, 3000)])
        at = HEADER + (at - HEADER) // ROW * ROW if size == ROW and path.suffix == ".npy" and at > HEADER else at
        if how == "bit":
            data[at] ^= 1 << dice.randrange(8)
        elif how == "byte":
            data[at] = dice.randrange(256)
        elif how == "cut":
            del data[at:]
        elif how == "double":
            data[at:at] = data[at:at + size]
        elif how == "swap":
            data[at:at + 2 * size] = data[at + size:at + 2 * size] + data[at:at + size]
        elif how == "drop":
            del data[at:at + size]
        elif how == "append":
            data += data[at:at + size]
        elif how == "number":
            numbers = list(re.finditer(rb"\d+", data)) if path.suffix == ".json" else []
            if numbers:
                number = dice.choice(numbers)
                data[number.start():number.end()] = str(dice.choice([0, 9, 10**23, int(number[0]) + 1])).encode()
        elif how == "files":
            other = dice.choice(files)
            data, _ = bytearray(other.read_bytes()), other.write_bytes(data)
        if how == "gone":
            path.unlink()
        else:
            path.write_bytes(data)
        return f"{path.relative_to(log)}: {how} at {at}, {size}"

    def test_each_of_many_random_edits_is_found_or_has_no_effect(self):
        dice = random.Random(SEED)
        was = {log: figures(log) for log in (self.log, self.flight, self.split)}
        found = 0
        for number in range(EDITS):
            of = dice.choice(list(was))
            log = self.copy(of)
            how = self.edit(log, dice)
            code, said, wrong = check(log)
            with self.subTest(number=number, how=how, said=said + wrong):
                if code == 0:
                    self.assertEqual(figures(log), was[of])
                    continue
                found += 1
                # Each line has a place, a value and a way out.
                self.assertTrue(wrong and all(re.match(r"kerf-record: .+: .+; .+", line) for line in wrong.splitlines()), wrong)
            shutil.rmtree(log.parent)
        self.assertGreater(found, 0.8 * EDITS)


if __name__ == "__main__":
    unittest.main()
