#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The deepest stack of an image, from the compiler's own figures: the costliest chain of calls from `kerf_start`, by the
frames that gcc writes with -fcallgraph-info=su. Prints bytes; exit code 2 for a chain without an end.

    stack_bound.py FILE.ci...

A call through a pointer counts as the deepest function that the loop can reach so: a kernel of sets/scalar.cpp, or the
step of a law (kerf_law_...). Functions of libgcc and newlib count LIBRARY_BYTES each; they call nothing of ours.
"""
import re
import sys

LIBRARY_BYTES = 128  # memcpy saves 3 registers, a division of 64 bits at most 12
ROOT = "kerf_start"


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
                sys.exit(f"stack_bound: {title}: its frame has no bound; give its array a constant size")
            frame[title] = max(frame.get(title, 0), int(size[1]))
            if path.endswith("sets/scalar.cpp.ci") or title.startswith("kerf_law_"):
                targets.add(title)
        for source, target in re.findall(r'edge: { sourcename: "([^"]*)" targetname: "([^"]*)"', text):
            calls.setdefault(name(source), set()).add(name(target))

    known, open_calls = {}, []

    def depth(title):
        if title in known:
            return known[title]
        if title in open_calls:
            print("stack_bound: a chain of calls has no end: " + " -> ".join(open_calls + [title]), file=sys.stderr)
            sys.exit(2)
        open_calls.append(title)
        if title == "__indirect_call":
            deepest, own = targets, 0
        else:
            deepest, own = calls.get(title, ()), frame.get(title, LIBRARY_BYTES)
        known[title] = own + max((depth(callee) for callee in deepest), default=0)
        open_calls.pop()
        return known[title]

    if ROOT not in frame:
        sys.exit(f"stack_bound: no {ROOT} in these files; give those of all objects of the image")
    print(depth(ROOT))


main(sys.argv[1:])
