#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""./kerf studies ablate: which constants and branches of the contact does a row need?

  --only NAME,...  these of the list [contact] of .ci/mutations.txt; NAME+NAME: both at once   (all)
  --list           the names
  --count          how many named constants the contact has
  --check          only whether each text still stands once in its file and its substitutes compile
  --full           every case of the rows, not a hundredth of them
  --stages N       no stages beyond: 1 walls, rests, slides, shapes; 2 tests of the contact; 3 traps;
                   4 tests of the servo; 5 cutting, isos, edges   (5)
  --jobs N         so many runs at once   (1)
  --again          forget what was measured before
  --page FILE      write what is measured as a page

Rows move by more than 1 % of their limit (of their value where they have none), or get lost. Runs go
from cheap to dear and end after the stage in which a row is lost, or worse by 5 % of its limit. Exit
codes: 0 fine, 2 bad input."""
# One build of a copy of the tree holds all ablations: each text is replaced by (ablated(i) ? off : (text)), and the
# environment says which are off.
import argparse
import concurrent.futures
import datetime
import hashlib
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

import mutate
from mutate import ROOT, TABLE, Wrong, run

WORK = ROOT / "build/ablate"
TREE = WORK / "tree"
STAGES = (1, 2, 3, 4, 5)
SWITCHES = """#pragma once
#include <array>
#include <cstddef>
#include <cstdlib>
#include <type_traits>
namespace kerf {
/// By number, from the environment: "3,17".
inline const std::array<bool, 256> kAblated = [] {
  std::array<bool, 256> off{};
  const char* at = std::getenv("KERF_ABLATED");
  while (at != nullptr && *at != 0) {
    char* end = nullptr;
    off.at(static_cast<std::size_t>(std::strtol(at, &end, 10))) = true;
    at = *end == 0 ? end : end + 1;
  }
  return off;
}();
constexpr bool ablated(std::size_t i) noexcept {
  if (std::is_constant_evaluated()) return false;
  return kAblated[i];
}
}  // namespace kerf
"""


def switched(number, old, off):
    """The text that can be turned off. A constant is read when the program begins: `ablated` would say to the compiler, which
    tries to know it, that it is not off."""
    if "constexpr" not in old:
        return f"(ablated({number}) ? {off} : ({old}))"
    name, _, value = old.partition(" = ")
    name = name.replace("static constexpr", "static inline const") if "static constexpr" in name else name.replace("constexpr", "const")
    return f"{name} = (kAblated[{number}] ? {off} : {value})"


def with_switches(ablations):
    """The files in which each ablation can be turned off: path and content."""
    contents = {}
    for number, ablation in enumerate(ablations):
        ((file, old, off),) = ablation.edits
        text = contents.setdefault(file, (ROOT / file).read_text())
        if text.count(old) != 1:
            raise Wrong(f"{ablation.name}: {file}: '{old}' stands there {text.count(old)} times, not once; correct {TABLE}")
        contents[file] = text.replace(old, switched(number, old, off))
    return {file: text.replace("#include", '#include "ablated.hpp"\n#include', 1) for file, text in contents.items()}


def check(ablations):
    """Compiles the file that holds the whole contact, and each source of the list, with all switches in."""
    changed = with_switches(ablations)
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for file in mutate.tracked():
            if re.match(r"(controller/.*\.[ch]pp|(shared|include)/.*\.hpp)$", file):
                (folder / file).parent.mkdir(parents=True, exist_ok=True)
                (folder / file).write_text(changed.get(file) or (ROOT / file).read_text())
        (folder / "ablated.hpp").write_text(SWITCHES)
        for file in sorted({"controller/servo/contact_force.cpp", *(f for f in changed if f.endswith(".cpp"))}):
            code, text = run([os.environ.get("CXX", "c++"), "-std=c++20", "-I", folder, "-S", "-o", "/dev/null", folder / file],
                             folder / "log")
            if code:
                raise Wrong(f"{TABLE}: {file}: does not compile: {mutate.first_error(text)}")
    print(f"ablate: {len(ablations)} texts stand once each and compile")


def write_if_new(path, content):
    if not path.is_file() or path.read_text() != content:
        path.write_text(content)


def build(ablations, stages):
    changed = {**with_switches(ablations), "ablated.hpp": SWITCHES}
    for file in mutate.tracked():
        (TREE / file).parent.mkdir(parents=True, exist_ok=True)
        mine = TREE / file
        if file not in changed and (not mine.is_file() or mine.read_bytes() != (ROOT / file).read_bytes()):
            shutil.copy(ROOT / file, mine)
    for file, content in changed.items():
        write_if_new(TREE / file, content)
    targets = ["kerf-studies", "test_proxy", "test_point_shell"] + ["test_servo"] * (stages > 3)
    print(f"ablate: building {TREE}", file=sys.stderr)
    ccache = ["-DKERF_CCACHE=ON"] if os.environ.get("CCACHE_BASEDIR") else []
    for command in (["cmake", "--preset", "release", *ccache, "--log-level=ERROR"], ["ninja", "-C", "build/release", *targets]):
        code, text = run(command, WORK / "build.log", cwd=TREE)
        if code:
            raise Wrong(f"{TREE}: does not build ({WORK}/build.log): {mutate.first_error(text)}")


def rows_of(value):
    """Each measured row of a report, wherever it lies: ((group, name), (value, limit))."""
    if isinstance(value, dict) and {"group", "name", "value", "pass"} <= value.keys():
        if value["value"] is not None:
            yield (value["group"], value["name"]), (float(value["value"]), value.get("limit"))
    for part in value.values() if isinstance(value, dict) else value if isinstance(value, list) else ():
        yield from rows_of(part)


class Runs:
    def __init__(self, ablations, full, stages, folder):
        self.number = {ablation.name: i for i, ablation in enumerate(ablations)}
        self.full, self.stages, self.folder = full, stages, folder
        self.before = {}

    def measure(self, off, stage):
        """The rows of a stage with these ablations off."""
        with tempfile.TemporaryDirectory(dir=WORK) as name:
            here = pathlib.Path(name)
            environment = ["env", "KERF_ABLATED=" + ",".join(map(str, off))]

            def lab(groups):
                quick = [] if self.full else ["--quick"]
                code, _ = run([*environment, "build/release/bin/kerf-studies", "extremes", *quick, "--only", groups, "--report",
                               here / "report.json"], here / "log", cwd=TREE, timeout=900)
                if code > 1 or code < 0:
                    return {("runs", f"{groups} end with {code}"): (1.0, 0)}
                return dict(rows_of(json.loads((here / "report.json").read_text())))

            def tests(test, *options):
                code, text = run([*environment, f"build/release/bin/{test}", "-tce=*Floating*", *options], here / "log", cwd=TREE,
                                 timeout=300)
                # A failed case names itself above its first error; a crash may leave none.
                failed, case = [], None
                for line in text.splitlines():
                    if line.startswith("TEST CASE:"):
                        case = re.sub("<.*", "", line[len("TEST CASE:"):]).strip()
                    elif " ERROR: " in line and case not in failed:
                        failed.append(case)
                names = failed or [f"ends with {code}"]
                return {("test " + test.removeprefix("test_"), name): (1.0, 0) for name in names} if code else {}

            # Tests that state the rules themselves would only say that they were turned off.
            if stage == 1:
                return lab("walls,rests,slides,shapes")
            if stage == 2:
                return {**tests("test_proxy", "-sfe=*constraint_set_test*,*curvature_test*,*cap_test*,*jam_test*"),
                        **tests("test_point_shell")}
            if stage == 3:
                return lab("traps")
            if stage == 4:
                return tests("test_servo")
            return {**lab("cutting,isos,edges"), **tests("test_proxy", "-sf=*jam_test*")}

    def as_it_is(self):
        file = self.folder / ".none.json"
        if not file.exists():
            rows = [[*key, *row] for stage in STAGES[:self.stages] for key, row in self.measure([], stage).items()]
            file.write_text(json.dumps(rows))
        self.before = {(group, name): value for group, name, value, _ in json.loads(file.read_text())}

    def changes(self, rows):
        """Rows that move: state, badness, group, name, before, after, limit; the worst first."""
        moved = []
        for key, (after, limit) in rows.items():
            before = self.before.get(key, 0.0)
            scale = (limit if limit and limit > 0 else abs(before)) or 1
            move = (after - before) / scale
            was, now = limit is None or before <= limit, limit is None or after <= limit
            if was == now and abs(move) < 0.01:
                continue
            state = ("lost" if was and not now else "won" if now and not was else "other" if limit is None else
                     "worse" if move > 0 else "better")
            rank = {"lost": 1000, "worse": 100, "other": 0}.get(state, -100)
            moved.append((state, rank + min(move, 99), *key, before, after, limit))
        return sorted(moved, key=lambda change: -change[1])

    def of(self, name):
        """Measures with these off, unless it is known."""
        file = self.folder / f"{name}.json"
        if not file.exists():
            rows, moved = {}, []
            for stage in STAGES[:self.stages]:
                rows.update(self.measure([self.number[part] for part in name.split("+")], stage))
                moved = self.changes(rows)
                if needs_it(moved):
                    break
            file.write_text(json.dumps(moved))
            print(summary(name, moved), flush=True)
        return json.loads(file.read_text())


def needs_it(moved):
    """A row is lost, or worse by 5 % of its limit."""
    return any(change[0] == "lost" or change[0] == "worse" and change[1] >= 100.05 for change in moved)


def counts(moved):
    states = [change[0] for change in moved]
    return states.count("lost"), states.count("worse"), states.count("better") + states.count("won")


def summary(name, moved):
    line = "{:<24} {:2} lost {:2} worse {:2} better  ".format(name, *counts(moved))
    if moved:
        state, _, group, row, before, after, limit = moved[0]
        line += f"{state}: {group}, {row}: {before:.4g} -> {after:.4g} (limit {'-' if limit is None else limit})"
    return line


def constants():
    """How many the contact names."""
    files = [f for folder in ("proxy", "point_shell") for f in (ROOT / "controller/kernel" / folder).rglob("*") if f.is_file()]
    return sum(len(re.findall(r"\bk[A-Z][A-Za-z]* =", line)) for f in files for line in f.read_text().splitlines()
               if "constexpr" in line)


def page(ablations, names, runs, options):
    of = {ablation.name: ablation for ablation in ablations}
    compiler = subprocess.run([os.environ.get("CXX", "c++"), "--version"], capture_output=True, text=True).stdout.split("\n")[0]
    commit = mutate.output_of("git", "rev-parse", "--short", "HEAD").strip()
    lines = [f"""# Ablation

