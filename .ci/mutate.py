#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Is every rule watched by a test? Breaks the source at one point at a time, as .ci/mutations.txt says, and demands that
the check or test named there notices. Nothing in the tree is touched.

    .ci/mutate.py LIST [PATTERN] [--jobs N] [--again]
        LIST: safety, kernels, devices, arms, includes, page or resets (.ci/resets.py); PATTERN picks the mutations whose line matches. One line for each mutation: what
        caught it, SURVIVED, or the instruction set that this processor lacks. A run that is stopped goes on where it was, unless a source changed; --again starts anew.
    .ci/mutate.py --check
        only whether each text stands exactly once in its file, each test case in the folder of its program, and each safety
        rule in docs/safety.md

The list contact is for .ci/ablate.py, which measures what each constant of the contact is worth.

Exit codes: 0 each mutation is caught, 1 one survived, 2 a line or the set-up is wrong.

A mutation that names an object breaks the release build: that object alone is compiled again, without optimisation, and
linked before the libraries that hold the right one. One that names none is made in a copy of the tree and built there."""
import argparse
import concurrent.futures
import contextlib
import dataclasses
import fnmatch
import functools
import hashlib
import os
import pathlib
import platform
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading

import resets

ROOT = pathlib.Path(__file__).resolve().parent.parent
TABLE = ".ci/mutations.txt"
BUILD = ROOT / "build/release"
LISTS = ("safety", "kernels", "devices", "arms", "includes", "page", "contact")
PAGE_TEST = "tests/web/script_test.py"


# What controller/kernel/kernel_set.cpp asks of the processor for each set.
SETS = {"avx2": {"avx2"}, "avx512": {"avx512f", "avx512bw", "avx512vl", "avx512dq", "avx512_vnni"}}

RUNNING = set()  # processes, which end with this one


class Wrong(Exception):
    """A line of the table or the set-up is wrong: one line says which and what to do."""


@dataclasses.dataclass
class Mutation:
    list: str
    name: str
    edits: list  # of (file, old, new); an empty `old` adds `new` as the last line, to a new file too
    catcher: str
    object: str = ""  # regular expression: which object of the release build holds what is broken

    def lacking(self):
        """The instruction set of the changed file, if this processor lacks it or it is hidden: its tests then cannot notice."""
        stem = pathlib.Path(self.edits[0][0]).stem
        hidden = stem in os.environ.get("KERF_HIDE_SETS", "").split(",")
        return stem if stem in SETS and (hidden or not SETS[stem] <= processor_flags()) else ""

    def contents(self, root):
        """The changed files: path and new content."""
        changed = {}
        for file, old, new in self.edits:
            path = root / file
            if file not in changed:
                if old and not path.is_file():
                    raise Wrong(f"{self.name}: no file {file}; correct {TABLE}")
                changed[file] = path.read_text() if path.is_file() else ""
            if not old:
                changed[file] += new + "\n"
                continue
            found = changed[file].count(old)
            if found != 1:
                raise Wrong(f"{self.name}: {file}: '{old}' stands there {found} times, not once; correct {TABLE}")
            changed[file] = changed[file].replace(old, new)
        return changed

    def key(self):
        return hashlib.sha256(repr(self).encode()).hexdigest()[:12]


def read_table():
    mutations, part = [], None
    for line in (ROOT / TABLE).read_text().splitlines():
        if not line or line.startswith("#"):
            continue
        if line.startswith("["):
            part = line.strip("[]")
            if part not in LISTS:
                raise Wrong(f"{line}: no list of that name; there are {', '.join(LISTS)}")
            continue
        fields = [field.replace("\\n", "\n") for field in line.removeprefix("  ").split(" @ ")]
        if line.startswith(" ") and len(fields) == 3 and mutations:
            mutations[-1].edits.append(tuple(fields))
        elif part and len(fields) in (5, 6):
            name, file, old, new, *caught = fields
            mutations.append(Mutation(part, name, [(file, old, new)], *caught))
        else:
            raise Wrong(f"{line}: not five or six parts; correct {TABLE}")
    return mutations


def test_cases(program):
    """The names of the test cases of a program, in lower case, as a set. Looked for in the folders whose CMakeLists.txt makes
    it; another program of the same folder may have them."""
    makes = re.compile(rf"kerf_test\(NAME {program.removeprefix('test_')}\b|add_executable\({program}\b")
    lists = [file for top in ("tests", "standin") for file in (ROOT / top).rglob("CMakeLists.txt") if makes.search(file.read_text())]
    name = re.compile(r'TEST_CASE(?:_TEMPLATE|_FIXTURE)?\([^"()]*((?:"(?:[^"\\]|\\.)*"\s*)+)')
    found = [name.findall(file.read_text()) for made in lists for file in made.parent.rglob("*.[ch]pp")]
    return {re.sub(r'"\s*"', "", text.strip())[1:-1].replace('\\"', '"').lower() for texts in found for text in texts}


def check(mutations):
    page = (ROOT / "docs/safety.md").read_text()
    names = set()
    cases = {}  # program: names
    for mutation in mutations:
        if mutation.name in names:
            raise Wrong(f"{mutation.name}: stands twice in {TABLE}; rename one")
        names.add(mutation.name)
        if mutation.list != "contact" and not re.match(rf"test_|\.ci/|{PAGE_TEST}: |(omni|falcon|woodenhaptics|inverse3|touch|omega) ", mutation.catcher):
            raise Wrong(f"{mutation.name}: '{mutation.catcher}' is no test, check or fault script; correct {TABLE}")
        program, _, pattern = mutation.catcher.partition(" ")
        if mutation.object and program.startswith("test_"):
            if program not in cases:
                cases[program] = test_cases(program)
            if not all(fnmatch.filter(cases[program], one.lower()) for one in pattern.split(",")):
                raise Wrong(f"{mutation.name}: '{mutation.catcher}' names no test case of {program}; correct {TABLE}")
        if mutation.list == "safety" and f"`{mutation.name}`" not in page:
            raise Wrong(f"{mutation.name}: stands nowhere in docs/safety.md; name its rule there")
        mutation.contents(ROOT)


def run(command, log, cwd=ROOT, timeout=None, **variables):
    """Runs a command (a list, or a line for the shell); returns its exit code, 124 after the time-out, and its output."""
    with open(log, "wb") as out:
        process = subprocess.Popen(command, cwd=cwd, shell=isinstance(command, str), stdin=subprocess.DEVNULL, stdout=out,
                                   stderr=subprocess.STDOUT, start_new_session=True, env={**os.environ, **variables})
        RUNNING.add(process)
        try:
            code = process.wait(timeout)
        except subprocess.TimeoutExpired:
            code = 124
        finally:
            end(process)
            RUNNING.discard(process)
    return code, pathlib.Path(log).read_text(errors="replace")


def end(process):
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def output_of(*command):
    return subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout


@functools.cache
def processor_flags():
    """As Linux names them; none on another architecture."""
    found = re.search(r"^flags\s*:(.*)", pathlib.Path("/proc/cpuinfo").read_text(), re.MULTILINE)
    return set(found[1].split()) if found else set()


def tracked():
    return [f for f in output_of("git", "ls-files", "-z", "--cached", "--others", "--exclude-standard").split("\0")
            if f and (ROOT / f).is_file()]


def copy_tree(to):
    for file in tracked():
        (to / file).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / file, to / file)


def failed_case(code, text):
    """The test case above the first error of a doctest log; a crash may leave none."""
    case = None
    for line in text.splitlines():
        if line.startswith("TEST CASE:"):
            case = line[len("TEST CASE:"):].strip()
        elif "ERROR" in line and case:
            return case
    return f"exit code {code}"


def first_error(text):
    return next((line for line in text.splitlines() if re.search("error|undefined", line)), text.strip()[-200:])


class ReleaseObjects:
    """Mutations of one object of the release build, each in a folder of its own."""

    def __init__(self, folder, mutations):
        self.folder = folder
        catchers = sorted({mutation.catcher for mutation in mutations})
        print("mutate: building what notices, as it is", file=sys.stderr)
        if not (BUILD / "build.ninja").exists():
            output_of("cmake", "--preset", "release", "--log-level=ERROR")
        targets = sorted({self.target(catcher) for catcher in catchers})
        code, text = run(["ninja", "-C", str(BUILD), *targets], folder / "build.log")
        if code:
            raise Wrong(f"{BUILD}: does not build: {first_error(text)}")
        self.reads = {}  # object: the files of the tree that it reads
        for line in output_of("ninja", "-C", str(BUILD), "-t", "deps").splitlines():
            if line and not line.startswith(" "):
                files = self.reads.setdefault(line.split(":")[0], set())
            elif line:
                files.add(os.path.relpath(BUILD / line.strip(), ROOT))

    def object_of(self, mutation, file):
        """The object by its name, or by a source file that is joined with others in it; that of a library before a test's."""
        readers = sorted((o for o, files in self.reads.items() if file in files), key=lambda o: (o.startswith("tests/"), o))
        joined = [o for o in readers if any(f.endswith(".cpp") and re.search(mutation.object, f) for f in self.reads[o])]
        return next((o for o in [*(o for o in readers if re.search(mutation.object, o)), *joined]), None)

    @staticmethod
    def target(catcher):
        first = catcher.split()[0]
        return first if first.startswith("test_") else "kerf-lab"

    def noticed(self, program, catcher, log, left_out=-1):
        """What the program finds, with a reset left out if it has switches; nothing if it passes."""
        first, *rest = catcher.split()
        if first.startswith("test_"):
            code, text = run([program, "-tc=" + " ".join(rest), "-aa=1"], log, timeout=200, KERF_LEFT_OUT=str(left_out))
            if re.search(r"test cases: *0 ", text):
                raise Wrong(f"'{catcher}' names no test case; correct {TABLE}")
            return code and failed_case(code, text)
        code, text = run([program, "faults", "--device", first, "--scripts", f"hil/faults/{rest[0]}.toml", "--random", "0",
                          "--seeds", "4", *rest[1:]], log, timeout=300)
        if code == 2:
            raise Wrong(f"'{catcher}' cannot run: {text.strip().splitlines()[-1]}")
        told = re.search(r"^  (?:broken: seed \d+: |(shows nothing): seed \d+: )(.*)", text, re.M)
        return code and (" ".join(filter(None, told.groups())) if told else f"exit code {code}")

    def as_it_is(self, catcher):
        with tempfile.NamedTemporaryFile(dir=self.folder) as log:
            found = self.noticed(str(BUILD / "bin" / self.target(catcher)), catcher, log.name)
        if found:
            raise Wrong(f"'{catcher}' fails without any mutation: {found}; correct that first")

    def caught_by(self, mutation):
        with tempfile.TemporaryDirectory(dir=self.folder) as name:
            here = pathlib.Path(name)
            ((file, content),) = mutation.contents(ROOT).items()
            changed = here / "over" / file
            changed.parent.mkdir(parents=True)
            changed.write_text(content)
            made = self.object_of(mutation, file)
            if not made:
                raise Wrong(f"{mutation.name}: no object {mutation.object} of the build reads {file}; correct {TABLE}")
            for command in (self.compile([file], made, here, "changed.o"),
                            self.link(self.target(mutation.catcher), {made: "changed.o"}, here)):
                code, text = run(command, here / "build.log", cwd=BUILD)
                if code:
                    raise Wrong(f"{mutation.name}: does not build: {first_error(text)}")
            return self.noticed(str(here / "program"), mutation.catcher, here / "log")

    @staticmethod
    def compile(files, made, here, out, level="-O0"):
        """The object's own command, with the changed files before those of the tree."""
        command = output_of("ninja", "-C", str(BUILD), "-t", "commands", made).splitlines()[-1]
        source, over = pathlib.Path(command.split(" -c ")[-1]), here / "over"
        if source.is_relative_to(ROOT) and str(source.relative_to(ROOT)) in files:
            source = over / source.relative_to(ROOT)
        elif source != BUILD and BUILD in source.parents:  # files joined into one: the changed ones in their position
            joined = over / f"joined_{out}.cpp"
            text = source.read_text()
            for file in files:
                text = text.replace(f"{ROOT / file}", f"{over / file}")
            joined.write_text(text)
            source = joined
        command = re.sub(f" -I{ROOT}(?= )", f" -I{over} -I{ROOT}", command)
        command = re.sub(r" -O[0-3]", f" {level}", command)
        command = re.sub(r" -Werror| -Winvalid-pch| -fpch-preprocess| -include [^ ]*pch[^ ]*", "", command)
        return f"{command.split(' -MD ')[0]} -o {here}/{out} -c {source}"

    @staticmethod
    def link(target, made, here):
        """The target's own command without the right objects, the keys of `made`, and with the changed ones before all others:
        of what a header defines in several objects, tests among them, the first one counts."""
        commands = output_of("ninja", "-C", str(BUILD), "-t", "commands", f"bin/{target}").splitlines()
        command = [c for c in commands if re.search(f" -o bin/{target}( |$)", c)][-1]
        for right, changed in made.items():
            if right.startswith("tests/") and f" {right} " not in command:
                raise Wrong(f"{target} is not linked of {right}; correct the object in {TABLE}")
            command = re.sub(r"(?= \S+\.o )", lambda _: f" {here}/{changed}", command, count=1).replace(f" {right} ", " ", 1)
        return command.replace(f" -o bin/{target}", f" -o {here}/program", 1)


