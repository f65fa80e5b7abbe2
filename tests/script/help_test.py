#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The help that ./kerf has of programs and commands before they are built, against their own:  help_test.py ROOT BIN check|write

Of programs, cli/help/kerf-NAME.txt is what NAME --help and the --help of each of its commands print; `write` makes it anew. Of
./kerf demo and ./kerf stand-in, their help has exactly the options that their Python takes, with a value or without. The first
screen lists the commands of bench and of the lab as their own help does."""
import pathlib
import re
import subprocess
import sys

root, bin_folder, what = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve(), sys.argv[3]
pages = root / "cli" / "help"
wrong = []


def said(*command):
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip("\n")


def stored_form(program):
    """Its help and that of its commands, each behind a line that ./kerf looks for."""
    own = said(program, "--help")
    commands = re.findall(r"^  ([a-z][a-z-]*)  ", own.partition("\nSubcommands:\n")[2].partition("\n\n")[0], re.M)
    parts = [f"## {program.name}\n{own}\n"] + [f"## {program.name} {one}\n{said(program, one, '--help')}\n" for one in commands]
    assert not any(re.search("^## ", part[3:], re.M) for part in parts), program
    return "".join(parts)


def options_of_help(name):
    """{option: takes a value}, as cli/help.sh reads them."""
    script = (f'root={root} me=./kerf; shopt -s extglob; . {root}/cli/help.sh; read_help {name}; '
              'for one in "${!takes[@]}"; do echo "$one" ${takes[$one]:+value}; done')
    return {words[0]: len(words) > 1 for words in map(str.split, said("bash", "-c", script).splitlines())}


programs = sorted(path for path in bin_folder.glob("kerf-*"))
for program in programs:
    page = pages / (program.name + ".txt")
    if what == "write":
        page.write_text(stored_form(program), encoding="utf-8")
    elif not page.exists() or page.read_text(encoding="utf-8") != stored_form(program):
        wrong.append(f"cli/help/{page.name}: is not what {program.name} --help prints; "
                     "tests/script/help_test.py . build/release/bin write")
for page in pages.glob("kerf-*.txt"):
    if what == "check" and not (bin_folder / page.stem).exists():
        wrong.append(f"cli/help/{page.name}: is of no program; remove it")

# The first screen and the help of bench and lab list the same commands.
first = (pages / "kerf.txt").read_text(encoding="utf-8")
for name, begin in (("bench", "\nCommands:\n"), ("kerf-lab", "\nSubcommands:\n")):
    its_own = re.findall(r"^  ([a-z][a-z-]*)  ", (pages / f"{name}.txt").read_text(encoding="utf-8").partition(begin)[2].partition("\n\n")[0], re.M)
    shown = re.search(rf"^  \./kerf {name.removeprefix('kerf-')} .*: (.*)$", first, re.M)
    if not shown or shown[1].split() != its_own:
        wrong.append(f"cli/help/kerf.txt: does not list the commands of {name}.txt: {' '.join(its_own)}")

sys.path.insert(0, str(root / "demo"))
import options  # noqa: E402

taken = {**{name: False for name in options.FLAGS}, **{name: True for name in options.WITH_VALUE}}
if options_of_help("demo") != taken:
    wrong.append(f"cli/help/demo.txt and demo/options.py differ in {set(options_of_help('demo').items()) ^ set(taken.items())}")
source = (root / "standin" / "options.py").read_text(encoding="utf-8")
taken = {name: True for name in re.findall(r'"(--[a-z-]+)"', re.search(r"^WITH_VALUE = \((.*?)\)", source, re.M | re.S)[1])}
taken |= {"--" + name: False for name in re.findall(r"^            options\.([a-z]+) = True", source, re.M)}
if options_of_help("stand-in") != taken:
    wrong.append(f"cli/help/stand-in.txt and standin/ differ in {set(options_of_help('stand-in').items()) ^ set(taken.items())}")

# Each command of the script has a page and stands on the first screen, and each page is one of a command.
script = (root / "kerf").read_text(encoding="utf-8")
cases = set(re.findall(r"^  ([a-z][a-z-]*)\)", script.rpartition("\ncase $command in\n")[2], re.M)) - {"help", "lab", "studies"}
first = (pages / "kerf.txt").read_text(encoding="utf-8")
shown = set(re.findall(r"^  \./kerf ([a-z-]+) ", first, re.M)) - {"lab"}  # a program
have = {page.stem for page in pages.glob("*.txt") if not page.stem.startswith("kerf")} | {"sweep"}  # of kerf-lab
if not cases == shown == have:
    wrong.append(f"commands: {sorted(cases)} in ./kerf, {sorted(shown)} on the first screen, {sorted(have)} with a page")
installed = re.search(r"^set\(programs (.*)\)", (root / "cmake" / "install.cmake").read_text(encoding="utf-8"), re.M)[1]
known = {name.removeprefix("kerf-") for name in [*installed.split(), "kerf-bridge", "kerf-visualizer"]}
if set(re.search(r"any program: (.*)", first)[1].split()) != known:
    wrong.append(f"the first screen has not the programs {sorted(known)}")
if len(first.splitlines()) > 20:
    wrong.append(f"the first screen has {len(first.splitlines())} lines, more than 20")
print("\n".join(wrong) or f"help: {len(programs)} programs, {len(have)} commands")
sys.exit(bool(wrong) or len(programs) < 9)
