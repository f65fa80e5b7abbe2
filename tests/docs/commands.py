#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Whether the commands that the pages print are commands:  commands.py ROOT BIN check|tutorial

check: every option of every `./kerf` line of README.md and docs/, and of every `./kerf` within their text, is one that the
program's --help knows, and so is its value, if the help lists the words or the range that it may be.
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


def same_as():
    """The commands of ./kerf that are another name of a program's, by cli/help.sh."""
    names = re.search(r"same_as=\((.*?)\)", (root / "cli" / "help.sh").read_text(encoding="utf-8"), re.S)[1]
    return {command: target.strip("'").split() for command, target in re.findall(r"\['?([^]']+)'?\]=('[^']*'|\S+)", names)}


@functools.cache
def stored_help(name, command=""):
    """The help of a program, or of a command within it, as cli/help has it; the test stored_help compares it with the program's."""
    whole = root / "cli" / "help" / f"{name}.txt"
    if whole.exists():
        return whole.read_text(encoding="utf-8")
    file = root / "cli" / "help" / f"kerf-{name}.txt"
    parts = re.split(r"^## kerf-", file.read_text(encoding="utf-8"), flags=re.M) if file.exists() else []
    return "".join(part for part in parts if part.partition("\n")[0] == f"{name} {command}".strip())


def help_for(words):
    """The help of `./kerf WORDS...`: of a command or program, and of the command within it."""
    named = [word for word in words[:2] if re.fullmatch(r"[a-z][a-z-]*", word)]
    alias = same_as().get(" ".join(named)) or same_as().get(named[0]) or []
    return "".join(stored_help(*some) for some in (named[:1], named[:2], alias[:1], alias[:2]) if some)


def options_of(text):
    """Each option of a help, with the rule of its values: a set of words, the ends of a range, or None for any."""
    found = {"--help": None}
    for line in text.splitlines():
        for option in re.findall(r"--[a-z][a-z0-9-]*", line):
            found.setdefault(option, None)
        if row := re.match(r"\s+(?:-[a-z],)?(--[a-z][a-z0-9-]*) .*?:(?:\{([^}]*)\}|\[([-\d.e+]+) - ([-\d.e+]+)\])", line):
            found[row[1]] = set(row[2].split(",")) if row[2] else (float(row[3]), float(row[4]))
    return found


def refused(value, rule):
    """The first part of a value that a rule refuses. A word in capitals stands for the reader's own."""
    for part in value.split(",") if rule else []:
        if re.fullmatch(r"[A-Z]+|\.\.\.|\$.*|.*:.*", part):  # what a range of an axis holds, the program checks
            continue
        if isinstance(rule, set):
            if part not in rule:
                return part
        elif re.fullmatch(r"-?[\d.]+(e-?\d+)?", part) and not rule[0] <= float(part) <= rule[1]:
            return part
    return None


def faults_of(words):
    """What the program that `./kerf WORDS...` starts refuses of these words, by its --help."""
    known = options_of(help_for(words))
    for word, behind in zip(words, [*words[1:], ""]):
        if word == "--":
            return
        option, is_joined, value = word.partition("=")
        if not re.fullmatch(r"--[a-z][a-z0-9-]*", option):
            continue
        if option not in known:
            yield f"{option} is no option of ./kerf {words[0]}"
        elif part := refused(value if is_joined else behind, known[option]):
            yield f"{option} of ./kerf {words[0]} takes no {part}"


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
                wrong += [f"{page.name}:{number}: {fault}" for fault in faults_of(words)]
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
