# SPDX-License-Identifier: Apache-2.0
"""The part of docs/stability.md on maps, from maps that it lets `kerf-lab zwidth` measure.

measure reads {program, quick, jobs, provenance}: the path of kerf-lab, whether few cells and short hits are enough, its
--jobs (0: all cores), and day and machine of the run. It returns the JSON that page, devices and rates read:

    provenance
    devices, rates              maps as `kerf lab zwidth --json` writes them (stability_map.py)
    table                       rows {device, delay, damping, exact, axis, held, arm, checked}: texts, then the lowest K of each;
                                at last the highest K that `kerf-controller --check` accepts without a warning, 0: none
    stabilisers                 rows {device, delay, lowest: {STABILISER: [one axis, whole arm]}}
    knobs                       rows {name, unit, value, standard, swings, active, exact, re_entry}
    numbers                     rows {numeric, cells, others, columns, factor}
    question                    {zwidth, impedance: lines of the two commands with what they print; stiffness, felt: its K as a text,
                                rows of `kerf lab impedance --json` (impedance.py)}"""
import json
import math
import os
import re
import subprocess
import tempfile

import text
from stability_map import AXES, NEVER, crossing, lowest

# The folder that has examples/: a clone's, or of an installed kerf that of its pages.
ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
if not os.path.isdir(os.path.join(ROOT, "examples")):
    ROOT = os.path.join(ROOT, "..", "doc", "kerf")

ABOUT = """\
# Stability

Made by `./kerf lab zwidth --page docs/stability.md`: all maps come from one run. The same seed gives the same bytes on any
number of cores. docs/forces.md derives the force of the wall (5.1) and the analytic limits (5.7).

The Z-width of a device is the range of stiffness K that it can render, from free air to the stiffest stable wall. A
sampled wall adds a little energy in every tick. Friction and damping of device, wall and hand remove energy. Above some
K the wall adds more than they remove, and the tip oscillates.

Each cell of a map is a simulated device at a flat wall. No hand holds the device unless stated. A *press* is one run of a
cell: the tip starts at a distance from the wall, with a speed, and a constant force above friction pushes it on. Each
stiffness gets five presses for each seed:

* three standard presses: 0.5 N from 0.1 mm, at 0, 50 and 200 mm/s;
* two presses of a low-discrepancy sequence. Over all stiffnesses it covers three ranges evenly: pushes from 0.05 N to 0.9 of
  the peak force, speeds up to 500 mm/s, and distances up to 2 mm.

A cell has the worst verdict of its presses. `--push`, `--hit` and `--start` fix the push, the speed and the distance. A
list of values makes one of them an axis of the map.

The verdicts follow. All verdicts except the first are columns of `--csv`. E1 is the work of the push over one encoder step.
A loop without encoder steps has 0.0001 mm in place of the step.

* *settles*: this is proven for each press, in one of two ways. Either friction holds the tip under a constant force, for so
  long that no earlier motion can still act through the delay or the velocity window. Or, in the last half of the run, the
  tip travels at most one encoder step and the motors give at most E1.
* *swings* (oscillates): the last half of a run is divided into eight windows. In the first four windows together, and again
  in the last four, the tip reverses at least twice, each time by more than one encoder step. If the travel falls from every
  window to the next, the motion dies out and is no oscillation. A creeping tip does not reverse, so it does not count as
  oscillating.
* *active*: in the first four windows together, and again in the last four, the motors give more than E1. A run is not active
  if the travel, or the energy of a window, falls from every window to the next.
* *arithmetic*: only the rounding of fixed-point numbers keeps the tip in motion. The loop has no encoder steps, the travel
  is below 1 µm, and the same presses settle in double. The cell counts as stable.
* *undecided*: neither settling nor oscillation is proven.

How a map is searched:

* A run ends when the tip is proven to have settled, at the latest after 60 s. The limit is longer if mass and damping make
  the motion slower. With friction and encoder steps an oscillation is chaotic: one run in a hundred stops only after 3 to
  45 s. `--seconds` makes the limit longer, never shorter.
* *First* is the lowest K of a column at which a run of any seed oscillates or is active; such a press is called bad. The
  search goes upwards in steps of 1 % to the first bad press. From there it goes down in steps of 2 %, as long as the same
  press, or one with a similar push, speed and distance, is bad at the lower K too. Then the last step is halved until it is
  0.5 %. For the whole arm the search goes upwards in the steps of the map, and only halves the last one until it is 0.5 %.
  Each cell above *first* is also run with the press that was bad at *first*.
* A picture has a bar from the lowest to the highest *first* of the seeds. Stable cells above *first* are reported
  separately, as re-entry.
* With friction the worst push is about half of the peak force. Then the force can oscillate with the largest amplitude
  between 0 and its peak, and friction takes the smallest fraction of the energy of this oscillation (docs/forces.md 5.7).
* Maps are made without the thermal limit of the motors. This limit lowers the force of hot motors, and so would end an
  oscillation.

A seed sets two things: the phase of the encoder steps relative to the wall, and the start of the sequence of presses. The
phase alone changes the first K of one press by up to a factor of two. All columns use the same seeds, so two columns differ
by their axes alone. `--seed` is the first seed, and `--seeds` the number of seeds, 5 by default.

*One axis*, the default, runs the code of the servo's coupling, velocity estimator, stabilisers and force limits, in the
number type of the loop, along one axis with exact mechanics of the device. *Whole arm* (`--arm`) runs the servo step
with the emulated device, its driver and its packets in virtual time. The arm also slides onto the flat and hits the corner
of three walls. It has one press of the sequence at each stiffness.

The mechanics are plausible values, not measured on a unit. For your device, give `--mass`, `--viscous`, `--friction` and
`--quantum`, or the file of `./kerf identify` ([gains](gains.md#identify-your-device)).

"""

