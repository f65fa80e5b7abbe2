#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The reference pages of docs/, and the type of a tick in Python, that are made from sources and programs:
make.py ROOT BIN check|write

check: each file is what it would be if it were made now. A key, a field or a program that came, went or changed its
limits makes a difference, or is told as a lack."""
import difflib
import pathlib
import re
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import api
import exit_codes
import layouts
import reports
import script_keys
import wire
from source import Lack

BY = "Made by `tests/docs/reference/make.py` from the output of the programs and from their source.\n"


def page(text):
    """A page of docs/ with a line that says where it comes from."""
    title, rest = text.rstrip("\n").split("\n", 1)
    return f"{title}\n\n{BY}{rest}\n"


def demoted(text, title):
    """A page as a part of another one, under another title."""
    return re.sub(r"^#", "##", f"# {title}\n" + text.partition("\n")[2], flags=re.M)


FILES = {
    "docs/api.md": lambda *where: page(api.page(*where) + demoted(layouts.segment(*where), "The shared memory")),
    "docs/scene-keys.md": lambda root, programs: (
        programs.said(programs.folder / "kerf-controller", "--scene-keys") + "\n" +
        demoted(script_keys.page(root, programs), "Hand, fault, opacity and camera files")),
    "docs/wire.md": lambda *where: page(wire.page(*where)),
    "docs/reports.md": lambda *where: page(f"{reports.page(*where).rstrip()}\n\n{exit_codes.section(*where)}"),
    "python/kerf_reader/tick.py": layouts.numpy_tick,
}


class Programs:
    def __init__(self, folder):
        self.folder = folder

    def names(self):
        return sorted(path.name for path in self.folder.glob("kerf-*"))

    def said(self, *command):
        return subprocess.run(command, capture_output=True, text=True, check=True, stdin=subprocess.DEVNULL).stdout

    def help(self, name, *words):
        return self.said(self.folder / name, *words, "--help")

    def run(self, name, *words):
        return subprocess.run([self.folder / name, *words], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode


def main(root, programs, mode):
    wrong = 0
    for name, make in FILES.items():
        try:
            made = make(root, programs)
        except Lack as lack:
            print(f"{name}: {lack}")
            wrong += 1
            continue
        file = root / name
        if mode == "write":
            file.write_text(made, encoding="utf-8")
        before = file.read_text(encoding="utf-8") if file.exists() else ""
        sys.stdout.writelines(difflib.unified_diff(before.splitlines(True), made.splitlines(True), name, "now", n=0))
        wrong += before != made
    print(f"{len(FILES)} files, {wrong} wrong; renew them: make.py ROOT BIN write")
    return not wrong


sys.exit(0 if main(pathlib.Path(sys.argv[1]).resolve(), Programs(pathlib.Path(sys.argv[2]).resolve()), sys.argv[3]) else 1)
