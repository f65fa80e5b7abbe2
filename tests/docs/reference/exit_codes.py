# SPDX-License-Identifier: Apache-2.0
"""a section of docs/reports.md: how each program ends, by the last words of its --help."""
import re

from source import Lack, same, table

# Programs whose --help says nothing of them, and when they end with 1.
SILENT = {
    "kerf-arm": "never",
    "kerf-bridge": "never",
    "kerf-emulator": "never",
    "kerf-recorder": "with `--strict`: ticks were lost; with `--flight`: a recording could not be written",
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
    rows.insert(0, ("`./kerf`", "a check failed; for a demo: one of its programs failed or crashed", "bad input or set-up"))
    return f"""## Exit codes

Exit code 0 means success. With exit code 2 a program prints one line on the standard error: location, value, remedy.

{table(("program", "1", "2"), rows)}

`./kerf` with the short name of a program has the exit code of that program. Other exit codes are:

| code | reason |
|---|---|
| 77 | the machine has not all that a command or a test needs, such as network namespaces for `./kerf demo --two-machines` |
| 130 | Ctrl-C: `./kerf demo` ended after the motors went off and the report was written; `kerf-lab sweep` or `kerf-lab zwidth` ended and kept the finished part |
| 143 | another signal, such as SIGTERM, ended the command |
"""