DEVICES = """\
The table has the lowest K in N/mm that oscillates or is active. Each device has two dampings B: the default, and the one
with the highest K on the device's map.

* *Linear, exact* is the boundary of another loop: a linear two-sided wall with the backward difference as velocity, in
  double, without friction, encoder steps and limits. It is a solid line in a picture of that loop, and a dotted line in the
  pictures of all other loops.
* The firm hand has 0.1 kg, 0.005 N s/mm and 0.5 N/mm. In the column *whole arm* a spring of 0.2 N/mm pushes the tip, not a
  constant force.
* Each measured K is the lowest of five seeds. Undecided counts as unstable. The map of the whole arm has 14 stiffnesses.
* *Safe K, emulated* is the lowest K of the row divided by 1.5, for the emulated device alone. The margin is for cases that
  no run of the map met: other phases of the encoder steps, and unstable islands between two steps of the search. A test
  gives each of these 18 stiffnesses 10,000 random presses (`zwidth_maps`, in the part `ranges` of `.ci/all`). No press of
  the 180,000 oscillates or is active. A few are undecided. In these the push plus twice the friction is about the peak
  force, so the wall can hardly push the tip back.
* **Safe K, real unit**, in bold, is **the one to use with a real device that nobody has measured**. It is the highest
  stiffness that `./kerf controller --check` accepts without a warning at 1 kHz, for the device and B of the row. It assumes
  a viscous damping of 0.0002 N s/mm, less than the emulator has, and a delay of 2 ms in each row. It never exceeds the
  published maximum stiffness of the device ([gains](gains.md)). *none*: B is above the published maximum damping.
* The delay of a real device is not known. Assume two periods until you measure it.
* Do not use more damping than the damping with the highest stable K on the map. Beyond it, the lag of the velocity and the
  encoder steps drive the oscillation.

"""

STABILISERS = """
## Stabilisers

The table has the lowest unstable K with B = 0.002 N s/mm, of one seed. Each cell has two values: one axis / whole arm. Each
stabiliser is set to the mass and the damping of the device. The table includes hard pushes. If all pushes are light (`--push
0.5`), a stabiliser helps far more. [Energy](#the-effect-of-a-stabiliser-on-the-hand) has the effect on the hand.

The energy account of `passivity` counts a force in the tick that commands it. With a delay the force acts later, so the port
may give far more energy than the account shows. The column `port_minimum_mj` of `--csv` has the lowest energy of the port
over the runs of a cell. Once a cell oscillates and is active, its other runs are left out, and the column does not include
them.

"""

