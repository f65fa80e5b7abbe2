#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Whether scenes do what they say:  scene_outcomes.py ROOT BIN [--write]

Each runs in lock-step with its own hand. What it removed, how deep, and the highest force have to be in its comment
and in the table of docs/scenes.md as they are, and the claims of its text have to hold. --write puts the figures there.
Those on a CT are left out without it: the spine without KERF_DATA, the skull without its package. Exit code 77: skipped, for want of numpy."""
import importlib.util
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

import lockstep

CLAMPED, SHAFT, FORBIDDEN = 16, 4096, 1024


def floor_is_flat(run):
    """class1: the floor is 1.8 mm below the central fossa, level within 0.1 mm, in dentin; the walls are 1.5 to 2.6 mm high"""
    low, middle, high = run.numpy.percentile(run.cut.floor_mm(), [5, 50, 95])
    walls = run.cut.walls_mm()
    return (abs(middle + 1.8) < 0.05 and high - low < 0.1 and run.removed["dentin"] > 1 and walls.min() > 1.45
            and walls.max() < 2.65)


def goes_round(run):
    """crown: 0.4 to 0.9 mm off every side, down to 3.5 mm below the central fossa, of enamel alone"""
    sides = run.cut.side_depth_mm().max(axis=1)
    lowest_mm = run.cut.y[(run.cut.lost_mm3() > 0).any(axis=(0, 1))].min()
    return sides.min() > 0.35 and sides.max() < 0.95 and abs(lowest_mm + 3.5) < 0.3 and set(run.removed) == {"enamel"}


def halves(run):
    """two_arms: each cuts in its half; the border is 2.5 mm from the first one's origin"""
    left = run.cut.x[:, None, None] < 2.5
    lost = run.cut.lost_mm3()
    return min(lost[left[:, 0, 0]].sum(), lost[~left[:, 0, 0]].sum()) > 1


def rests_on(centre_mm, radius_mm):
    """The tool's centre rests so far from the middle, and the force points away from there."""
    def claim(run):
        held = run.ticks["penetration_mm"] > 0.05
        tip, force = (run.ticks[name][held].astype(float) for name in ("position_mm", "commanded_force_n"))
        away = tip + run.ticks["proxy_offset_mm"][held] - centre_mm
        distance = run.numpy.linalg.norm(away, axis=1)
        along = (away * force).sum(axis=1) / distance / run.numpy.linalg.norm(force, axis=1)
        return held.any() and abs(distance - radius_mm).max() < 0.05 and along.min() > 0.99
    return claim


def feels_only(run):
    return not run.removed and run.peaks_n[0] > 0.1


# scene: seconds, depth from above or from the side, claims of its text
SCENES = {
    "ball": (10, None, [feels_only, rests_on([0, -8, 0], 9)]),
    "caries": (10, "above", [lambda run: run.removed["caries"] > 5, lambda run: 9.65 < run.cut.material_mm3("caries") < 9.75,
                             lambda run: run.removed["dentin"] < 0.5, lambda run: not run.flag(FORBIDDEN)]),
    "class1": (12, "above", [floor_is_flat, lambda run: not run.flag(FORBIDDEN)]),
    "crown": (20, "side", [goes_round, lambda run: not run.flag(FORBIDDEN)]),
    "empty": (10, None, [lambda run: not run.removed and run.peaks_n[0] == 0]),
    "external": (10, None, [lambda run: not run.removed and run.peaks_n[0] == 0]),
    "fast": (10, "above", []),
    "fluted_bur": (10, "above", []),
    "low_limits": (10, None, [feels_only, lambda run: not run.flag(CLAMPED)]),
    "paper": (10, "above", [lambda run: run.peaks_n[0] < 0.25]),
    "paper_small": (10, "above", [lambda run: run.peaks_n[0] < 0.25]),
    "phantom": (10, "above", [lambda run: not run.flag(FORBIDDEN)]),
    "skull": (10, "above", []),
    "spine/spine": (10, "above", []),
    "shaft": (10, "side", [lambda run: run.flag(SHAFT)]),
    "torus": (10, None, [feels_only]),
    "touch": (10, None, [feels_only]),
    "two_arms": (10, "above", [halves]),
    "two_teeth": (10, "above", []),
    "wall": (10, None, [feels_only]),
}


