# SPDX-License-Identifier: Apache-2.0
"""A manifest that is lost or wrong is made anew, and hides no change of other files.

    repair_test.py ROOT BIN [TEST]"""
import json
import shutil
import subprocess
import unittest

from recordings import BIN, HEADER, ROOT, ROW, Recordings, check, figures, kerf_reader, run
from lockstep_run import set_clock


class TestRepair(Recordings):
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
                    self.assertRegex(wrong, rf"^kerf-record: {log}/{name}[^\n]*(checksum|begin)[^\n]*, so no manifest is rebuilt; copy the recording again\n$")
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


if __name__ == "__main__":
    unittest.main()