RATES = """\
In the linear theory, without friction, the boundary grows in proportion to the rate. The measured boundary grows less, for
two reasons. The encoder steps are the same at every rate. And at rates from 1 to 8 kHz the velocity window spans up to 16 ms. At
a high rate this lag spans more periods, and the loop tolerates less damping than the linear boundary predicts. In grey columns
the damping is unstable without any wall.

"""

KNOBS = """\
## The effect of each parameter

The device is an Omni with B = 0.002 N s/mm and a delay of one period. One parameter changes at a time; the default is
bold. K is in N/mm. The linear boundary includes mass, both dampings, delay, rate, hand and filter. *Re-entry* is the
lowest stable K above the first crossing. Five seeds, 40 stiffnesses from 0.05 to 50 N/mm. The rows of *filter* have the
estimator `difference`, so the bold one has the K of `difference`.

"""

NUMBERS = """
The two number types differ if a run is chaotic, as most runs near a boundary are in a loop with friction and encoder steps.
A difference of 2^-16 mm or N moves an encoder step to another tick, so the tip settles at another position. Neither number
type is better in general.

"""

FILES = """\
## Files of a map

`--csv` has one row for each cell: first the axes, in the order of `--help`, then the figures. A column of the map, which
is one combination of axis values, has no rows if it cannot exist, or if the hand never met the wall.

| column | unit | meaning |
|---|---|---|
| loop, device, damping_ns_per_mm, rate_hz, delay_periods, quantum_mm, friction_n, viscous_ns_per_mm, mass_kg, estimator, filter_ms, hand, mode_hz, numeric, law, stabiliser, limits, push_n, hit_mm_per_s, start_mm | in the name | value of each axis, as given or the default; `any`: the push, speed or distance was searched |
| stiffness_n_per_mm | N/mm | K of the cell |
| swings, active, undecided, arithmetic | 0 or 1 | verdict of the worst run; four zeros: the cell is proven to settle |
| travel_mm | mm | peak-to-peak travel in the last half of a run, the largest of all runs; 0: friction holds the tip |
| given_mj | mJ | energy that the motors give in the last half of a run, the largest of all runs |
| port_minimum_mj | mJ | lowest energy of the device port; each run begins at 0 |

`--json` has the whole map:

| key | meaning |
|---|---|
| version, seed, seeds, seconds, whole_arm | version of the program, first seed, number of seeds, shortest time limit of a run, true: with `--arm` |
| mapped, varied | axes of the picture; axes with several values |
| stiffness_n_per_mm | stiffness of each cell of a column, N/mm |
| columns | a list with one entry for each combination of axis values; each entry has the keys below |
| axes | value of each axis as a text, by the names of the CSV |
| impossible | reason that the column cannot exist, else null; if the hand never met the wall, it is null and `cells` is empty |
| by_travel, by_energy | first crossings by *swings* and by *active*, each with the keys of the next four rows |
| first_n_per_mm, reason | lowest K of all seeds; or null, and the reason: `below all`, `above all`, `undecided` (no cell is bad, one is undecided), `not measured` |
| last_n_per_mm, last_reason | the highest *first* of all seeds, or null and the reason |
| by_seed_n_per_mm, band_n_per_mm | lowest K of each seed, and its quantiles of 5 and 95 % over the seeds (use `--seeds 200`); null: no crossing, or below all |
| re_entry_from_n_per_mm, re_entry_to_n_per_mm | range of K above the first crossing in which cells settle again; null: none |
| undecided_from_n_per_mm | lowest K at which a run is undecided; null: none |
| analytic | exact_n_per_mm, passive_n_per_mm, quantum_n_per_mm: bounds of the linear loop; 0: no K is stable; null: there is no such bound. exact_holds, passive_holds: whether the bound applies to the loop of this column |
| cells | for each stiffness: swings, active, undecided, arithmetic, travel_mm, given_mj, port_minimum_mj |

"""

QUESTION = """\
## Which stiffness, and how it feels

Which K may a device render, for any push, in its worst direction? What does a hand feel at 30 Hz?

A map can take the device from a file. [`./kerf identify`](gains.md#identify-your-device) writes such a file for your device.
`examples/devices/premium15.toml` is a Phantom Premium 1.5 with published figures. Its mass is a matrix: in the heaviest
direction it is 2.6 times as large as in the lightest. A map is made for one direction, by default `worst`. By theory
(docs/forces.md 5.7) a push in this direction makes the device oscillate at the lowest stiffness. `--direction 1,0,0.5` sets
another one.

"""

