# SPDX-License-Identifier: Apache-2.0
"""What a recording contradicts itself in is named, by every reader alike.

    check_test.py ROOT BIN [TEST]"""
import json
import os
import re
import shutil
import struct
import subprocess
import unittest
import zlib

from recordings import BIN, HEADER, ROOT, ROW, Recordings, check, figures, kerf_reader, run


class TestCheck(Recordings):
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
        again = "; copy the recording again, or kerf record check --repair rebuilds it"
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

    def test_a_flight_recording_without_its_inputs_is_damaged(self):
        log = self.copy(self.flight)
        shutil.rmtree(log / "inputs")
        self.assertEqual(check(log)[0], 1)
        self.assertEqual(run("kerf-replay", log), (1, "", f"kerf-replay: {log}/inputs: missing, and manifest.json lists its files; copy the recording again\n"))

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


if __name__ == "__main__":
    unittest.main()
