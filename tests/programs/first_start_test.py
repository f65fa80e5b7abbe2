#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""first_start_test.py ROOT: ./kerf on a machine that lacks packages, with stand-ins for apt, sudo, cmake and ninja.

One percentage over all steps, which never falls; what apt fetches is said first; off a terminal a line at least each 20 s.
`kerf doctor` says who can install, for root, sudo, a refused user and no sudo, in a clone and installed."""
import os
import pathlib
import pty
import re
import shutil
import subprocess
import sys
import tempfile

STAND_INS = {
    "dpkg-query": '[ -e "$LAB/installed" ] && awk \'NF && !/^#/ { sub("LLVM", "16", $2); print "installed " $2 }\' "$LAB/tree/.ci/packages.txt"; exit 0',
    "apt-cache": '[ "$2" != "$UNKNOWN" ]',
    "apt-get": """case $* in
  *--print-uris*) echo '2 upgraded, 287 newly installed, 0 to remove and 3 not upgraded.'
    echo 'Need to get 12.5 MB/291 MB of archives.' ;;
  *update*) echo 'dlstatus:1:50.0000:Retrieving file 1 of 2'; echo Hit ;;
  *install*) [ -z "$FAIL" ] || { echo 'E: the disk is full'; exit 100; }
    echo 'dlstatus:1:33.3:Retrieving file 3 of 287 (5s left)'; sleep "${SILENCE:-0}"
    echo 'dlstatus:1:99:Retrieving file 287 of 287'; printf '(Reading database ... 5%%'
    echo 'pmstatus:cmake:40.5:Unpacking cmake'; echo 'pmstatus:cmake:100:Installed cmake'; : >"$LAB/installed"
    umount /usr/bin/python3 2>/dev/null || true ;;
esac""",
    "cmake": """case $* in *--preset*) echo 'Preset CMake variables:'; echo '-- The compiler'; mkdir -p build/release
      printf '%s:INTERNAL=%s\\n' CMAKE_HOME_DIRECTORY "$PWD" CMAKE_CACHEFILE_DIR "$PWD/build/release" >build/release/CMakeCache.txt
      printf 'build bin/kerf-%s: x\\n' controller emulator visualizer recorder record >build/release/build.ninja ;; esac""",
    "ninja": """case $* in *recompact*|*restat*) exit 0 ;; esac