class TreeCopy:
    """Mutations in copies of the tree, one copy for each job: a check of the text, or tests that are built there."""

    def __init__(self, folder, mutations):
        self.folder, self.mine, self.made = folder, threading.local(), 0
        self.builds = not all(m.catcher.startswith((".ci/", PAGE_TEST)) for m in mutations)

    def tree(self):
        if not hasattr(self.mine, "tree"):
            self.mine.tree = pathlib.Path(tempfile.mkdtemp(dir=self.folder))
            copy_tree(self.mine.tree)
            if self.builds:
                code, text = run(["cmake", "-S", ".", "-B", "build", "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release",
                                  "-DCMAKE_CXX_FLAGS_RELEASE=-O1", "--log-level=ERROR"], self.log(), self.mine.tree)
                if code:
                    raise Wrong(f"cmake: {first_error(text)}")
        return self.mine.tree

    def log(self):
        return self.folder / f"{self.mine.tree.name}.log"

    def as_it_is(self, catcher):
        found = self.noticed(catcher.split(": ")[0], self.tree())
        if found:
            raise Wrong(f"'{catcher}' fails without any mutation: {found}; correct that first")

    def caught_by(self, mutation):
        tree = self.tree()
        changed = mutation.contents(tree)
        for file, content in changed.items():
            (tree / file).parent.mkdir(parents=True, exist_ok=True)
            (tree / file).write_text(content)
        try:
            return self.noticed(mutation.catcher, tree)
        except Wrong as wrong:
            raise Wrong(f"{mutation.name}: {wrong}") from None
        finally:
            for file in changed:
                if (ROOT / file).is_file():
                    (tree / file).write_bytes((ROOT / file).read_bytes())
                    continue
                (tree / file).unlink()
                folder = (tree / file).parent
                while not any(folder.iterdir()):
                    folder.rmdir()
                    folder = folder.parent

    def noticed(self, catcher, tree):
        if catcher.startswith((".ci/", PAGE_TEST)):  # CHECK: what it has to print
            script, _, reason = catcher.partition(": ")
            code, text = run([tree / script], self.log(), tree, timeout=300)
            said = next((line for line in text.splitlines() if reason in line), None)
            return (said or text.strip()) if code and (said or not reason) else None
        tests = catcher.split()
        # The golden hashes see nearly everything and explain nothing, so they come last.
        for which in ("-tce", "-tc"):
            for test in tests:
                code, text = run(["cmake", "--build", "build", "--target", test], self.log(), tree)
                if code and re.search("static assertion failed|non-constant condition", text):
                    return "the compiler: a static assertion"
                if code:
                    raise Wrong(f"does not build: {first_error(text)}")
                code, text = run([f"build/bin/{test}", f"{which}=*known hash*", "-aa=1"], self.log(), tree, timeout=300)
                if code:
                    return failed_case(code, text)
        if platform.machine() == "x86_64":
            objects = sorted(tree.glob("build/**/kerf_kernel_sets.dir/**/*.o"))
            if run([".ci/check-hot-loops.sh", *objects], self.log(), tree)[0]:
                return "check-hot-loops.sh"
        return None


