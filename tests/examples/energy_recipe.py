#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Whether examples/python/port_energy.py recomputes `port_energy_j` to 1e-9 J:  energy_recipe.py ROOT BIN

In scenes that are scaled up and down, over gaps in the reports, and with two arms. And whether docs/log.md shows the
recipe as it runs. Exit code 77: skipped, for want of numpy or matplotlib."""
import importlib.util
import pathlib
import re
import sys
import tempfile

import lockstep

MOST_J = 1e-9
# scene, devices, settings, fault script, by the position column alone, stale ticks expected
RUNS = [
    ("phantom", ["omni"], [], None, True),
    ("phantom", ["omni"], ["device.workspace_scale=2.5"], None, True),
    ("phantom", ["omni"], ["device.workspace_scale=0.4"], None, False),
    ("phantom", ["omni"], ["device.workspace_scale=0.4"], "lost_reports", False),
    ("phantom", ["omni"], ["device.workspace_scale=1.7"], "silence", True),
    ("touch", ["touch"], ["device.workspace_scale=0.4"], "sparse_reports", False),
    ("touch", ["falcon"], [], "lost_burst", True),
    ("two_arms", ["omni", "touch"], ["device.workspace_scale=0.4"], "lost_reports", False),
]


def recipe_of(text):
    """The function port_energy_j, without the blank line behind it."""
    return re.search(r"def port_energy_j\(.*?\n(?=\n\S|\n\n|\Z)", text, re.S).group().rstrip()


def main(root, bin_folder):
    for package in ("numpy", "matplotlib"):
        if not importlib.util.find_spec(package):
            print(f"skipped: {package} is missing; apt-get install python3-{package}")
            return 77
    sys.path[:0] = [str(root / "examples/python"), str(root / "python")]
    import device_tip
    import numpy
    import port_energy
    from kerf_reader import Log

    wrong = 0
    shown = re.sub(r"^    ", "", (root / "docs/log.md").read_text(), flags=re.M)
    if recipe_of((root / "examples/python/port_energy.py").read_text()) not in shown:
        print("docs/log.md: has not the recipe of examples/python/port_energy.py")
        wrong += 1
    with tempfile.TemporaryDirectory() as scratch:
        for number, (scene, devices, settings, fault, by_position) in enumerate(RUNS):
            out = pathlib.Path(scratch) / str(number)
            script = root / f"hil/faults/{fault}.toml" if fault else None
            lockstep.run(bin_folder, out, root / f"scenes/{scene}.toml", 3, devices, settings, [script] * 2, root)
            log = Log(out / "log")
            for arm, ticks in enumerate([log.ticks, log.second][:len(devices)]):
                device = log.scene[("device", "second_device")[arm]]
                tips = [device_tip.from_counts(ticks, device)] + [None] * by_position
                stale, energy_j = int(ticks["stale"].sum()), ticks["port_energy_j"]
                off_j = [float(numpy.abs(port_energy.port_energy_j(ticks, device, tip) - energy_j).max()) for tip in tips]
                fine = max(off_j) <= MOST_J and abs(energy_j).max() > 1e-6 and (stale > 0) == (fault is not None)
                wrong += not fine
                print(f"{'ok' if fine else 'WRONG'}: {scene} {' '.join(settings)} {fault or 'no fault'}, {devices[arm]}: "
                      f"{stale} stale ticks, {energy_j[-1]:.9f} J, off by {off_j} J", flush=True)
    return 1 if wrong else 0


sys.exit(main(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])))