Made by `./kerf studies ablate --page {options.page}`; nothing is typed by hand. Each constant and each branch of the swept
contact (`{TABLE}`) is turned off alone; A+B: both at once. Then these are run, from cheap to dear, and
what comes after a stage that loses a row is left out, so more rows may get lost than are shown:

1. `kerf-studies extremes{'' if options.full else ' --quick'}`: walls, rests, slides and shapes
2. the tests of proxy and point shell, in fixed point; a failed one counts as a lost row
3. traps
4. the tests of the servo
5. cutting, isos, edges, and the test of a tool that turns askew in a tight hollow

Here up to stage {options.stages}. A row moves by more than 1 % of its limit. What is needed loses one, or
makes one worse by 5 % of its limit or more.

{datetime.date.today()}, commit {commit}, {compiler}. The contact has
{constants()} named constants (`./kerf studies ablate --count`).

| off | in | means | rows that move, the worst first | verdict |
|---|---|---|---|---|"""]
    for name in names:
        moved, ablation = runs.of(name), of[name.split("+")[0]]
        cell = "; ".join(
            f"{group}, {row}: {before:.4g} to {after:.4g}" + ("" if limit is None else f", limit {limit}") + " **lost**" * (state == "lost")
            for state, _, group, row, before, after, limit in moved[:2] if state != "better")
        number = "{} lost, {} worse, {} better".format(*counts(moved)) if moved else "none"
        verdict = ("needed: a row is lost" if counts(moved)[0] else "needed: a row is worse" if needs_it(moved) else
                   f"stays: {ablation.object}" if ablation.object else "no row needs it")
        lines.append(f"| {name} | {ablation.edits[0][0].removeprefix('controller/')} | "
                     f"{'both' if '+' in name else ablation.catcher} | {number}{': ' * bool(cell)}{cell} | {verdict} |")
    return "\n".join(lines) + "\n"


def main():
    if {"-h", "--help"} & set(sys.argv[1:]):
        print(__doc__)
        return
    parser = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    parser.error = lambda message: (_ for _ in ()).throw(Wrong(f"{message}; see --help"))
    for flag in ("list", "count", "check", "full", "again"):
        parser.add_argument("--" + flag, action="store_true")
    parser.add_argument("--only", default="")
    parser.add_argument("--jobs", default="1")
    parser.add_argument("--stages", default="5")
    parser.add_argument("--page")
    options, unknown = parser.parse_known_args()
    if unknown:
        raise Wrong(f"{unknown[0]}: unknown; see --help")
    for name, least_and_most, good in (("jobs", "1 to 99", "[1-9][0-9]?"), ("stages", "1 to 5", "[1-5]")):
        value = getattr(options, name)
        if not re.fullmatch(good, value):
            raise Wrong(f"--{name} {value}: not {least_and_most}; take {parser.get_default(name)}")
        setattr(options, name, int(value))
    ablations = [mutation for mutation in mutate.read_table() if mutation.list == "contact"]
    if options.list:
        print("\n".join(ablation.name for ablation in ablations))
    elif options.count:
        print(constants())
    elif options.check:
        check(ablations)
    else:
        names = options.only.split(",") if options.only else [ablation.name for ablation in ablations]
        known = {ablation.name for ablation in ablations}
        for part in (part for name in names for part in name.split("+")):
            if part not in known:
                raise Wrong(f"--only {part}: unknown; see --list")
        try:
            if options.page:
                open(options.page, "a").close()
        except OSError:
            raise Wrong(f"--page {options.page}: cannot be written; name another") from None
        total = hashlib.sha256(repr([ablation.edits for ablation in ablations]).encode())
        for file in mutate.tracked():
            if file.split("/")[0] in ("controller", "lab", "shared", "tests"):
                total.update((ROOT / file).read_bytes())
        folder = WORK / f"{'full-' * options.full}{options.stages}-{total.hexdigest()[:12]}"
        if options.again:
            shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True, exist_ok=True)
        build(ablations, options.stages)
        runs = Runs(ablations, options.full, options.stages, folder)
        runs.as_it_is()
        with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
            list(pool.map(runs.of, names))
        if options.page:
            pathlib.Path(options.page).write_text(page(ablations, names, runs, options))


if __name__ == "__main__":
    try:
        main()
    except Wrong as wrong:
        print(f"ablate: {wrong}", file=sys.stderr)
        sys.exit(2)