ANSWER = """
*swings* and *energy* are the first K that oscillates and the first K that is active, from the lowest to the highest of the
seeds. *linear* is the boundary of the linear loop. *passive* is the highest K at which that loop is passive; 0: none.

So this device may render {k} N/mm at B = {b} N s/mm: the lowest K divided by 1.5, as in the table of devices. The next command
measures the same wall at several frequencies:

"""

FELT = """
At {hz} Hz a hand feels {wall_k} N/mm and {wall_b} N s/mm of the wall. That is stiffer and less damped than the wall of the
theory (docs/forces.md 5.8), because `foaw` lags behind the backward difference of the theory. At the device's port the hand
feels {port_k} N/mm and {port_b} N s/mm, because the inertia of the device counts as a negative stiffness. At frequencies
with negative damping the hand gets energy, unless its own damping takes more.

The line *furthest from theory* has the largest deviation of all rows. The theory assumes the estimator `difference` and no
stabiliser. The last line has two dampings. With the first damping or more in the device, device and wall would be passive with any
hand. The second is the damping that the device has.

`--estimator difference` gives the wall of the theory. `--arm` measures the whole servo step with an emulated device. `--log
DIR` measures the wall from a recording ([log](log.md)). For such a recording move your hand to and fro in the wall, faster
and faster, like a chirp. `--plot` draws the figures.

"""

HOW = """\
## Maps of your own

    ./kerf lab zwidth --quick --plot zwidth.svg                   # the theory's loop and kerf's side by side
    ./kerf lab zwidth --rate 4000 --delay 0.5 --csv map.csv       # any axis takes a value, a list or a range
    ./kerf lab zwidth --map delay,quantum --delay 0:3:13 --quantum 0:0.2:11 --plot k.svg # the highest K as a colour
    ./kerf lab zwidth --portraits portrait.svg --cells 1:0.002,10:0.002                  # speed over position; also with --arm
    ./kerf lab zwidth --arm --delay 0 --stiffness 0.1:50:40 --plot arm.svg               # the whole servo step; takes minutes
    ./kerf lab zwidth --stabiliser none,passivity,energy_bounding --plot s.svg           # one panel for each
    ./kerf lab zwidth --map push,stiffness --push 0.1:2.9:15 --damping 0.002 --plot p.svg # the stable K of each push
    ./kerf lab zwidth --seeds 200 --damping 0.002 --map delay,stiffness --delay 0,1,2 --json band.json # K of each seed

`--law`, `--estimator` and `--stabiliser` also take the laws that your own program registers (docs/own-law.md).

A map that is too large for one machine is cut into shards. Each shard keeps its finished columns in a part file, and
continues from there when it is started again. `--merge` refuses parts with other seeds, axes or another program, and names
a missing part. `examples/cluster/zwidth.sbatch` is a job array of Slurm. With GNU parallel:

    parallel ./kerf lab zwidth --rate 250,500,1000,2000 --jobs 1 --shard {}/8 --part zwidth-{}.part ::: {1..8}
    ./kerf lab zwidth --merge zwidth-*.part --plot zwidth.svg --csv zwidth.csv --json zwidth.json

"""

NAMES = {"omni": "Omni", "falcon": "Falcon", "woodenhaptics": "WoodenHaptics"}
MARGIN = 1.5

# Axis, its values, and options that they need. In bold: the standard.
KNOBS_MEASURED = [
    ("rate", "250,500,1000,2000,4000,8000"), ("delay", "0,0.5,1,2,3"), ("damping", "0,0.001,0.002,0.005,0.01,0.02"),
    ("friction", "0,0.05,0.1,0.26"), ("quantum", "0,0.01,0.055,0.2"), ("viscous", "0,0.0002,0.0005,0.002"),
    ("mass", "0.02,0.045,0.2"), ("hand", "none,light,firm"), ("estimator", "foaw,difference"),
    ("filter", "0,1,5", "--estimator", "difference"), ("law", "coupling,linear,two_sided"),
    ("stabiliser", "none,passivity,energy_bounding"), ("limits", "on,off"), ("numeric", "fixed,double")]


