# SPDX-License-Identifier: Apache-2.0
"""Recordings that tests damage: of a run whose device is silent for a while, its flight recording, and a log of several files."""
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT, BIN = (pathlib.Path(sys.argv.pop(1)).resolve() for _ in range(2))
sys.path[:0] = [str(ROOT / "tests/record"), str(ROOT / "python")]
from lockstep_run import record, sealed
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


class Recordings(unittest.TestCase):
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
