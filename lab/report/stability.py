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

Made by `./kerf lab zwidth --page docs/stability.md`; every figure comes from one run, nothing is typed by hand. The
same seed gives the same bytes on any number of cores. docs/forces.md 5.7 derives the analytic limits, 5.1 the force
of the wall.

The Z-width of a device is the range of stiffness K that it can render, from free air to the stiffest stable wall. A
sampled wall adds a little energy in every tick; damping of device, wall and hand removes it. Above some K more is added
than removed, and the tip oscillates.

Each cell of a map is a simulated device at a flat wall, without a hand unless stated. A *press* is one run of such a cell: the tip
starts at a distance from the wall with a speed, and a constant force above friction pushes it on. Each stiffness gets three
standard presses (0.5 N from 0.1 mm at 0, 50 and 200 mm/s) and two presses of a sequence. Over all stiffnesses the sequence
covers evenly the pushes from 0.05 N to 0.9 of the peak force, speeds up to 500 mm/s and distances up to 2 mm. All presses
are repeated for each seed, and a cell has the worst verdict of all. `--push`, `--hit` and `--start` fix the push, the speed
and the distance; a list of values makes one of them an axis of the map.

The verdicts, by the names of their columns:

* *rests* (settles): proven for each run. Either friction holds the tip under a constant force for longer than the memory of
  the loop, or in the last half of the run the travel is at most one encoder step and the motors give at most the energy of
  a push over it. A loop without encoder steps settles if the travel is at most 0.0001 mm.
* *swings* (oscillates): the last half of a run has eight windows. In the first four and in the last four of them the tip
  reverses at least twice, each time after more than one encoder step, and its travel does not decrease from each window to
  the next. A creeping tip does not reverse, so it does not count as oscillating.
* *active*: in the first four windows and in the last four the motors give more energy than a push over one encoder step
  takes, and neither the travel nor this energy decreases from each window to the next.
* *arithmetic*: only the rounding of fixed-point numbers keeps up a motion. The loop has no encoder steps, the travel is below
  1 µm, and the same runs settle in double. It counts as stable.
* *undecided*: any other cell.

How a map is searched:

* A run ends when it is proven to have settled, else after 60 s, or later if mass and damping make the motion slower than that.
  An oscillation with friction and encoder steps is chaotic: one run in a hundred stops only after 3 to 45 s. `--seconds`
  makes the limit longer, never shorter, so no verdict depends on it.
* *First* is the lowest K of a column at which a run of any seed oscillates or is active. The search goes upwards in steps of
  1 %. Then presses near the bad one are tried 2 % lower, again and again until none of them is bad, and the last step is halved to
  0.5 %. For the whole arm the search goes upwards in the steps of the map, and halves the last one to 0.5 %. Cells above
  *first* are tried with the bad press, too. The picture has a bar from the lowest to the highest *first* of a single seed. Stable cells above are reported separately,
  because a hand cannot reach them.
* With friction the worst push is about half of the peak: the oscillation then has the most room between no force and the
  peak, and friction takes the smallest part of a large oscillation (docs/forces.md 5.7).
* There is no thermal limit: weaker motors would end an oscillation.

A seed sets the phase of the encoder steps relative to the wall, which changes K by up to a factor of two for one press. It
also sets the start of the sequence of presses. Seeds are the same in every column, so that two columns differ by their axes
alone. `--seed` is the first seed, `--seeds` their number, 5 unless given.