def exact_of(column):
    exact = column["analytic"]["exact_n_per_mm"]
    return NEVER if exact is None else exact


def value(column, axis):
    return column["axes"][AXES[axis][0]]


class Maps:
    """Measures maps with kerf-lab."""

    def __init__(self, order):
        self.program, self.quick, self.jobs = order["program"], order["quick"], order["jobs"]
        self.parent = os.getppid()

    def measure(self, axes, stiffnesses, more=()):
        quick = self.quick
        if os.getppid() != self.parent:  # the command was ended
            raise text.BadInput("kerf-lab: ended; no page is made")
        with tempfile.TemporaryDirectory() as folder:
            words = [self.program, "zwidth", *more, "--json", f"{folder}/map.json",
                     "--stiffness", "0.05:2:3" if quick else f"0.05:50:{stiffnesses}",
                     *(["--seeds", "1"] if quick and "--seeds" not in more else [])]
            for axis, values in axes.items():
                words += [f"--{axis}", values]
            if self.jobs:
                words += ["--jobs", str(self.jobs)]
            if subprocess.run(words, stdout=subprocess.DEVNULL, check=False).returncode != 0:
                raise text.BadInput(f"kerf-lab: {' '.join(words[1:])}: failed (above)")
            with open(f"{folder}/map.json", encoding="utf-8") as file:
                return json.load(file)

    def lowest(self, axes, arm):
        """The lowest crossing of each column of these axes."""
        found = self.measure(axes, 14 if arm else 40, ["--arm"] if arm else [])
        return {tuple(value(column, axis) for axis in ("device", "delay", "hand")): lowest(column)
                for column in found["columns"]}


def measure(order):
    maps, quick = Maps(order), order["quick"]
    devices = maps.measure({"device": ",".join(NAMES), "damping": "0:0.03:3" if quick else "0:0.03:31"}, 36)
    rates = maps.measure({"rate": "250,500,1000,2000,4000,8000", "damping": "0:0.03:3" if quick else "0:0.03:21"}, 30,
                         ["--seeds", "1"])
    return json.dumps({"provenance": order["provenance"], "highest_n_per_mm": 2 if quick else 50, "devices": devices, "rates": rates,
                       "table": measure_devices(maps, devices), "stabilisers": measure_stabilisers(maps),
                       "knobs": measure_knobs(maps, devices), "numbers": measure_numbers(maps),
                       "question": measure_question(order["program"])})


def measure_devices(maps, devices):
    """At the default damping, and at that of the highest K on the device's map."""
    delays = "1" if maps.quick else "0,1,2"
    rows = []
    for device in NAMES:
        of_device = [column for column in devices["columns"] if value(column, "device") == device]
        best = value(max(of_device, key=lambda column: min(lowest(column), exact_of(column))), "damping")
        for damping in [best] if maps.quick else ["0.002", best]:
            axes = {"device": device, "delay": delays, "damping": damping}
            exact = {value(column, "delay"): exact_of(column) for column in maps.measure(axes, 2)["columns"]}
            axis = maps.lowest({**axes, "hand": "none,firm"}, False)
            arm = maps.lowest(axes, True)
            checked = highest_checked(maps.program, device, damping)
            rows += [{"device": NAMES[device], "delay": delay, "damping": damping, "exact": exact[delay],
                      "axis": axis[device, delay, "none"], "held": axis[device, delay, "firm"],
                      "arm": arm[device, delay, "none"], "checked": checked} for delay in delays.split(",")]
    return rows


