#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Whether the pages that a command makes are older than the sources that make them:

    .ci/check-pages.py                  prints each stale page with the command that renews it; exit code 1 if there is one
    .ci/check-pages.py --stamp PAGE...  after a page was made anew: writes the hash of its sources behind it; also if no change
                                        of them can move a figure, and the commit says why. PAGE#PART: of this part alone

A page ends with a line <!-- made by: COMMAND; sources: HASH --> for each command that makes a part of it. The hash is over the
code of the sources, without their paths and comments: neither a renamed file nor another comment makes a page stale. Pages
that a test makes again and compares (scene-keys, reports, segment, wire, log) need no hash."""
import hashlib
import io
import pathlib
import re
import sys
import tokenize

ROOT = pathlib.Path(__file__).resolve().parent.parent
RIG = ["lab/rig/*"]
# Page, or page#part, the command that makes it, the sources of its rows and texts.
PAGES = {
    "docs/contact.md#accuracy": ("./kerf lab accuracy --page docs/contact.md", ["lab/accuracy/*", "lab/report/accuracy.py", "lab/rig/contact_rig.*"]),
    "docs/contact.md#contact": ("./kerf studies extremes --data DIR --page docs/contact.md",
                        ["tests/studies/contact/*", "lab/report/contact.py", "tests/rig/*", *RIG]),
    "docs/stability.md#energy": ("./kerf lab energy --page docs/stability.md", ["lab/stability/energy_*", "lab/report/energy.py", "lab/rig/port_loop.hpp", "controller/law/*"]),
    "docs/reality.md": ("./kerf lab reproduce --page docs/reality.md",
                        ["lab/reproduce/*", "lab/report/reproduce*", "controller/stability/*"]),
    "docs/stability.md#maps": ("./kerf lab zwidth --page docs/stability.md",
                          ["lab/stability/*", "!lab/stability/energy_*", "lab/impedance/*", "controller/stability/*", "lab/report/stability*"]),
    "docs/performance.md#kernels": ("./kerf bench kernels --page docs/performance.md", ["lab/bench/*", "lab/report/kernels.py", *RIG]),
    "docs/performance.md#pictures": ("./kerf bench pictures --page docs/performance.md", ["visualizer/bench/*", "lab/report/pictures.py"]),
    "docs/performance.md#bridge": ("./kerf bench bridge --page docs/performance.md", ["tests/studies/bridge/*"]),
}
# A number comes before a character: 1'000 has no text in it.
CPP_TOKEN = re.compile(r"""(?P<kept>R"(?P<end>[^(]*)\(.*?\)(?P=end)"|"(?:\\.|[^"\\])*"|\b[0-9][\w.']*|'(?:\\.|[^'\\])*')"""
                       r"""|(?://[^\n]*\n|/\*.*?\*/|\s)+""", re.DOTALL)
STAMP = re.compile(r"^<!-- made by: (.*); sources: ([0-9a-f]{16}) -->\n", re.MULTILINE)


def sources(globs):
    """The files of some globs; those of a glob behind ! are left out. A glob without a file is an error of the table."""
    found, left_out = set(), set()
    for glob in globs:
        files = {file for file in ROOT.glob(glob.lstrip("!")) if file.is_file() and file.suffix in (".cpp", ".hpp", ".py", ".toml")}
        if not files:
            sys.exit(f"check-pages: {glob}: no such source; correct the table of .ci/check-pages.py")
        (left_out if glob.startswith("!") else found).update(files)
    return sorted(found - left_out)


def code_of(file):
    """What a file does: its code without comments, and with a space only between two words."""
    text = file.read_text(encoding="utf-8")
    if file.suffix == ".toml":
        return "\n".join(line for line in text.splitlines() if line.strip() and not line.startswith("#"))
    if file.suffix != ".py":
        text = CPP_TOKEN.sub(lambda found: found["kept"] or "\0", text)
        return re.sub(r"(?<=\w)\0(?=\w)", " ", text).replace("\0", "")
    lines = text.splitlines()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            row, column = token.start
            lines[row - 1] = lines[row - 1][:column]
    return "\n".join(line.rstrip() for line in lines if line.strip())


def hash_of(globs):
    codes = sorted(code_of(file) for file in sources(globs))
    return hashlib.sha256("\0".join(codes).encode()).hexdigest()[:16]


def stamp(name):
    parts = [part for part in PAGES if name in (part, part.partition("#")[0])]
    if not parts:
        sys.exit(f"check-pages: {name}: not in the table; it has {', '.join(PAGES)}")
    page = ROOT / name.partition("#")[0]
    text = page.read_text(encoding="utf-8")
    stamps = dict(STAMP.findall(text))
    for command, globs in map(PAGES.get, parts):
        stamps[command] = hash_of(globs)
    lines = "".join(f"<!-- made by: {command}; sources: {code} -->\n" for command, code in stamps.items())
    page.write_text(STAMP.sub("", text).rstrip("\n") + "\n\n" + lines, encoding="utf-8")


def stale():
    for part, (command, globs) in PAGES.items():
        found = dict(STAMP.findall((ROOT / part.partition("#")[0]).read_text(encoding="utf-8"))).get(command)
        if found is None:
            yield f"{part}: no hash of its sources; run {command}, then .ci/check-pages.py --stamp {part}"
        elif found != hash_of(globs):
            yield f"{part}: older than its sources; run {command}, then .ci/check-pages.py --stamp {part}"


def main(words):
    if words[:1] == ["--stamp"] and len(words) > 1:
        for page in words[1:]:
            stamp(page)
        return 0
    if words:
        sys.exit(f"check-pages: {words[0]}: unknown; give nothing, or --stamp PAGE")
    wrong = list(stale())
    print(*wrong, sep="\n", end="\n" if wrong else "")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
