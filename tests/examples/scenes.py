#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Whether every scene of scenes/ runs:  scenes.py ROOT BIN

Two seconds of a demo in lock-step, without a display: no fault, all ticks, a picture, and a touch where there is
something to touch. What a scene's comment says is to be done first is done first (`#     ./kerf volume ...`). Where
that needs KERF_DATA or a file of a package and there is none, the scene is left out, and a line says so."""
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

NOTHING_TO_TOUCH = {"empty.toml", "external.toml"}  # air; a force that a program gives


def fault_of(scene, folder, environment):
    """What is wrong with a run of a scene, or nothing."""
    out = folder / "out"
    done = subprocess.run([folder / "kerf", "demo", "--headless", "--virtual", "--seconds", "2", "--size", "160x120",
                           "--scene", scene, "--out", out], cwd=folder, env=environment, capture_output=True, text=True)
    if done.returncode:
        return f"exit code {done.returncode}: {done.stderr.strip()}"
    report = json.loads((out / "report.json").read_text())
    pictures = list(out.glob("frame-*.png"))
    shutil.rmtree(out)
    if report["fault_count"] or report["end"] != "finished" or report["ticks"] != 2 * report["rate_hz"]:
        return f"ended {report['end']} after {report['ticks']} ticks, faults {report['faults']}"
    if (report["contact_ticks"] > 0) == (scene.name in NOTHING_TO_TOUCH):
        return f"{report['contact_ticks']} ticks of contact"
    return None if pictures else "no picture"


def main(root, bin_folder):
    wrong, ran = [], 0
    with tempfile.TemporaryDirectory() as scratch:
        folder = pathlib.Path(scratch)
        shutil.copytree(root / "scenes", folder / "scenes", ignore=shutil.ignore_patterns("ct.*"))  # what an import made
        (folder / "kerf").symlink_to(root / "kerf")
        environment = dict(os.environ, KERF_BIN=str(bin_folder))
        for scene in sorted((folder / "scenes").rglob("*.toml")):
            if scene.parent.name == "hands":
                continue
            first = re.findall(r"^#     (\./kerf volume .*)", scene.read_text(), re.MULTILINE)
            words = " ".join(first).split()
            missing = [word for word in words if word.startswith("/") and not pathlib.Path(word).exists()]
            if not environment.get("KERF_DATA"):
                missing += [word for word in words if "KERF_DATA" in word]
            if missing:
                print(f"skipped: {scene.name}: {missing[0]} is missing")
                continue
            for line in first:
                subprocess.run(["bash", "-c", line], cwd=folder, env=environment, check=True)
            fault = fault_of(scene, folder, environment)
            print(f"{scene.name}: {fault or 'ok'}", flush=True)
            ran += 1
            wrong += [fault] if fault else []
    print(f"{ran} scenes ran, {len(wrong)} faults")
    return ran > 0 and not wrong


sys.exit(0 if main(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])) else 1)