def highest_checked(program, device, damping):
    """The highest stiffness, rounded down, that --check accepts without a warning for a device at 1 kHz; 0 if it refuses the damping."""
    with tempfile.TemporaryDirectory() as folder:
        scene = os.path.join(folder, "wall.toml")

        def said(stiffness):
            with open(scene, "w", encoding="utf-8") as file:
                file.write('[[volume]]\nfile = "phantom"\nshape = "wall"\nsize = [64, 64, 40]\niso = 0.5\n'
                           '[[tool]]\nshape = "ball"\nradius_mm = 2\n[cut]\nmodel = "none"\n'
                           f'[device]\npersonality = "{device}"\n'
                           f"[force]\nstiffness_n_per_mm = {stiffness:.9g}\ndamping_ns_per_mm = {damping}\n")
            done = subprocess.run([os.path.join(os.path.dirname(program), "kerf-controller"), "--check", "--scene", scene],
                                  capture_output=True, text=True, check=False)
            return done.stdout + done.stderr

        text_of_least = said(0.01)
        if "force.damping_ns_per_mm" in text_of_least and "is above" in text_of_least:
            return 0
        found = re.search(r"^highest_stable_stiffness_n_per_mm=(.*)$", text_of_least, re.MULTILINE)
        if not found:
            raise text.BadInput(f"kerf-lab: kerf-controller --check: {text_of_least.strip()}")
        highest = float(below(float(found[1]) / MARGIN, 2))
        if cap := re.search(r"force\.stiffness_n_per_mm = \S+ is above ([\d.]+)", said(highest)):
            return float(cap[1])
        return highest


def measure_stabilisers(maps):
    axes = {"device": ",".join(NAMES), "delay": "1" if maps.quick else "0,1,2", "damping": "0.002",
            "stabiliser": "none" if maps.quick else "none,passivity,energy_bounding"}
    rows = {}
    for found in (maps.measure(axes, 40, ["--seeds", "1"]), maps.measure(axes, 14, ["--arm", "--seeds", "1"])):
        for column in found["columns"]:
            row = rows.setdefault((value(column, "device"), value(column, "delay")), {})
            row.setdefault(value(column, "stabiliser"), []).append(lowest(column))
    return [{"device": NAMES[device], "delay": delay, "lowest": row} for (device, delay), row in rows.items()]


def measure_knobs(maps, devices):
    standard = {**devices["columns"][0]["axes"], AXES["damping"][0]: "0.002"}  # the Omni's
    rows = []
    for axis, values, *more in KNOBS_MEASURED:
        for column in maps.measure({"damping": "0.002", axis: values}, 40, more)["columns"]:
            rows.append({"name": axis, "unit": AXES[axis][1], "value": value(column, axis),
                         "standard": value(column, axis) == standard[AXES[axis][0]],
                         "swings": crossing(column["by_travel"]), "active": crossing(column["by_energy"]),
                         "exact": exact_of(column), "re_entry": column["by_travel"]["re_entry_from_n_per_mm"] or 0})
    return rows


def measure_numbers(maps):
    """Cells with another verdict than in double."""
    found = maps.measure({"numeric": "fixed,double", "damping": "0:0.03:3" if maps.quick else "0:0.03:20"}, 30)
    columns = {(value(column, "numeric"), value(column, "damping")): column for column in found["columns"]}
    rows = []
    for numeric in ("fixed",):
        row = {"numeric": numeric, "cells": 0, "others": 0, "columns": 0, "factor": 1}
        for (kind, damping), column in columns.items():
            if kind != numeric or not column["cells"]:
                continue
            truth = columns["double", damping]
            row["cells"] += len(column["cells"])
            row["others"] += sum(a["swings"] != b["swings"] for a, b in zip(column["cells"], truth["cells"]))
            x, y = crossing(column["by_travel"]), crossing(truth["by_travel"])
            if 0 < x < NEVER and 0 < y < NEVER:
                row["columns"] += x != y
                row["factor"] = max(row["factor"], x / y, y / x)
        rows.append(row)
    return rows


def measure_question(program):
    """The two commands, as the page prints them, and what they find."""
    def run(words):
        with tempfile.TemporaryDirectory() as folder:
            done = subprocess.run([program, *words, "--json", f"{folder}/a.json"], stdout=subprocess.PIPE, text=True, check=False,
                                  cwd=ROOT)
            if done.returncode != 0:
                raise text.BadInput(f"kerf-lab: {' '.join(words)}: failed (above)")
            with open(f"{folder}/a.json", encoding="utf-8") as file:
                data = json.load(file)
        # The time of the run is that of this machine alone.
        lines = [line.split(",")[0] + ", ..." if "servo steps in" in line else line for line in done.stdout.splitlines()]
        return ["$ ./kerf lab " + " ".join(words), *lines], data
    device = ["--device", "examples/devices/premium15.toml"]
    bears, found = run(["zwidth", *device, "--damping", "0.002,0.006", "--stiffness", "0.1:10:16"])
    k = below(min(lowest(found["columns"][0]), exact_of(found["columns"][0])) / MARGIN, 2)
    feels, felt = run(["impedance", *device, "--stiffness", k, "--damping", "0.002", "--frequency", "1,10,30,100"])
    return {"zwidth": bears, "impedance": feels, "stiffness": k, "damping": "0.002", "felt": felt["rows"]}


