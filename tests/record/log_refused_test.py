# SPDX-License-Identifier: Apache-2.0
"""What kerf_reader refuses with its line, and neither waits for nor leaves to an error of Python: files that are none, texts and headers
of another shape. What all readers tell alike is in check_test.py.

    log_refused_test.py ROOT BIN"""
import json
import os
import pathlib
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest
import zlib
from unittest import mock

ROOT, BIN = (pathlib.Path(sys.argv.pop(1)).resolve() for _ in range(2))
sys.path[:0] = [str(ROOT / "tests/record"), str(ROOT / "python")]
from kerf_reader import Log
from lockstep_run import record, sealed

HEADER = 4096


class TestLogRefused(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = pathlib.Path(cls.temporary.name)
        record(ROOT, BIN, cls.folder, ROOT / "scenes/wall.toml", 0.5)
        cls.log = cls.folder / "log"
        cls.manifest = json.loads((cls.log / "manifest.json").read_text())
        cls.rows = (cls.log / "ticks.npy").read_bytes()

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def copy(self):
        copy = pathlib.Path(tempfile.mkdtemp(dir=self.folder)) / "log"
        shutil.copytree(self.log, copy)
        return copy

    def test_refuses_texts_of_another_shape(self):
        scene = json.loads((self.log / "scene.json").read_text())
        rates = [(rate, "scene.json: servo.rate_hz is .*; copy") for rate in (0, -0.0, False, -1000)]
        for rate, words in [*rates, ("1000", "are not those of a recording; give"), (float("inf"), "no JSON"), (float("nan"), "no JSON")]:
            (log := self.copy()).joinpath("scene.json").write_text(json.dumps({**scene, "servo": {"rate_hz": rate}}))
            with self.subTest(rate=rate), self.assertRaisesRegex(ValueError, words):
                Log(log)
        for name in ("manifest.json", "scene.json"):
            for text in ("[" * 100000, '{"a":' * 100000):
                (log := self.copy()).joinpath(name).write_text(text)
                with self.subTest(name), self.assertRaisesRegex(ValueError, f"{name}: no JSON, .*; give the folder"):
                    Log(log)
        # So large that no number of NumPy holds it, and a scene that says no rate.
        (log := self.copy()).joinpath("scene.json").write_text("{}")
        (log / "manifest.json").write_text(json.dumps({**self.manifest, "tick_ns": 10**30, "start_ns": 0}))
        with self.assertRaisesRegex(ValueError, "tick_ns is 10*, and not a whole number of ns above 0; copy"):
            Log(log)

    def test_refuses_what_is_no_regular_file(self):
        names = ("manifest.json", "scene.json", "clock.npy", "ticks.npy", "ticks.npy.0002")
        logs = {name: self.copy() for name in names}
        logs["clock of the checksums"] = self.copy()
        without = {key: value for key, value in self.manifest.items() if key != "clock"}
        (logs["clock of the checksums"] / "manifest.json").write_text(sealed(without))
        for name, log in logs.items():
            path = log / (name if name in names else "clock.npy")
            path.unlink(missing_ok=True)
            os.mkfifo(path)
        # In a process of its own: one that waits for a writer waits for ever.
        lines = "\n".join(("import sys", "sys.path.insert(0, sys.argv[1])", "import kerf_reader", "for log in sys.argv[2:]:", "    try:",
                           "        kerf_reader.Log(log)", "    except ValueError as error:", "        print(error)"))
        done = subprocess.run([sys.executable, "-B", "-c", lines, ROOT / "python", *logs.values()], capture_output=True,
                              text=True, timeout=60)
        wanted = [f"{log / (name if name in names else 'clock.npy')}: no regular file; copy the recording again"
                  for name, log in logs.items()]
        self.assertEqual(done.stdout.splitlines(), wanted, done.stderr)

    def test_refuses_headers_that_the_programs_refuse(self):
        text = self.rows[10:HEADER]
        of_version_2 = b"\x93NUMPY\x02\0" + struct.pack("<I", len(text) - 2) + text[:-3] + b"\n"
        for header, reader in ((self.rows[:6] + b"\x02" + self.rows[7:HEADER], "no ticks of this version of kerf; give"),
                               (of_version_2, "; record it again, or give the folder"),
                               (self.rows[:HEADER].replace(b"'fortran_order': False", b"'fortran_order': True "), "no ticks of this version"),
                               (self.rows[:10] + b"{'descr': [".ljust(HEADER - 11) + b"\n", "; record it again, or give the folder"),
                               (self.rows[:10] + (b"[" * 4000).ljust(HEADER - 11) + b"\n", "; record it again, or give the folder")):
            with self.subTest(header[:20]):
                self.assertEqual(len(header), HEADER)
                (log := self.copy()).joinpath("ticks.npy").write_bytes(header + self.rows[HEADER:])
                self.assertEqual(subprocess.run([BIN / "kerf-record", "info", log], capture_output=True).returncode, 1)
                with self.assertRaisesRegex(ValueError, f"ticks.npy: .*{reader}"):
                    Log(log)

    def test_takes_and_refuses_texts_as_the_programs_do(self):
        def manifest(change):
            def on(log):
                text = change((log / "manifest.json").read_bytes().rpartition(b',\n  "crc32"')[0])
                (log / "manifest.json").write_bytes(text + b',\n  "crc32": "%08x"\n}\n' % zlib.crc32(text))
            return on

        def put(text):
            return manifest(lambda before: before.replace(b'  "lost_ticks"', b'  "other": ' + text + b',\n  "lost_ticks"', 1))

        def scene(change):
            def on(log):
                path = log / "scene.json"
                path.write_bytes(change(path.read_bytes()))
                words = json.loads((log / "manifest.json").read_text())
                words["files"]["scene.json"] = f"{zlib.crc32(path.read_bytes()):08x}"
                (log / "manifest.json").write_text(sealed(words))
            return on

        def without_clock(log):
            (log / "manifest.json").write_text(sealed({key: value for key, value in self.manifest.items() if key != "clock"}))

        rows, mark = b'"rows": %d' % self.manifest["rows"], b"\xef\xbb\xbf"
        for what, change, code in (
                ("rows as a fraction", manifest(lambda text: text.replace(rows, rows + b".0")), 1), ("1e400", put(b"1e400"), 1),
                ("10^400", put(b"1" + b"0" * 400), 1), ("10^300", put(b"1" + b"0" * 300), 0), ("half a pair", put(b'"\\ud800"'), 1),
                ("a pair", put(b'"\\ud83d\\ude00"'), 0), ("64 levels", put(b"[" * 63 + b"]" * 63), 0), ("65", put(b"[" * 64 + b"]" * 64), 1),
                ("a mark", manifest(lambda text: mark + text), 0), ("two marks", manifest(lambda text: mark * 2 + text), 1),
                ("a mark in the scene", scene(lambda text: mark + text), 0), ("a zero behind it", scene(lambda text: text + b"\0"), 0),
                ("a zero in it", scene(lambda text: text[:50] + b"\0" + text[50:]), 1), ("1e400 in it", scene(lambda text: b'{"a":1e400,' + text[1:]), 1),
                ("lost_ticks", manifest(lambda text: text.replace(b'"lost_ticks": 0', b'"lost_ticks": 3')), 1), ("no clock", without_clock, 0)):
            change(log := self.copy())
            with self.subTest(what):
                self.assertEqual(subprocess.run([BIN / "kerf-record", "info", log], capture_output=True).returncode, code)
                if code:
                    self.assertRaises(ValueError, Log, log)
                else:
                    self.assertEqual(len(Log(log).utc), self.manifest["rows"])

    def test_names_the_remedy_for_a_file_that_is_lost(self):
        for name in ("manifest.json", "scene.json", "clock.npy", "ticks-2.npy"):
            (log := self.copy()).joinpath(name).unlink(missing_ok=True)
            if name == "ticks-2.npy":
                (log / "manifest.json").write_text(sealed({**self.manifest, "arms": 2}))
            with self.subTest(name), self.assertRaises(ValueError) as raised:
                Log(log)
            self.assertEqual(str(raised.exception), f"{log / name}: No such file or directory; copy the recording again")
        for folder, way in ((log.parent, f"give {log}"), (log.parent / "none", "give the folder of a recording")):
            with self.assertRaisesRegex(ValueError, f"ticks.npy: No such file or directory; {way}$"):
                Log(folder)

    def test_reads_a_header_again_that_is_written_meanwhile(self):
        count = (len(self.rows) - HEADER) // 496
        for half in (self.rows[:HEADER].replace(b"(%d," % count, b"(%d," % (9 * 10**len(str(count)))), self.rows[:100].ljust(HEADER, b"\0")):
            with mock.patch("os.pread", side_effect=[half[:HEADER], self.rows[:HEADER]]) as reads:
                self.assertEqual(len(Log(self.log)), count)
            self.assertEqual(reads.call_count, 2)

    def test_takes_parts_by_number(self):
        log = self.copy()
        count = (len(self.rows) - HEADER) // 496
        (log / "ticks.npy.0002").write_bytes(self.rows[:HEADER].replace(b"(%d,), }" % count, b"(0,), }".ljust(len(str(count)) + 6)))
        for number in [*range(3, 10001), 10002]:
            os.link(log / "ticks.npy.0002", log / f"ticks.npy.{number:04}")
        line = f"{log / 'ticks.npy.10001'}: missing, or cut in its header, and ticks.npy.10002 is there; copy the recording again"
        with self.assertRaises(ValueError) as raised:
            Log(log)
        done = subprocess.run([BIN / "kerf-record", "info", log], capture_output=True, text=True)
        self.assertEqual((str(raised.exception), done.stderr), (line, f"kerf-record: {line}\n"))


if __name__ == "__main__":
    unittest.main()
