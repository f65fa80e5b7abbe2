#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""What the servo was given in five runs, for recorded_inputs_test.cpp, made by a run of each:

make_inputs.py ROOT BIN

A file of inputs/ has a line for each tick: what came new of `raw`, as a step from the last value, then the
command, if there was one. Its head has the scene, and its foot the hashes that the run ended in. A change of
the servo that is meant to change bits changes the hashes alone: take those that the test prints."""
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

HERE = pathlib.Path(__file__).resolve().parent
# Name, scene, hand, seconds, fault script.
RUNS = [("touch", "touch", "touch", 3, None), ("slide", "wall", "slide", 3, None), ("groove", "phantom", "groove", 3, None),
        ("cavity", "paper_small", "cut_cavity", 3, None), ("fault", "touch", "touch", 3, "lost_long")]


def run(root, programs, folder, scene, hand, seconds, fault):
    name, device, log = f"inputs-{folder.name}", folder / "device", folder / "log"
    emulator = [programs / "kerf-emulator", "--lockstep", "--rate", "1000", "--socket", device, "--hand",
                root / f"scenes/hands/{hand}.toml", *(["--fault", root / f"hil/faults/{fault}.toml"] if fault else [])]
    others = [subprocess.Popen([programs / "kerf-recorder", "--name", name, "--out", log], stdout=subprocess.DEVNULL),
              subprocess.Popen(emulator, stdout=subprocess.DEVNULL)]
    subprocess.run([programs / "kerf-controller", "--scene", root / f"scenes/{scene}.toml", "--virtual", "--name", name,
                    "--seconds", str(seconds), "--torque-scale", "0.05,0.05,0.05", "--port", f"socket:{device}"],
                   stdout=subprocess.DEVNULL, check=False)  # a fault may be the end
    for program in others:
        program.wait(timeout=60)
    return np.load(log / "ticks.npy")


def lines_of(log):
    """stale, steps of the numbers of `raw` that changed as `index:step`, and `command argument` behind a `!`."""
    before = np.zeros(log["raw"].shape[1], dtype=np.int64)
    for row in log:
        words = ["-"] if row["stale"] else []
        now = row["raw"].astype(np.int64)
        words += [f"{i}:{now[i] - before[i]}" for i in np.flatnonzero(now != before)]
        before = now
        if row["command"]:
            words += ["!", str(row["command"]), str(row["command_argument"])]
        yield " ".join(words)


def main():
    root, programs = map(pathlib.Path, sys.argv[1:3])
    for name, scene, hand, seconds, fault in RUNS:
        with tempfile.TemporaryDirectory() as folder:
            log = run(root, programs, pathlib.Path(folder), scene, hand, seconds, fault)
        last = log[-1]
        text = "\n".join([f"scene {scene}", *lines_of(log), f"output {last['output_hash']:016x}", f"volume {last['volume_hash']:016x}"])
        (HERE / "inputs" / f"{name}.txt").write_text(text + "\n")
        contact, faults = np.count_nonzero(log["flags"] & 4), sorted(set(log["fault"]) - {0})
        print(f"{name}: {len(log)} ticks, {contact} in contact, removed {log['removed'].sum() / 65535:.0f} voxels, faults {faults}")


if __name__ == "__main__":
    main()