*One axis* runs the servo's own coupling, velocity estimator, stabilisers and force limits, as the same templates and in
the loop's numbers, with exact mechanics. *Whole arm* (`--arm`) runs the servo step with the emulated device, its driver
and its packets in virtual time; it also slides onto the flat and hits the corner of three walls, and has one press of
the sequence at each stiffness. The mechanics are plausible values, not those of a unit. For your device, give `--mass`,
`--viscous`, `--friction` and `--quantum`, or the file of `./kerf identify` ([gains](gains.md#identify-your-device)).

"""

DEVICES = """\
The lowest K in N/mm that oscillates or is active, at two dampings B: the default, and the one with the highest K on the
device's map.

* *Linear, exact* is the boundary of another loop: a linear two-sided wall with the backward difference, in double,
  without friction, encoder steps and limits. In the picture it is a solid line in a map of that loop, and a dotted line in all others.
* The firm hand has 0.1 kg, 0.005 N s/mm, 0.5 N/mm. In *whole arm* a spring of 0.2 N/mm pushes.
* Each measured K is the lowest of five seeds; undecided counts as unstable. The whole arm has 14 stiffnesses.
* *Safe K, emulated* is the minimum of the row over 1.5, for the emulated device alone. The margin covers phases and islands between two
  steps that no run of the map met. Of 10,000 random presses at each of them none oscillates or is active (`zwidth_maps`, the
  part `ranges` of `.ci/all`); a few in 180,000 are undecided: there the push plus twice the friction is the peak force, so the tip creeps out.
* **Safe K, real unit**, in bold, is the highest stiffness of the row's device and B that `kerf controller --check` accepts without a warning at
  1 kHz: **the one to use with a real device that nobody has measured**. It assumes a viscous damping of
  0.0002 N s/mm, less than that of the emulator, and a delay of 2 ms in each row. It never exceeds the published maximum of the
  device ([gains](gains.md)). *none*: B is above the published maximum.
* The delay of a real device is not known; assume two periods until you measure it.
* Take no more damping than the map shows as stable: beyond its maximum the lag of the velocity and the encoder steps
  drive the oscillation.

"""

STABILISERS = """
## Stabilisers

The lowest unstable K with B = 0.002 N s/mm and a stabiliser that has the device's mass and damping, as one axis / whole arm, of one seed.
A stabiliser helps against a light push alone (`--push 0.5`) far more than against a hard one.
[Energy](#the-effect-of-a-stabiliser-on-the-hand) has the effect on the hand. `passivity` accounts for a force in the tick that commands it. With a delay the force
acts later, and the port may give far more energy than the account shows: `port_minimum_mj` of `--csv` has the lowest energy of the
port in each cell. The first run that both oscillates and is active ends the search of its cell.

"""

RATES = """\
By the linear theory, without friction, the boundary grows in proportion to the rate. The measured one grows less. Encoder
steps are the same at every rate. The velocity window spans up to 16 ms at every rate, so at a high rate its lag is more
periods, and the loop tolerates less damping than the linear boundary predicts. In grey columns the damping is unstable without any wall.

"""

KNOBS = """\
## The effect of each parameter

An Omni with B = 0.002 N s/mm and a delay of one period; one parameter changes at a time, the default is bold, K in N/mm.
The linear boundary includes mass, both dampings, delay, rate, hand and filter. *Re-entry* is the lowest stable K above
the first crossing. Five seeds, 40 stiffnesses from 0.05 to 50 N/mm.

"""

NUMBERS = """
The two differ if a run is chaotic. Near every boundary of a loop with friction and encoder steps it is: a difference of 2^-16 mm
or N moves an encoder step to another tick, and with it the position at which the tip settles. Neither number type is better in
general.

"""

FILES = """\
## Files of a map

`--csv` has one row for each cell, with the axes as `--help` lists them, then the figures. A column that cannot exist has
no rows.

| column | unit | meaning |
|---|---|---|
| loop, device, damping_ns_per_mm, rate_hz, delay_periods, quantum_mm, friction_n, viscous_ns_per_mm, mass_kg, estimator, filter_ms, hand, mode_hz, numeric, law, stabiliser, limits, push_n, hit_mm_per_s, start_mm | in the name | value of each axis, as given or the default; `any` for a push, speed or distance: searched |
| stiffness_n_per_mm | N/mm | K of the cell |
| swings, active, undecided, arithmetic | 0 or 1 | verdict of the worst run; a cell with four zeros is proven to settle |
| travel_mm | mm | peak to peak in the last half of a run, the largest of all runs; 0: held by friction |
| given_mj | mJ | energy that the motors gave in that half |
| port_minimum_mj | mJ | lowest energy of the device port in a run that begins at 0 |

`--json` has the whole map:

| key | meaning |
|---|---|
| version, seed, seeds, seconds, whole_arm | version of the program, first seed, number of seeds, shortest time limit of a run, whether with `--arm` |
| mapped, varied | axes of the picture; axes with several values |
| stiffness_n_per_mm | stiffness of each cell of a column, N/mm |
| columns | a list, one for each combination of the other axes, of the following |
| axes | value of each axis as a text, by the names of the CSV |
| impossible | reason for a column without cells; null: it has cells |
| by_travel, by_energy | crossings by *swings* and *active*, each with the next four rows |
| first_n_per_mm, reason | lowest K of all seeds; or null, and the reason: `below all`, `above all`, `undecided` (no cell is bad, one is undecided), `not measured` |
| last_n_per_mm, last_reason | the same of the seed that crosses last |
| by_seed_n_per_mm, band_n_per_mm | lowest K of each seed, and the quantiles of 5 and 95 % over the seeds (use `--seeds 200`); null: none, or below all |
| re_entry_from_n_per_mm, re_entry_to_n_per_mm | range of K above the first crossing in which cells settle again; null: none |
| undecided_from_n_per_mm | lowest K at which a run is undecided; null: none |
| analytic | exact_n_per_mm, passive_n_per_mm, quantum_n_per_mm: bounds of the linear loop, 0: nothing is stable, null: for another loop; exact_holds, passive_holds: whether this column's loop is the one of the bound |
| cells | swings, active, undecided, arithmetic, travel_mm, given_mj, port_minimum_mj of each stiffness |

"""

QUESTION = """\
## Which stiffness, and how it feels

Which K may a device render, for any push, in its worst direction, and what does a hand feel at 30 Hz? A map can take the
device from a file; [`./kerf identify`](gains.md#identify-your-device) writes such a file for your device.
`examples/devices/premium15.toml` is a Phantom Premium 1.5 by published figures. Its mass is a matrix: 2.6 times as heavy in one
direction as in another. `worst` is the
direction with the lowest stiffness that any push makes oscillate, by theory (docs/forces.md 5.7); `--direction 1,0,0.5`
sets another one.

"""

ANSWER = """
So it may render {k} N/mm at B = {b} N s/mm, the lowest K over 1.5 as in the table above. The same wall over frequency:

"""

FELT = """
At {hz} Hz a hand feels {wall_k} N/mm and {wall_b} N s/mm of the wall. That is stiffer and less damped than the wall of the theory
(docs/forces.md 5.8), because `foaw` lags behind the difference that the theory has. At the device's port it feels
{port_k} N/mm and {port_b} N s/mm, since the mass counts against the spring. Where the damping is negative, the hand gets energy,
unless it damps more than that itself. `--estimator difference` gives the wall of the theory, and `--arm` measures the whole
servo step with an emulated device. `--log DIR` measures the wall in a recording ([log](log.md)) of a hand that moves to and fro
in it, faster and faster, like a chirp. `--plot` draws the figures.

"""

HOW = """\
## Maps of your own

    ./kerf lab zwidth --quick --plot zwidth.svg                   # the theory's loop and kerf's side by side
    ./kerf lab zwidth --rate 4000 --delay 0.5 --csv map.csv       # any axis takes a value, a list or a range
    ./kerf lab zwidth --map delay,quantum --delay 0:3:13 --quantum 0:0.2:11 --plot k.svg # the highest K as a colour
    ./kerf lab zwidth --portraits portrait.svg --cells 1:0.002,10:0.002                  # position against speed; --arm too
    ./kerf lab zwidth --arm --delay 0 --stiffness 0.1:50:40 --plot arm.svg               # the whole servo step; minutes
    ./kerf lab zwidth --stabiliser none,passivity,energy_bounding --plot s.svg           # one panel for each
    ./kerf lab zwidth --map push,stiffness --push 0.1:2.9:15 --damping 0.002 --plot p.svg # what is stable for a light push alone
    ./kerf lab zwidth --seeds 200 --damping 0.002 --map delay,stiffness --delay 0,1,2 --json band.json # K of each seed

`--law`, `--estimator` and `--stabiliser` also take the laws that your own program registers (docs/own-law.md).

A map larger than one machine is cut into shards. Each keeps its finished columns in a part file and goes on from there
when it is started again; `--merge` refuses parts of other seeds, programs or axes, and names what is missing. `examples/cluster/zwidth.sbatch`
is a job array of Slurm. With GNU parallel:

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
            + text.table(["parameter", ">value", ">swings from", ">active from", ">linear, exact", ">re-entry"],
                         [[", ".join(filter(None, (row["name"], row["unit"]))),
                           f"**{row['value']}**" if row["standard"] else row["value"], first(row["swings"]),
                           first(row["active"]), text.figure(row["exact"]),
                           text.figure(row["re_entry"]) if row["re_entry"] > 0 else "-"] for row in data["knobs"]])
            + "\n## Fixed point and double\n\n"
            + "".join(f"* {row['numeric']}: {row['others']} of {row['cells']} cells have another verdict than in double; the "
                      f"first crossing differs in {row['columns']} columns, at most by a\n  factor of {row['factor']:.3g}.\n"
                      for row in data["numbers"])
            + NUMBERS + question(data["question"]) + HOW + FILES + data["provenance"] + "\n")


def devices(data):
    return draw_map(data["devices"])


def rates(data):
    return draw_map(data["rates"])


def draw_map(data):
    import stability_map  # needs matplotlib
    return stability_map.map(data)
