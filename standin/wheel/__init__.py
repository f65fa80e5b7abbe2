# SPDX-License-Identifier: Apache-2.0
"""The command kerf-standin of the wheel (docs/stand-ins.md): `./kerf stand-in` without a clone.

Beside this file: program/ (./kerf stand-in itself), bin/ (the emulator), lib/, include/, faults/ (scripts for --fault)."""
import importlib
import importlib.metadata
import os
import pathlib
import re
import sys

HERE = pathlib.Path(__file__).resolve().parent
CALLED = "kerf-standin"


def main():
    words = sys.argv[1:]
    own = words[:words.index("--")] if "--" in words else words
    if not words or "--help" in own or "-h" in own:
        text = (HERE / "help.txt").read_text(encoding="utf-8").replace("./kerf stand-in", CALLED)
        print(re.sub(r"\bhil/(?=faults/)", f"{HERE}/", text) +
              f"\n  --where            prints the folder with include/, lib/ and faults/\n  --version")
    elif own == ["--version"]:
        print(CALLED, importlib.metadata.version(CALLED))
    elif own == ["--where"]:
        print(HERE)
    else:
        sys.path.insert(0, str(HERE / "program"))
        program = importlib.import_module("kerf_standin.program.__main__")
        program.CALLED = CALLED
        return program.main([HERE / "bin", HERE / "lib", *words])
    return 0


def exit_with_main():
    try:
        sys.exit(main())
    except BrokenPipeError:  # whoever reads the help reads no further
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(0)
