# SPDX-License-Identifier: Apache-2.0
"""a section of docs/reports.md: how each program ends, by the last words of its --help."""
import re

from source import Lack, same, table

# Programs whose --help says nothing of them, and when they end with 1.
SILENT = {
    "kerf-arm": "never",
    "kerf-bridge": "never",
    "kerf-emulator": "never",
    "kerf-recorder": "`--strict`, and ticks were lost; `--flight`, and a recording could not be written",
    "kerf-volume": "never",
}


def section(root, programs):
    rows, silent = [], []
    for name in programs.names():
        told = re.search(r"^Exit codes: 0 fine, 1 (.*), 2 (bad input or set-up.*)\.$", programs.help(name), re.M)
        if told:
            rows.append((f"`{name}`", told[1], told[2]))
        else:
            silent.append(name)
            rows.append((f"`{name}`", SILENT.get(name, ""), "bad input or set-up"))
        done = programs.run(name, "--no-such-option")
        if done != 2 or programs.run(name, "--help") != 0:
            raise Lack(f"{name}: ends with {done} where an option is wrong")
    same("programs without exit codes in --help", SILENT, silent)
    kerf = programs.said(root / "kerf", "--help")
    if "Every command exits with 0: fine; 1: ran, and a check failed; 2: bad input or set-up." not in kerf:
        raise Lack("./kerf --help: other words about exit codes; tests/docs/reference has to follow")
    rows.insert(0, ("`./kerf`", "ran, and a check failed; of a demo: a program of it did", "bad input or set-up"))
    return f"""## Exit codes

0: fine. With 2 comes one line on the standard error: location, value, way out.

{table(("program", "1", "2"), rows)}

`./kerf` with the short name of a program ends as that program does. Also:

| code | when |
|---|---|
| 77 | the machine lacks what a command or a test needs, such as network namespaces for `./kerf demo --two-machines` |
| 130 | `./kerf demo` was interrupted (Ctrl-C), after the motors went off and the report was written; so was `kerf-lab sweep` or `kerf-lab zwidth`, and what was done is kept |
| 143 | it was told to end |
"""