def question(data):
    row = min(text.rows_of(data, "felt"), key=lambda row: abs(row["hz"] - 30))

    def shown(lines):
        return "".join(f"    {line}\n" for line in lines)
    figures = {f"{of}_{what[0]}": text.figure(row[of]["measured"][f"{what}_n{unit}_per_mm"])
               for of in ("wall", "port") for what, unit in (("damping", "s"), ("stiffness", ""))}
    return (QUESTION + shown(data["zwidth"]) + ANSWER.format(k=data["stiffness"], b=data["damping"]) + shown(data["impedance"])
            + FELT.format(hz=text.figure(row["hz"]), wall_k=figures["wall_s"], wall_b=figures["wall_d"], port_k=figures["port_s"],
                          port_b=figures["port_d"]))


def first_below(highest):
    """The text of a first crossing; the ends are those of all maps of the page."""
    return lambda n_per_mm: f"> {highest}" if n_per_mm == NEVER else text.figure(n_per_mm) if n_per_mm > 0 else "< 0.05"


def below(number, digits):
    """Rounded down to so many digits: a limit that is printed as safe is safe."""
    step = 10.0 ** (math.floor(math.log10(number)) + 1 - digits)
    return f"{math.floor(number / step + 1e-9) * step:.{digits}g}"


def emulated(row):
    least = min(row["axis"], row["held"], row["arm"], row["exact"])
    return below(least / MARGIN, 2) if least > 0 else "none"


def checked(row):
    return f"**{below(row['checked'], 2)}**" if row["checked"] > 0 else "none"


def page(data, devices, rates):
    kinds, first = list(text.rows_of(data, "stabilisers")[0]["lowest"]), first_below(data["highest_n_per_mm"])
    return (ABOUT + f"## Devices\n\n![Maps of three devices]({devices})\n\n" + DEVICES
            + text.table(["device", ">delay, periods", ">B, N s/mm", ">linear, exact", ">one axis", ">with a firm hand",
                          ">whole arm", ">safe K, emulated", ">safe K, real unit"],
                         [[row["device"], row["delay"], row["damping"], text.figure(row["exact"]), first(row["axis"]),
                           first(row["held"]), first(row["arm"]), emulated(row), checked(row)] for row in text.rows_of(data, "table")])
            + STABILISERS
            + text.table(["device", ">delay, periods", *(f">{kind}" for kind in kinds)],
                         [[row["device"], row["delay"], *(" / ".join(map(first, row["lowest"][kind])) for kind in kinds)]
                          for row in data["stabilisers"]])
            + f"\n## Rates\n\n![Maps of six rates]({rates})\n\n" + RATES + KNOBS
            + text.table(["parameter", ">value", ">oscillates from", ">active from", ">linear, exact", ">re-entry"],
                         [[", ".join(filter(None, (row["name"], row["unit"]))),
                           f"**{row['value']}**" if row["standard"] else row["value"], first(row["swings"]),
                           first(row["active"]), text.figure(row["exact"]),
                           text.figure(row["re_entry"]) if row["re_entry"] > 0 else "-"] for row in data["knobs"]])
            + "\n## Fixed point and double\n\nA map of the Omni, with dampings from 0 to 0.03 N s/mm, was made in each number type:\n\n"
            + "".join(f"* {row['numeric']} point and double: {row['others']} of {row['cells']} cells oscillate in only one of the two. "
                      f"The first crossing (the lowest K that oscillates)\n  differs in {row['columns']} columns, by a factor of at most {row['factor']:.3g}.\n"
                      for row in data["numbers"])
            + NUMBERS + question(data["question"]) + HOW + FILES + data["provenance"] + "\n")


def devices(data):
    return draw_map(data["devices"])


def rates(data):
    return draw_map(data["rates"])


def draw_map(data):
    import stability_map  # needs matplotlib
    return stability_map.map(data)
