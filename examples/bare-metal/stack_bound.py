#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The deepest stack of an image, from the compiler's own figures: the costliest chain of calls from `kerf_start`, by the
frames that gcc writes with -fcallgraph-info=su. Prints bytes; exit code 2, with one line, if there is no bound: a chain of
calls without an end, a frame without one, or a call of a function that is in none of the files.

    stack_bound.py FILE.ci...

A call through a pointer counts as the deepest function that the loop can reach so: a kernel of sets/scalar.cpp, or the
step of a law (kerf_law_...). The functions in LIBRARY, of newlib and libgcc, count LIBRARY_BYTES each; they call nothing of
ours.
"""
import re
import sys

LIBRARY_BYTES = 128  # memcpy saves 3 registers, a division of 64 bits at most 12
LIBRARY = {"memcpy", "memmove", "memset", "__aeabi_ldivmod", "__aeabi_uldivmod", "__aeabi_l2d", "__aeabi_ul2d", "__aeabi_d2lz",
           "__ctzdi2"}  # docs/determinism.md
ROOT = "kerf_start"


def refuse(line):
    print(f"stack_bound: {line}", file=sys.stderr)
    sys.exit(2)


def main(paths):
    def name(title):  # a title may begin with the file; functions of one name count as their costliest
        return title.rpartition(":")[2]

    frame, calls, targets = {}, {}, set()
    for path in paths:
        text = open(path, encoding="utf-8").read()
        for title, label in re.findall(r'node: { title: "([^"]*)" label: "([^"]*)"', text):
            size = re.search(r"\\n(\d+) bytes \(([^)]*)\)$", label)
            title = name(title)
            if size is None:
                continue
            if "static" not in size[2] and "bounded" not in size[2]:
                refuse(f"{title}: its frame has no bound; give its array a constant size")
            frame[title] = max(frame.get(title, 0), int(size[1]))
            if path.endswith("sets/scalar.cpp.ci") or title.startswith("kerf_law_"):
                targets.add(title)
        for source, target in re.findall(r'edge: { sourcename: "([^"]*)" targetname: "([^"]*)"', text):
            calls.setdefault(name(source), set()).add(name(target))

    known, open_calls = {}, []

    def own_bytes(title, caller):
        if title not in frame and title not in LIBRARY:
            refuse(f"{title}: {caller} calls it, and no file has its frame; give the graph of its source, or list it in LIBRARY")
        return frame.get(title, LIBRARY_BYTES)

    def defined(title):
        """The name under which a file has the frame: gcc emits a constructor or destructor once, as C2 or D2, and calls it by
        an alias, C1 or D1."""
        if title in frame:
            return title
        bases = (title[:at.start()] + at[1] + "2" + title[at.end():] for at in re.finditer("([CD])1", title))
        return next((base for base in bases if base in frame), title)

    def depth(title):
        title = defined(title)
        if title in known:
            return known[title]
        if title in open_calls:
            refuse("a chain of calls has no end: " + " -> ".join(open_calls + [title]))
        open_calls.append(title)
        if title == "__indirect_call":
            deepest, own = targets, 0
        else:
            deepest, own = calls.get(title, ()), own_bytes(title, open_calls[-2] if len(open_calls) > 1 else "nothing")
        known[title] = own + max((depth(callee) for callee in deepest), default=0)
        open_calls.pop()
        return known[title]

    if ROOT not in frame:
        refuse(f"no {ROOT} in these files; give those of all objects of the image")
    print(depth(ROOT))


main(sys.argv[1:])
