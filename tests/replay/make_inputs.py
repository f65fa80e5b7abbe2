#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""What the servo was given in five runs, for recorded_inputs_test.cpp, made by a run of each:

make_inputs.py ROOT BIN

A file of inputs/ has for each tick one byte, which is the count of numbers of `raw` that changed, plus 64 if the report is
stale and 128 with a command; then the command and its argument, a byte each; then each change: the index in one byte, and the
step from the last value, without sign as 2 n or -2 n - 1, seven bits in each byte, the lowest first, plus 128 if more follow.
The row that is printed belongs into the test. A change of the servo that is meant to change bits changes its hashes alone."""
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


def bytes_of_step(step):
    rest = 2 * step if step >= 0 else -2 * step - 1
    while rest >= 128:
        yield rest % 128 + 128
        rest //= 128
    yield rest


def bytes_of(log):
    before = np.zeros(log["raw"].shape[1], dtype=np.int64)
    for row in log:
        now = row["raw"].astype(np.int64)
        changed = np.flatnonzero(now != before)
        yield len(changed) + (64 if row["stale"] else 0) + (128 if row["command"] else 0)
        if row["command"]:
            yield from (int(row["command"]), int(row["command_argument"]))
        for i in changed:
            yield int(i)
            yield from bytes_of_step(int(now[i] - before[i]))
        before = now


def main():
    root, programs = map(pathlib.Path, sys.argv[1:3])
    for name, scene, hand, seconds, fault in RUNS:
        with tempfile.TemporaryDirectory() as folder:
            log = run(root, programs, pathlib.Path(folder), scene, hand, seconds, fault)
        (HERE / "inputs" / f"{name}.bin").write_bytes(bytes(bytes_of(log)))
        contact, faults = np.count_nonzero(log["flags"] & 4), sorted(set(log["fault"]) - {0})
        print(f'{{"{name}", "{scene}", "{log[-1]["output_hash"]:016x}", "{log[-1]["volume_hash"]:016x}"}},')
        print(f"{name}: {len(log)} ticks, {contact} in contact, removed {log['removed'].sum() / 65535:.0f} voxels, faults {faults}")


if __name__ == "__main__":
    main()