def judge_resets(pattern, jobs):
    """Leaves out each reset of .ci/resets.txt in turn; returns how many survived. One program after the other is linked of objects
    with a switch at each."""
    survived = tried = 0
    for program, sources in read_resets().items():
        mine = sources.states
        chosen = [(number, r) for number, r in enumerate(sources.resets)
                  if re.search(pattern, f"{r.name} {r.file} {r.state.cases}") and not r.untried()]
        if not chosen:
            continue
        with tempfile.TemporaryDirectory(prefix="kerf-resets.") as name, ending(concurrent.futures.ThreadPoolExecutor(jobs)) as pool:
            here = pathlib.Path(name)
            release = ReleaseObjects(here, [Mutation("resets", program, [], f"{program} {mine[0].cases}")])
            build_switched(release, program, sources, mine, here)

            def notice(number, reset):
                return release.noticed(str(here / "program"), f"{program} {reset.state.cases}", here / f"{number}.log", number)

            for cases in sorted({reset.state.cases for _, reset in chosen}):
                if found := notice(-1, next(r for _, r in chosen if r.state.cases == cases)):
                    raise Wrong(f"'{program} {cases}' fails with nothing left out: {found}; correct that first")
            futures = {pool.submit(notice, number, reset): reset for number, reset in chosen}
            for future in concurrent.futures.as_completed(futures):
                reset, caught = futures[future], future.result()
                tried, survived = tried + 1, survived + (not caught)
                print(f"{reset.name:<34} {reset.file}:{reset.line:<5} {caught or 'SURVIVED'}", flush=True)
    if not tried:
        raise Wrong(f"{pattern}: no reset matches")
    print(f"mutate: resets: {tried} resets left out, {survived} survived")
    return survived


