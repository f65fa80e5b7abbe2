#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs the commands that a page prints:  run.py ROOT BIN README.md|docs        this page, or all of docs/

Each page has a scratch folder like a clone's, in which its commands run one after the other; a tooth.nrrd, a
scan.raw and a ct/ of a user's own are there. A demo runs for one second in lock-step, so that no figure of this
machine counts; all else runs as it stands. So do commands within text and tables, each once, after those of their page.
What cannot run in a test stands in NOT_HERE, each with its reason."""
import array
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

import pages

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / "errors"))
import dicom

# Reason, and the beginnings of the commands that it keeps from running, with their page where that matters; with $ at its
# end it is the whole command. A page alone, such as "own-law.md: ", is all of its blocks.
NOT_HERE = {
    "changes the system, as root": ["sudo ", "echo '@plugdev"],
    "needs a display, or a controller at work": [
        "./kerf demo --hand mouse", "./kerf visualizer", "./kerf record grab", "./kerf record live", "./kerf replay once/log --watch"],
    "needs a device, or its kernel": [
        "cat /sys/kernel/realtime", "./kerf controller --probe",
        "./kerf controller --scene mine.toml --device omni --port fw", "./kerf controller --scene scenes/two_arms.toml",
        "./kerf arm"],
    "records or exports the run of a device": ["./kerf recorder", "./kerf record export"],
    "needs a second terminal or machine": [
        "./kerf emulator", "./kerf controller --scene scenes/touch.toml --torque-scale",
        "./kerf controller --scene scenes/phantom.toml --port socket", "./kerf controller --name tooth",
        "./kerf bridge serve", "./kerf bridge join"],
    "runs in the test own_law": ["own-law.md: "],
    "builds with KERF_PYTHON; the examples run in the test python_page": ["python.md: "],
    "needs compilers for other processors; .ci/all determinism runs its images": [".ci/packages.sh all"],
    "fetches and builds programs of others": ["tests/standin/others/run.sh"],
    "runs in the tests packages and reader": ["./kerf package", "compatibility.md: cmake",
                                                "compatibility.md: python3 -m venv", "venv/bin/pip install"],
    "needs a CT that does not come with kerf; the test examples_scenes brings it": [
        "./kerf demo --scene scenes/spine/", "./kerf demo --scene scenes/skull",
        "./kerf volume import /usr/share", './kerf volume import "$KERF_DATA'],
    "runs in the test docs_tutorial": ["tutorial.md: "],
    "needs a registry of images": ["podman "],
    "runs all tests, or many minutes": [
        "./kerf test", "safety.md: ./kerf lab", "./kerf studies ranges", ".ci/check-determinism.sh", ".ci/check-bare-metal.sh", "./kerf bench",
        "KERF_KILLS=", "KERF_WRITE_PAGE="],
    "holds a core for a minute; with other options it runs here or in the tests lab and examples_python": [
        "./kerf lab zwidth --rate", "./kerf lab zwidth --map", "./kerf lab zwidth --arm",
        "./kerf lab zwidth --stabiliser", "parallel ./kerf lab zwidth", "./kerf lab zwidth --merge", "./kerf sweep"],
    "runs in the test docs_site": ["./kerf docs$"],
    "installs packages and builds": ["./kerf setup$", "./kerf page"],
    "serves until it is ended; the test web has a server of its own": ["python3 -m http.server"],
    "measures for minutes; the tests of lab run parts of it": [
        "./kerf lab accuracy --page", "./kerf studies extremes", "./kerf lab zwidth --page", "./kerf lab faults --rate all",
        "./kerf lab reproduce"],
    "needs network namespaces; the test bridge_net does the same": ["./kerf demo --two-machines"],
    "names a program or an option, and is no whole command": [
        "./kerf controller$", "./kerf controller --check$", "./kerf demo --name$", "./kerf demo --volume$", "./kerf lab$", "./kerf stand-in$", "./kerf lab faults$", "./kerf volume import$", "./kerf controller --strict$",
        "./kerf controller --rate HZ$", "./kerf controller --port udp:HOST:5000$", "./kerf controller --report FILE$",
        "./kerf controller --explain --report FILE$", "./kerf record info LOG", "./kerf replay$", "./kerf identify$"],
    "needs a recording of a device that a program has moved; the tests identify and lab run it": ["./kerf identify", "./kerf lab zwidth --device device.toml", "./kerf controller --scene scenes/touch.toml --set 'device.identified"],
    "runs a program of the reader's own": ["./kerf stand-in --device touch --vendor-name Left"],
}
# What stands for a reader's own file, within text.
OWN = (("import PATH", "import ct/ --out own.nrrd"), ("info FILE", "info tooth.nrrd"), ("--volume FILE", "--volume tooth.nrrd"),
       ("--report FILE", "--report own.json"), ("DIR", "own"),
       ("--rate HZ", "--rate 8000"))
EVERYWHERE = ("examples", "hil", "python", "scenes", "tests")
# `./kerf` of a scratch folder: a page's own --seconds give way.
DOOR = """#!/bin/bash
words=()
while (($#)); do
  if [[ ${words[0]:-} == demo && $1 == --seconds ]]; then
    shift
  else
    words+=("$1")
  fi
  shift
done
[[ ${words[0]} != demo ]] || words+=(--virtual --seconds 1)
exec '%s/kerf' "${words[@]}"
"""


def furnish(folder, root, bin_folder):
    """What a user has who follows a page: a clone's files, and data of their own."""
    for name in EVERYWHERE:
        os.symlink(root / name, folder / name)
    for name in (".sockets", "docs", "docs/images", "docs/plots"):  # sockets; some commands write a page or a picture
        (folder / name).mkdir(mode=0o700)
    (folder / "kerf").write_text(DOOR % root)
    (folder / "kerf").chmod(0o755)
    subprocess.run([bin_folder / "kerf-volume", "phantom", "--shape", "ball", "--size", "32x32x32", "--out",
                    folder / "tooth.nrrd"], check=True, stdout=subprocess.DEVNULL)
    ball = [[[1200 if (i - 12) ** 2 + (j - 12) ** 2 + (k - 12) ** 2 < 81 else 0 for k in range(24)]
             for j in range(24)] for i in range(24)]
    dicom.write_series(folder / "ct", "1", ball, edge_mm="0.5")
    half = range(-32, 32)
    (folder / "scan.raw").write_bytes(array.array("h", (
        1000 if i * i + j * j + k * k < 400 else 0 for k in half for j in half for i in half)).tobytes())


def fault_of(command, expected, folder, environment):
    """What is wrong with a command, or nothing. Where the page shows its output, a line that ends in ... goes on."""
    try:
        done = subprocess.run(["bash", "-o", "pipefail", "-c", command], cwd=folder, env=environment, timeout=600,
                              capture_output=True, text=True, stdin=subprocess.DEVNULL)
    except subprocess.TimeoutExpired:
        return "still busy after 600 s"
    if done.returncode:
        return f"exit code {done.returncode}\n{done.stdout[-2000:]}{done.stderr[-2000:]}"
    for shown, line in zip(expected, done.stdout.splitlines() + [""] * len(expected)):
        if not (line.startswith(shown[:-3]) if shown.endswith("...") else line == shown):
            return f"the page shows {shown!r}, it prints {line!r}"
    return None


def rows_of(page, command, within_text=False):
    def fits(row):
        if row.endswith("$"):
            return command == row[:-1]
        if row.endswith(".md: ") and within_text:
            return False
        return f"{page.name}: {command}".startswith(row) or command.startswith(row)
    return [row for rows in NOT_HERE.values() for row in rows if fits(row)]


def within_text(page):
    """(line number, command, none) of what is to be run of a page's text; each command once in all pages."""
    for number, command in pages.inline(page):
        if not rows_of(page, command, True) and command not in DONE:
            DONE.add(command)
            for form, own in OWN:
                command = command.replace(form, own)
            yield number, command, []


DONE = set()


def run_page(page, root, bin_folder):
    """How many commands of a page ran, and what is wrong with them."""
    todo, ran, wrong = [one for one in pages.commands(page) if not rows_of(page, one[1])], 0, []
    DONE.update(command for _, command, _ in todo)
    todo += within_text(page)
    if not todo:
        return ran, wrong
    with tempfile.TemporaryDirectory() as scratch:
        folder = pathlib.Path(scratch)
        environment = dict(os.environ, KERF_BIN=str(bin_folder), HOME=scratch, XDG_RUNTIME_DIR=f"{scratch}/.sockets")
        environment.pop("DISPLAY", None)
        environment.pop("WAYLAND_DISPLAY", None)
        furnish(folder, root, bin_folder)
        if page.name in ("contact.md", "stand-ins.md"):  # a scene that its reader has
            shutil.copy(root / "scenes" / "touch.toml", folder / "mine.toml")
            os.symlink(root / "scenes" / "hands", folder / "hands")
        for number, command, expected in todo:
            began = time.monotonic()
            fault = fault_of(command, expected, folder, environment)
            ran += 1
            print(f"{time.monotonic() - began:6.1f} s  {page.name}:{number}: {command}", flush=True)
            if fault:
                wrong.append(f"{page.name}:{number}: {command}: {fault}")
    return ran, wrong


def main(root, bin_folder, which):
    used = {row for page in pages.all_pages(root) for _, command, _ in pages.commands(page)
            for row in rows_of(page, command)}
    used |= {row for page in pages.all_pages(root) for _, command in pages.inline(page)
             for row in rows_of(page, command, True)}
    wrong = [f"NOT_HERE: {row!r}: no page has such a command; take the row out"
             for rows in NOT_HERE.values() for row in rows if row not in used]
    total = 0
    for page in pages.all_pages(root):
        if which in (page.name, page.parent.name):
            ran, faults = run_page(page, root, bin_folder)
            total += ran
            wrong += faults
    print(*wrong, sep="\n")
    print(f"{total} commands ran, {len(wrong)} faults")
    return total > 0 and not wrong


if __name__ == "__main__":
    sys.exit(0 if main(pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve(), sys.argv[3]) else 1)
