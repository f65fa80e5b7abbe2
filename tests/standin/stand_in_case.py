# SPDX-License-Identifier: Apache-2.0
"""What the tests of `./kerf stand-in` share: the command, by the arguments ROOT PROGRAMS LIBRARIES of the test, and its report."""
import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

ROOT, PROGRAMS, LIBRARIES = (pathlib.Path(path).resolve() for path in sys.argv[1:4])
HERE = pathlib.Path(__file__).resolve().parent
COMMAND = ["/usr/bin/python3", "-B", ROOT / "standin", PROGRAMS, LIBRARIES, "--lockstep"]


class Case(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))

    def file(self, name, text):
        path = self.folder / name
        path.write_text(text)
        return str(path)

    def run_command(self, *words, options=(), lockstep=True):
        """The exit code, the report, and the lines for a person.

        A busy machine may pause the program for longer than the default of 50 ms: only a test that sets `stall` gets stalls.
        """
        patient = [] if any(str(option).startswith("stall=") for option in options) else ["--switch", "stall=60000"]
        done = subprocess.run(
            [*COMMAND[:None if lockstep else -1], "--report", self.folder / "report.json", "--junit", self.folder / "report.xml",
             *patient, *options, "--", *words], capture_output=True, text=True, check=False, timeout=300)
        path = self.folder / "report.json"
        report = json.loads(path.read_text()) if path.exists() else None
        return done.returncode, report, done.stderr

    def run_client(self, client, what, count, options=(), lockstep=True):
        """As `run_command`; and what the client measured, nothing if it left no file."""
        out = self.folder / "client.json"
        out.unlink(missing_ok=True)
        code, report, said = self.run_command("/usr/bin/python3", "-B", str(HERE / client), what, str(count), str(out),
                                              options=options, lockstep=lockstep)
        return code, report, json.loads(out.read_text()) if out.exists() else None, said

    def misuse(self, report):
        return sorted(one["what"] for one in report["misuse"])

    def close(self, a, b, ratio=0.02):
        self.assertLessEqual(abs(a - b), ratio * abs(b), f"{a} is not {b}")