def read_resets():
    try:
        return resets.read_programs(ROOT)
    except ValueError as wrong:
        raise Wrong(wrong) from None


def build_switched(release, program, sources, states, here):
    for file, text in sources.changed.items():
        (here / "over" / file).parent.mkdir(parents=True, exist_ok=True)
        (here / "over" / file).write_text(text)
    made = {}
    for file in sources.changed:
        for wanted in sorted({wanted for state in states for wanted in state.objects}):
            found = release.object_of(Mutation("", "", [], "", wanted), file)
            if found and found not in made:
                made[found] = f"{len(made)}.o"
    commands = [release.compile(list(sources.changed), right, here, changed, "-O1") for right, changed in made.items()]
    for command in (*commands, release.link(program, made, here)):
        code, text = run(command, here / "build.log", cwd=BUILD)
        if code:
            raise Wrong(f"{program}: does not build with switches: {first_error(text)}")


@contextlib.contextmanager
def ending(pool):
    """If this program is stopped, no process of it goes on."""
    try:
        yield pool
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        for process in list(RUNNING):
            end(process)
        raise
    finally:
        pool.shutdown()


def judge(name, mutations, jobs, again):
    """Tries mutations of one list; returns how many survived."""
    sources = hashlib.sha256()
    for file in tracked():
        if re.search(r"\.([ch]pp|cmake|sh|toml|m?js)$|CMakeLists.txt$", file):
            sources.update((ROOT / file).read_bytes())
    done = ROOT / "build/mutate" / f"{name}-{sources.hexdigest()[:12]}"
    if again:
        shutil.rmtree(done, ignore_errors=True)
    done.mkdir(parents=True, exist_ok=True)
    survived, unseen, wrong = [], [], []

    def tell(mutation, caught):
        verdict = caught
        if not caught and mutation.lacking():
            unseen.append(mutation.name)
            verdict = f"not seen: this processor has no {mutation.lacking()}"
        elif not caught:
            survived.append(mutation.name)
            verdict = "SURVIVED"
        print(f"{mutation.name:<30} {mutation.catcher.split(': ')[0]:<42} {verdict}", flush=True)

    for mutation in mutations:
        if (done / mutation.key()).exists():
            tell(mutation, (done / mutation.key()).read_text())
    left = [m for m in mutations if not (done / m.key()).exists()]
    with tempfile.TemporaryDirectory(prefix="kerf-mutate.") as folder, ending(concurrent.futures.ThreadPoolExecutor(jobs)) as pool:
        folder = pathlib.Path(folder)
        for kind in (ReleaseObjects, TreeCopy):
            mine = [m for m in left if bool(m.object) == (kind is ReleaseObjects)]
            if not mine:
                continue
            trial = kind(folder, mine)
            for _ in pool.map(trial.as_it_is, sorted({m.catcher.split(": ")[0] for m in mine})):
                pass
            futures = {pool.submit(trial.caught_by, m): m for m in mine}
            for future in concurrent.futures.as_completed(futures):
                try:
                    caught = (future.result() or "").splitlines()
                except Wrong as error:
                    wrong.append(str(error))
                    continue
                if caught or not futures[future].lacking():  # another processor may see it
                    (done / futures[future].key()).write_text(caught[0] if caught else "")
                tell(futures[future], caught and caught[0])
    if wrong:
        raise Wrong("\nmutate: ".join(sorted(wrong)))
    print(f"mutate: {name}: {len(mutations)} mutations, {len(survived)} survived"
          + (f", {len(unseen)} cannot be seen on this processor" if unseen else ""))
    return len(survived)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("list", nargs="?", choices=[*LISTS[:-1], "resets"])
    parser.add_argument("pattern", nargs="?", default="")
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--jobs", type=int)
    parser.add_argument("--again", action="store_true")
    options = parser.parse_args()
    if options.check == bool(options.list):
        parser.error("give a LIST or --check")
    mutations = read_table()
    check(mutations)
    read_resets()
    if options.check:
        print(f"mutate: {len(mutations)} mutations, each text stands once")
        return 0
    if options.list == "resets":
        return 1 if judge_resets(options.pattern, options.jobs or os.cpu_count()) else 0
    mine = [m for m in mutations if m.list == options.list and re.search(options.pattern, repr(m))]
    if not mine:
        raise Wrong(f"{options.pattern}: no mutation of {options.list} matches")
    # A copy that builds takes all cores itself.
    jobs = options.jobs or (1 if options.list == "kernels" else os.cpu_count())
    return 1 if judge(options.list, mine, jobs, options.again) else 0


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    try:
        sys.exit(main())
    except Wrong as wrong:
        print(f"mutate: {wrong}", file=sys.stderr)
        sys.exit(2)
