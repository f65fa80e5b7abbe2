#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Whether the pages that a command makes are older than the sources that make them:

    .ci/check-pages.py                  prints each stale page with the command that renews it; exit code 1 if there is one
    .ci/check-pages.py --stamp PAGE...  after a page was made anew: writes the hash of its sources as its last line; also if
                                        no change of them can move a figure, and the commit says why

A page ends with <!-- made by: COMMAND; sources: HASH -->. The hash is over the code of the sources, without their paths and
comments: neither a renamed file nor another comment makes a page stale. Pages that a test makes again and compares
(scene-keys, script-keys, reports, segment, wire, log, errors) need no hash."""
import hashlib
import io
import pathlib
import re
import sys
import tokenize

ROOT = pathlib.Path(__file__).resolve().parent.parent
RIG = ["lab/rig/*"]
# Page, the command that makes it, the sources of its rows and texts.
PAGES = {
    "docs/accuracy.md": ("./kerf lab accuracy --page docs/accuracy.md", ["lab/accuracy/*", "lab/report/accuracy.py"]),
    "docs/contact.md": ("./kerf studies extremes --data DIR --page docs/contact.md",
                        ["tests/studies/contact/*", "lab/report/contact.py", "tests/rig/*", *RIG]),
    "docs/energy.md": ("./kerf lab energy --page docs/energy.md", ["lab/stability/energy_*", "lab/report/energy.py", "lab/rig/port_loop.hpp", "controller/law/*"]),
    "docs/stability.md": ("./kerf lab zwidth --page docs/stability.md",
                          ["lab/stability/*", "!lab/stability/energy_*", "controller/stability/*", "lab/report/stability*"]),
    "docs/performance.md": ("./kerf bench kernels --page docs/performance.md", ["lab/bench/*", "lab/report/kernels.py", *RIG]),
    "docs/pictures.md": ("./kerf bench pictures --page docs/pictures.md", ["visualizer/bench/*", "lab/report/pictures.py"]),
    "docs/second-machine.md": ("./kerf bench bridge --page docs/second-machine.md", ["tests/studies/bridge/*"]),
}
# A number comes before a character: 1'000 has no text in it.
CPP_TOKEN = re.compile(r"""(?P<kept>R"(?P<end>[^(]*)\(.*?\)(?P=end)"|"(?:\\.|[^"\\])*"|\b[0-9][\w.']*|'(?:\\.|[^'\\])*')"""
                       r"""|(?://[^\n]*\n|/\*.*?\*/|\s)+""", re.DOTALL)
STAMP = re.compile(r"\n*<!-- made by: (.*); sources: ([0-9a-f]{16}) -->\n*\Z")


def sources(globs):
    """The files of some globs; those of a glob behind ! are left out. A glob without a file is an error of the table."""
    found, left_out = set(), set()
    for glob in globs:
        files = {file for file in ROOT.glob(glob.lstrip("!")) if file.is_file() and file.suffix in (".cpp", ".hpp", ".py")}
        if not files:
            sys.exit(f"check-pages: {glob}: no such source; correct the table of .ci/check-pages.py")
        (left_out if glob.startswith("!") else found).update(files)
    return sorted(found - left_out)


def code_of(file):
    """What a file does: its code without comments, and with a space only between two words."""
    text = file.read_text(encoding="utf-8")
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


def stamp(page):
    if page not in PAGES:
        sys.exit(f"check-pages: {page}: not in the table; it has {', '.join(PAGES)}")
    command, globs = PAGES[page]
    text = STAMP.sub("", (ROOT / page).read_text(encoding="utf-8")).rstrip("\n")
    (ROOT / page).write_text(f"{text}\n\n<!-- made by: {command}; sources: {hash_of(globs)} -->\n", encoding="utf-8")


def stale():
    for page, (command, globs) in PAGES.items():
        found = STAMP.search((ROOT / page).read_text(encoding="utf-8"))
        if not found:
            yield f"{page}: no hash of its sources; run {command}, then .ci/check-pages.py --stamp {page}"
        elif found[1] != command or found[2] != hash_of(globs):
            yield f"{page}: older than its sources; run {command}, then .ci/check-pages.py --stamp {page}"


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