ran=$LAB/ran-$(echo "$*" | cksum | tr ' ' -)
[ ! -e "$ran" ] || { echo 'ninja: no work to do.'; exit 0; }
echo "ninja: Entering directory"; for i in 1 2 3 4 5; do echo "[$i/5] Building $i.o"; done; : >"$ran" """,
    "g++": 'echo "g++ 12"',
    "sudo": """case $SUDO/$* in
  free/-n\\ *) shift; exec "$@" ;;
  free/*) exec "$@" ;;
  password/-n\\ *) echo 'sudo: a password is required' >&2; exit 1 ;;
  password/*) exit 1 ;;
  *) echo "Sorry, user x may not run sudo on y." >&2; exit 1 ;;
esac""",
    "id": 'case $1 in -u) echo "${WHO:-1000}" ;; -un) echo ada ;; *) exec /usr/bin/id "$@" ;; esac',
}
CONTROLLER = "#!/bin/sh\ncase $1 in --version) echo 'kerf-controller 0.1.0' ;; --probe) echo 'found x' ;; esac\n"
failures = []


def check(what, truth, shown=""):
    if not truth:
        failures.append(what)
        print(f"first_start: {what}\n{shown}")


class Lab:
    def __init__(self, root, folder):
        self.folder, self.tree = folder, folder / "tree"
        (self.tree / ".ci").mkdir(parents=True)
        (self.tree / "cmake").mkdir()
        (self.tree / "hil/guest").mkdir(parents=True)
        for name in ["kerf", "CMakePresets.json", "cmake/clang-version.sh", "hil/guest/guest.sh",
                     *(str(path.relative_to(root)) for path in (root / ".ci").iterdir() if path.is_file())]:
            shutil.copy2(root / name, self.tree / name)
        for name in ("demo", "cli"):
            shutil.copytree(root / name, self.tree / name)
        (self.tree / "CMakeLists.txt").touch()  # a clone
        self.tools = folder / "tools"
        self.tools.mkdir()
        for tool in pathlib.Path("/usr/bin").iterdir():  # all of this machine but what has a stand-in
            if tool.name not in STAND_INS:
                (self.tools / tool.name).symlink_to(tool)
        for name, text in STAND_INS.items():
            (self.tools / name).write_text(f"#!/bin/sh\n{text}\n")
            (self.tools / name).chmod(0o755)
        self.env = {"PATH": str(self.tools), "LAB": str(folder), "HOME": str(folder), "TMPDIR": str(folder)}

    def fresh(self):
        for path in [self.folder / "installed", *self.folder.glob("ran-*")]:
            path.unlink(missing_ok=True)
        shutil.rmtree(self.tree / "build", ignore_errors=True)

    def run(self, *words, terminal=False, **env):
        """(exit code, what was said), in a session of its own: without a terminal, or with one to write to."""
        env = self.env | env
        if not terminal:
            done = subprocess.run(words, env=env, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                  start_new_session=True, check=False, text=True)
            return done.returncode, done.stdout
        child, end = pty.fork()
        if not child:
            os.execve(words[0], words, env)
        said = b""
        try:
            while piece := os.read(end, 4096):
                said += piece
        except OSError:
            pass  # as Linux tells the end of a terminal
        return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), said.decode()


def percentages(said):
    return [int(number) for number in re.findall(r"(?:^ *|\r\x1b\[K *)(\d+) %", said, re.MULTILINE)]


def progress(lab):
    kerf = str(lab.tree / "kerf")
    for terminal in (False, True):
        lab.fresh()
        where = "on a terminal" if terminal else "off a terminal"
        code, said = lab.run(kerf, "setup", terminal=terminal, WHO="0")
        shown = percentages(said)
        check(f"{where}: set up", code == 0 and "kerf: ready" in said, said)
        check(f"{where}: one percentage, from apt to the build", len(shown) >= 3 and shown[0] <= 20 and shown[-1] == 100, said)
        check(f"{where}: which never falls", shown == sorted(shown) and shown.count(100) <= 1, said)
        size = re.search(r"packages: installing (\d+) packages and (\d+) that they need, 12.5 MB: ", said)
        check(f"{where}: what is fetched comes first",
              size and int(size[1]) + int(size[2]) == 287 and "file 3 of" not in said[:size.start()], said)
        code, said = lab.run(kerf, "setup", terminal=terminal, WHO="0")
        check(f"{where}: nothing to do, nothing to show", code == 0 and not percentages(said), said)
    lab.fresh()
    code, said = lab.run(kerf, "setup", WHO="0", SILENCE="21")
    check("21 silent seconds have a line", "%  Retrieving file 3 of 287 (5s left)" in said, said)
    # A demo without Python: its packages, then the rest; in a name space of its own, where Python can be hidden.
    lab.fresh()
    hide = "mount --bind /dev/null /usr/bin/python3 && exec \"$0\" demo --headless --seconds 1"
    code, said = lab.run("/usr/bin/unshare", "-rm", "true")
    if code == 0:
        code, said = lab.run("/usr/bin/unshare", "-rm", "/usr/bin/bash", "-c", hide, kerf, WHO="0")
        shown = percentages(said)
        check("a demo without Python: one percentage too", shown and shown == sorted(shown) and shown[-1] == 100, said)
        check("which reaches 100 once", shown.count(100) == 1, said)
    else:
        print("first_start: no name spaces of users here: a demo without Python was not tried")
    lab.fresh()
    code, said = lab.run(kerf, "setup", WHO="0", FAIL="1")
    check("apt's error is told", code == 2 and "E: the disk is full" in said and "status:" not in said, said)
    code, said = lab.run(kerf, "setup", WHO="0", UNKNOWN="libgdcm-dev")
    check("a package that the release does not have", code == 2 and said.splitlines()[-1].startswith("packages: apt knows no libgdcm-dev; "), said)


def who_installs(lab):
    kerf = str(lab.tree / "kerf")
    cases = [("root", {"WHO": "0"}, 0, "./kerf setup installs them"),
             ("sudo", {"SUDO": "free"}, 0, "./kerf setup installs them"),
             ("sudo with a password, no terminal", {"SUDO": "password"}, 1, "sudo asks for a password: start ./kerf setup on a terminal"),
             ("sudo refused", {"SUDO": "no"}, 1, "sudo does not let ada install packages: ask who may"),
             ("none", {}, 1, "not root and no sudo: ask who may install packages")]
    for name, env, expected, line in cases:
        lab.fresh()
        sudo = lab.tools / "sudo"
        if name == "none":
            sudo.rename(lab.folder / "sudo")
        code, said = lab.run(kerf, "doctor", **env)
        check(f"doctor, {name}: its line", line in said, said)
        check(f"doctor, {name}: exit {expected}", code == expected, said)
        check(f"doctor, {name}: no more than is true", ("./kerf setup builds" in said or "./kerf setup installs" in said) == (expected == 0), said)
        check(f"doctor, {name}: does not deny Debian", "not Debian" not in said, said)
        code, said = lab.run(kerf, "setup", **env)
        check(f"setup, {name}: as the doctor says", (code == 0) == (expected == 0), said)
        if expected:
            check(f"setup, {name}: one line with the command", re.fullmatch(r"packages: .*; as root: apt-get install .*\n", said), said)
        if name == "none":
            (lab.folder / "sudo").rename(sudo)
    lab.fresh()
    code, said = lab.run(kerf, "doctor", terminal=True, SUDO="password")
    check("doctor, sudo with a password, on a terminal", code == 0 and "sudo asks for your password" in said, said)
    (lab.folder / "installed").touch()
    code, said = lab.run(kerf, "doctor", SUDO="no")
    check("doctor, with all packages, refused", code == 0 and "all that the build needs" in said, said)
    code, said = lab.run(kerf, "doctor", TMPDIR=str(lab.folder / "gone"))
    check("doctor, without the folder of TMPDIR", code == 1 and f"fail  {lab.folder}/gone" in said, said)


def installed(lab):
    prefix = lab.folder / "usr"
    share = prefix / "share/kerf"
    (share / ".ci").mkdir(parents=True)
    (prefix / "bin").mkdir()
    shutil.copy2(lab.tree / "kerf", share)
    shutil.copytree(lab.tree / "cli", share / "cli")
    shutil.copy2(lab.tree / ".ci/doctor.sh", share / ".ci")
    (prefix / "bin/kerf").symlink_to("../share/kerf/kerf")
    programs = [prefix / "bin" / f"kerf-{name}" for name in ("controller", "emulator", "visualizer", "recorder", "record")]
    for program in programs:
        program.write_text(CONTROLLER)
        program.chmod(0o755)
    for env in ({"WHO": "0"}, {"SUDO": "free"}, {"SUDO": "no"}, {}):
        code, said = lab.run(str(prefix / "bin/kerf"), "doctor", **env)
        check(f"installed {env}: runs", code == 0 and "kerf-controller 0.1.0, installed" in said, said)
        check(f"installed {env}: nothing of a clone", not re.search(r"\./kerf|setup|KERF_DATA|QEMU|compiler|packages\.sh", said), said)
    programs[2].unlink()
    code, said = lab.run(str(prefix / "bin/kerf"), "doctor")
    check("installed, without a program", code == 1 and "without kerf-visualizer in " in said, said)


def main():
    root = pathlib.Path(sys.argv[1])
    with tempfile.TemporaryDirectory() as folder:
        lab = Lab(root, pathlib.Path(folder))
        progress(lab)
        who_installs(lab)
        installed(lab)
    print(f"first_start: {len(failures)} failed")
    sys.exit(1 if failures else 0)


main()
