#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Whether the commands that the pages print are commands:  commands.py ROOT BIN check|tutorial

check: every option of every `./kerf` line of README.md and docs/, and of every `./kerf` within their text, is one that the
program's --help knows.
tutorial: the lines of docs/tutorial.md, run one after the other in a scratch folder, all end well, and each
file that the page names is there then."""
import functools
import importlib.util
import os
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile

import pages

root, bin_folder, what = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve(), sys.argv[3]
environment = dict(os.environ, KERF_BIN=str(bin_folder))
environment.pop("DISPLAY", None)


@functools.cache
def help_of(*command):
    return subprocess.run([*command, "--help"], capture_output=True, text=True, env=environment).stdout


def known_options(words):
    """Options of `./kerf WORDS...`: those of kerf itself, or of a program and its subcommand."""
    if words[0] in ("demo", "test", "bench", "completion", "doctor", "setup", "docs", "page", "package", "sweep", "stand-in", "identify"):
        text = help_of(root / "kerf", words[0]) + (help_of(bin_folder / "kerf-lab", "sweep") if words[0] == "sweep" else "")
        text += help_of(bin_folder / "kerf-studies", "ranges") + help_of(bin_folder / "kerf-lab", "faults")
        text += help_of(bin_folder / "kerf-lab", "bench") + help_of(bin_folder / "kerf-visualizer")
    elif words[:2] == ["studies", "ablate"]:
        text = help_of(root / "kerf", "studies", "ablate")
    else:
        text = help_of(bin_folder / ("kerf-" + words[0]))
        if len(words) > 1 and re.fullmatch(r"[a-z][a-z-]*", words[1]):
            text += help_of(bin_folder / ("kerf-" + words[0]), words[1])
    return set(re.findall(r"--[a-z][a-z0-9-]*", text)) | {"--help"}


def check():
    wrong, checked = [], 0
    for page in pages.all_pages(root):
        for number, line in [(n, line) for n, line, _ in pages.commands(page)] + list(pages.inline(page)):
            for part in re.split(r"\s(?:\||&&|;|&)\s", line):
                match = re.search(r"(?:^|\s)\./kerf\s+(.*)", part)
                if not match:
                    continue
                words = shlex.split(match[1])
                if words[0].startswith("-") or words[0].isupper() or words[0] == "help":
                    continue
                checked += 1
                known = known_options(words)
                wrong += [f"{page.name}:{number}: {word} is no option of ./kerf {words[0]}"
                          for word in (w.split("=")[0] for w in words)
                          if re.fullmatch(r"--[a-z][a-z0-9-]*", word) and word not in known]
    print(*wrong, sep="\n")
    print(f"{checked} commands checked, {len(wrong)} wrong")
    return not wrong and checked > 30


def tutorial():
    page = root / "docs" / "tutorial.md"
    with tempfile.TemporaryDirectory() as scratch:
        for name in ("kerf", "scenes", "examples"):
            os.symlink(root / name, pathlib.Path(scratch) / name)
        for number, line, _ in pages.commands(page):
            if "python3" in line and not importlib.util.find_spec("matplotlib"):
                print(f"skipped: no matplotlib for a command of the tutorial: {line}")
                continue
            done = subprocess.run(["bash", "-c", line], cwd=scratch, env=environment, capture_output=True, text=True)
            print(f"{'ok' if done.returncode == 0 else 'FAILED'}: {line}")
            if done.returncode:
                print(f"{page.name}:{number}: exit code {done.returncode}\n{done.stdout}{done.stderr}")
                return False
        named = set(re.findall(r"`([a-z]+/[a-z0-9.-]+\.[a-z]+)`", page.read_text(encoding="utf-8")))
        lacking = [name for name in named if not (pathlib.Path(scratch) / name).exists()]
        print(f"{len(named)} files named, lacking: {lacking}")
        return bool(named) and not lacking


sys.exit(0 if {"check": check, "tutorial": tutorial}[what]() else 1)
