# SPDX-License-Identifier: Apache-2.0
"""Turns the JSON of a command into a page (Markdown) or a plot (SVG):

    python3 lab/report SUBJECT KIND [ARG...] <JSON >PAGE-OR-PLOT
    python3 lab/report check                   whether plots can be drawn here

The commands of kerf run it for --page, --plot, --svg and --portraits; it writes no file. The head of each subject's module
has the form of its JSON. A page needs Python alone, a plot matplotlib too. The same input gives the same bytes. Exit code
2 and one line on standard error: the input or the set-up is wrong."""
import difflib
import importlib
import importlib.util
import json
import os
import sys

from text import BadInput

# Subject and kind: the function KIND of the module SUBJECT, and whether it draws.
KINDS = {
    ("recording", "forces"): True, ("recording", "replay"): True,
    ("burs", "sheet"): True,
    ("kernels", "page"): False,
    ("energy", "page"): False, ("energy", "tables"): False,
    ("pictures", "page"): False, ("pictures", "tables"): False,
    ("accuracy", "page"): False, ("accuracy", "plot"): True,
    ("contact", "page"): False, ("contact", "plot"): True, ("contact", "hands"): True,
    ("impedance", "plot"): True,
    ("stability", "measure"): False, ("stability", "page"): False, ("stability", "devices"): True,
    ("stability", "rates"): True,
    ("reproduce", "measure"): False, ("reproduce", "tables"): False, ("reproduce", "page"): False,
    ("reproduce", "regions"): True, ("reproduce", "energy"): True,
    ("stability_map", "map"): True, ("stability_map", "portraits"): True,
}
DEBIAN = "/usr/bin/python3"  # it has Debian's matplotlib, if another Python comes first in PATH


def need_matplotlib():
    if importlib.util.find_spec("matplotlib"):
        return
    if os.path.exists(DEBIAN) and os.path.realpath(sys.executable) != os.path.realpath(DEBIAN):
        os.execv(DEBIAN, [DEBIAN, "-B", *sys.argv])
    raise BadInput("python3: no matplotlib, which draws the plots; apt-get install python3-matplotlib")


def run(words):
    if words == ["check"]:
        need_matplotlib()
        return ""
    draws = KINDS.get(tuple(words[:2]))
    if draws is None:
        wanted = " ".join(words[:2]) or "nothing"
        near = difflib.get_close_matches(wanted, map(" ".join, KINDS), 1, 0)[0]
        raise BadInput(f"lab/report: {wanted}: unknown; did you mean {near}? The head of {__file__} lists all")
    if draws:
        need_matplotlib()
    name = f"lab/report: {words[0]} {words[1]}"
    try:
        data = json.load(sys.stdin)
        return getattr(importlib.import_module(words[0]), words[1])(data, *words[2:])
    except json.JSONDecodeError as error:
        raise BadInput(f"{name}: no JSON ({error}); give the JSON of its command") from None
    except KeyError as error:
        raise BadInput(f"{name}: no {error} in the JSON; give that of the command itself, of this version") from None
    except (AttributeError, IndexError, TypeError, ValueError) as error:
        raise BadInput(f"{name}: JSON of another form ({error}); give that of the command itself") from None


def main():
    try:
        text = run(sys.argv[1:])
        sys.stdout.reconfigure(encoding="utf-8")
        sys.stdout.write(text)
        sys.stdout.flush()
    except (BadInput, OSError) as error:
        print(str(error).replace("\n", " "), file=sys.stderr)
        sys.exit(2)


if __name__ == "__main__":
    main()