def with_volume(root, bin_folder, scratch, name):
    """A scene; if its comment says how to make its volume, a copy with that beside it. None: the source of it is missing."""
    scene = root / f"scenes/{name}.toml"
    line = re.search(r"^#     (\./kerf volume .*)", scene.read_text(), re.M)
    if not line:
        return scene
    source = pathlib.Path(os.path.expandvars(line[1].split()[3].strip('"')))
    if not source.exists():
        return None
    folder = pathlib.Path(scratch) / f"with-{scene.stem}"
    shutil.copytree(root / "scenes", folder / "scenes", ignore=shutil.ignore_patterns("ct.*"))
    (folder / "kerf").symlink_to(root / "kerf")
    subprocess.run(["bash", "-c", line[1]], cwd=folder, env=dict(os.environ, KERF_BIN=str(bin_folder)), check=True,
                   stdout=subprocess.DEVNULL)
    return folder / f"scenes/{name}.toml"


class Run:
    """What a scene did."""

    def __init__(self, root, bin_folder, scratch, name, scene):
        import numpy
        from cut_figures import Cut, peak_n
        from kerf_reader import Log

        self.numpy = numpy
        self.seconds, side, claims = SCENES[name]
        devices = ["omni", "touch"] if name == "two_arms" else ["omni"]
        out = pathlib.Path(scratch) / scene.stem
        report = lockstep.run(bin_folder, out, scene, self.seconds, devices, cwd=root)
        log = Log(out / "log")
        self.ticks = log.ticks
        self.peaks_n = [peak_n(ticks) for ticks in (log.ticks, log.second) if ticks is not None]
        self.removed, self.depth_mm = {}, 0
        if side:
            self.cut = Cut(out, log)
            gone_mm3 = self.cut.removed_mm3()
            told_mm3 = report["removed_mm3_by_material"]
            self.removed = {material: mm3 for material, mm3 in gone_mm3.items() if mm3 >= 0.05}
            self.depth_mm = float((self.cut.depth_mm() if side == "above" else self.cut.side_depth_mm()).max())
        elif log["removed"].any():
            self.removed = {"something": 0}
        self.broken = [claim.__doc__ or f"number {number}" for number, claim in enumerate(claims, 1) if not claim(self)]
        if side and any(abs(told_mm3[material] - mm3) > 1e-3 for material, mm3 in gone_mm3.items()):
            self.broken.append(f"the report has {told_mm3}, the volumes have lost {gone_mm3}")
        if report["fault_count"]:
            self.broken.append(f"faults {report['faults']}")

    def flag(self, bit):
        return bool((self.ticks["flags"] & bit).any())

    def figures(self):
        removed = ", ".join(f"{material} {mm3:.1f}" for material, mm3 in self.removed.items())
        depth = f"{self.depth_mm:.1f}" if self.removed else ""
        return str(self.seconds), removed, depth, " and ".join(f"{peak:.2f}" for peak in self.peaks_n)


def sentence(seconds, removed, depth, peak):
    cut = f"{removed} mm3 gone, {depth} mm deep" if removed else "nothing is cut"
    return f"In {seconds} s: {cut}, peak force {peak} N."


def differences(root, name, figures, write):
    """Places that do not have these figures."""
    row = f"| `{name}.toml` | " + " | ".join(figures) + " |"
    scene, page = root / f"scenes/{name}.toml", root / "docs/scenes.md"
    if write:
        scene.write_text(re.sub(r"^# In \d+ s: .*N\.$", "# " + sentence(*figures), scene.read_text(), flags=re.M))
        page.write_text(re.sub(rf"^\| `{name}\.toml` \| \d+ \|.*$", row, page.read_text(), flags=re.M))
    places = []
    if f"# {sentence(*figures)}\n" not in scene.read_text():
        places.append(f"scenes/{name}.toml: its comment has not: {sentence(*figures)}")
    if row not in page.read_text().splitlines():
        places.append(f"docs/scenes.md: has not: {row}")
    return places


def main(root, bin_folder, write):
    if not importlib.util.find_spec("numpy"):
        print("skipped: numpy is missing; apt-get install python3-numpy")
        return 77
    sys.path.insert(0, str(root / "python"))
    shipped = {str(file.relative_to(root / "scenes").with_suffix("")) for file in (root / "scenes").rglob("*.toml")
               if file.parent.name != "hands"}
    wrong = [f"scenes/{name}.toml: has no row in {sys.argv[0]}" for name in shipped ^ set(SCENES)]
    with tempfile.TemporaryDirectory() as scratch:
        for name in SCENES:
            scene = with_volume(root, bin_folder, scratch, name)
            if scene is None:
                print(f"skipped: {name}: its CT is missing")
                continue
            run = Run(root, bin_folder, scratch, name, scene)
            found = [f"{name}: claim: {claim}" for claim in run.broken] + differences(root, name, run.figures(), write)
            print(f"{name}: {sentence(*run.figures())} {'; '.join(found) or 'ok'}", flush=True)
            wrong += found
    print(*wrong, sep="\n")
    return 1 if wrong else 0


sys.exit(main(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), "--write" in sys.argv))
