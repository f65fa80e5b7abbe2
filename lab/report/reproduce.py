# SPDX-License-Identifier: Apache-2.0
"""Published numbers beside kerf's own (docs/reality.md), for `kerf-lab reproduce`.

measure reads {program, rows, only, plots, jobs, provenance}: the path of kerf-lab, a file of rows ("": reproduce.toml), names of
sources ("a,b", "": all), whether the plots are measured, too, its --jobs (0: all cores), and day and machine of the run. It
returns the JSON that tables, page, regions and energy read:

    provenance, unexplained     the latter: how many misses have no explanation
    sources                     {name, cite, seen}, of the rows
    rows                        {source, place, group, what, published, unit, kerf, verdict, held, unknown, why}: texts or numbers,
                                kerf's in the row's unit; verdict is match, miss or shown
    regions                     {beta, sigma, cells: [{beta, sigma, light, hard}]}, or null
    energy                      {panels: [{title, curves: [{label, s, port_mj}]}]}, or null

A file of rows is TOML: `functions`, a Python file with further functions (optional), [[source]] tables {name, cite, seen} and [[row]]
tables {source, place, group, what, published, unit, function, parameters, compare, held, unknown, why}."""
import concurrent.futures
import contextlib
import importlib.util
import inspect
import json
import math
import os
import pathlib
import re
import stat
import subprocess
import sys
import tempfile
import threading
import tomllib

import reproduce_rows
import text

ROWS = pathlib.Path(__file__).with_name("reproduce.toml")
SLOWEST_HZ = 250  # of a map
# What a unit is of, and its size in kerf's.
UNITS = {"N/mm": ("stiffness", 1), "N/m": ("stiffness", 1e-3), "N s/mm": ("damping", 1), "N s/m": ("damping", 1e-3),
         "N": ("force", 1), "mm": ("length", 1), "m": ("length", 1e3), "um": ("length", 1e-3), "kg": ("mass", 1), "g": ("mass", 1e-3),
         "s": ("time", 1), "ms": ("time", 1e-3), "Hz": ("rate", 1), "kHz": ("rate", 1e3), "mJ": ("energy", 1), "uJ": ("energy", 1e-3),
         "mm3/s": ("removal", 1), "%": ("share", 0.01), "1": ("number", 1), "text": ("text", None)}
COMPARE = re.compile(r"within (?P<percent>\d+(\.\d+)?) %|within a factor of (?P<factor>\d+(\.\d+)?)|within (?P<off>\d+(\.\d+)?)|"
                     r"(?P<bound>at least|at most|equal|shown)")
LARGEST = 1e300  # of what is published: a quotient of it and kerf's number is finite
MOST_BYTES = 1 << 20  # of a file of rows
SOURCE_KEYS = {"name", "cite", "seen"}
ROW_KEYS = {"source", "place", "group", "what", "published", "unit", "function", "compare", "held"}
MORE_KEYS = {"parameters", "unknown", "why"}


class Kerf:
    """Runs of kerf-lab, each made once."""

    def __init__(self, order):
        self.program, self.jobs, self.parent = order["program"], order["jobs"], os.getppid()
        self.lock, self.done = threading.Lock(), {}

    def run(self, words, given=None):
        key = json.dumps([words, given])
        with self.lock:
            future = self.done.get(key)
            mine = future is None
            if mine:
                future = self.done[key] = concurrent.futures.Future()
        if mine:
            try:
                future.set_result(self.start(words, given))
            except BaseException as error:
                future.set_exception(error)
        return future.result()

    def start(self, words, given):
        if os.getppid() != self.parent:  # the command was ended
            raise text.BadInput("kerf-lab: ended; no row is made")
        if words[0] == "zwidth":
            with tempfile.TemporaryDirectory() as folder:
                self.call([*words, "--json", f"{folder}/map.json"], given)
                return pathlib.Path(folder, "map.json").read_text(encoding="utf-8")
        return self.call(words, given)

    def call(self, words, given):
        made = subprocess.run([self.program, *words], input=given, capture_output=True, text=True, check=False)
        if made.returncode != 0:
            raise text.BadInput(made.stderr.strip().splitlines()[-1] if made.stderr.strip() else f"{' '.join(words)}: failed")
        return made.stdout

    def map(self, stiffness, seeds=5, whole_arm=False, **axes):
        """A map as `kerf lab zwidth --json` writes it: `axes` by the names of its options, a value or a list. A loop slower than
        250 Hz is the same map with time stretched: masses, dampings and speeds scaled, stiffness and forces as they are."""
        rate = float(axes.get("rate", 1000))
        if rate < SLOWEST_HZ:
            axes = slowed(axes, rate / SLOWEST_HZ)
        if stiffness == 2:  # only the theory's limits are read
            stiffness, seeds = [0.05, 0.06], 1
        words = ["zwidth", *(["--arm"] if whole_arm else []), "--jobs", "1", "--seeds", str(seeds), "--stiffness", words_of(stiffness)]
        for axis, value in axes.items():
            words += [f"--{axis}", words_of(value)]
        return json.loads(self.run(words))

    def column(self, stiffness, **axes):
        columns = self.map(stiffness, **axes)["columns"]
        if len(columns) != 1 or not (columns[0]["cells"] or stiffness == 2):
            raise text.BadInput(f"one column is wanted, and {axes} has {columns[0]['impossible'] or len(columns)}; give one value each")
        return columns[0]

    def probe(self, name, **figures):
        return json.loads(self.run(["reproduce", "--probe", name], json.dumps(figures)))

    def devices(self):
        return json.loads(self.run(["reproduce", "--probe", "devices"]))

    def regions(self):
        """The plane of Diolaiti et al.: a wall of 1 N/mm at 1 kHz and steps of 0.1 mm; damping and friction of the device vary."""
        beta = [0.05, 0.15, 0.25, 0.35, 0.45, 0.55, 0.65, 0.75, 0.85, 0.95]
        k_n_per_mm, period_s, step_mm = 1, 0.001, 0.1
        verdicts = {}
        for name, press in {"light": {"push": 0.05, "hit": 0, "start": 0}, "hard": {"push": 1, "hit": 200, "start": 1}}.items():
            found = self.map([k_n_per_mm, 1.000001 * k_n_per_mm], 3, mass=0.1, damping=0, delay=0, quantum=step_mm,
                             viscous=[b * k_n_per_mm * period_s for b in beta], friction=[s * k_n_per_mm * step_mm for s in beta],
                             **press, **reproduce_rows.PAPERS)
            for column in found["columns"]:
                b = float(column["axes"]["viscous_ns_per_mm"]) / k_n_per_mm / period_s
                s = float(column["axes"]["friction_n"]) / k_n_per_mm / step_mm
                cell = column["cells"][0]
                verdict = next((word for word in ("swings", "active", "undecided") if cell[word]), "rests")
                verdicts.setdefault((round(b, 6), round(s, 6)), {})[name] = verdict
        return {"beta": beta, "sigma": beta, "cells": [{"beta": b, "sigma": s, **verdict} for (b, s), verdict in verdicts.items()]}


def words_of(value):
    return ",".join(words_of(one) for one in value) if isinstance(value, (list, tuple)) else \
        f"{value:.9g}" if isinstance(value, float) else str(value)


def slowed(axes, factor):
    """The axes of a loop at 250 Hz that moves as this one does at 250 Hz x factor, with time shorter by that factor."""
    powers = {"mass": 2, "viscous": 1, "damping": 1, "hit": -1, "filter": 1}
    unscaled = set(axes) - set(powers) - {"rate", "delay", "friction", "quantum", "law", "numeric", "push", "start", "limits", "estimator"}
    if unscaled:
        raise text.BadInput(f"a loop below {SLOWEST_HZ} Hz: {', '.join(sorted(unscaled))} cannot be scaled; leave it out")
    return {**{name: value * factor ** powers[name] if name in powers else value for name, value in axes.items()}, "rate": SLOWEST_HZ}


def refuse(path, place, why):
    raise text.BadInput(f"{path}: {place}: {why}")


def load(path):
    """Sources by their names, rows and functions of a file, checked. Errors have one line: file, place, way out."""
    try:
        found = os.stat(path)
        if not stat.S_ISREG(found.st_mode) or found.st_size > MOST_BYTES:
            raise text.BadInput(f"{path}: is no regular file of at most 1 MiB; name a file of rows")
        with open(path, "rb") as file:
            data = tomllib.load(file)
    except OSError as error:
        raise text.BadInput(f"{path}: {error.strerror}; name a file of rows") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise text.BadInput(f"{path}: no TOML: {error}; correct it") from None
    unknown = set(data) - {"functions", "source", "row"}
    if unknown:
        refuse(path, sorted(unknown)[0], "unknown; a file has functions, [[source]] and [[row]]")
    functions = dict(reproduce_rows.FUNCTIONS)
    if "functions" in data:
        functions |= functions_of(pathlib.Path(path).parent / str(data["functions"]))
    sources = {}
    for number, source in enumerate(tables_of(path, data, "source"), 1):
        place = f"source {number} ({source.get('name', 'no name')})"
        check_keys(path, place, source, SOURCE_KEYS, set())
        if source["name"] in sources:
            refuse(path, place, "is given twice; give it another name")
        sources[source["name"]] = source
    rows = tables_of(path, data, "row")
    for number, row in enumerate(rows, 1):
        check_row(path, f"row {number} ({str(row.get('what', 'no what'))[:60]})", row, sources, functions)
    if not rows:
        refuse(path, "[[row]]", "none; give at least one")
    return sources, rows, functions


def tables_of(path, data, name):
    value = data.get(name, [])
    if not isinstance(value, list) or not all(isinstance(one, dict) for one in value):
        refuse(path, name, f"is no list of tables; write [[{name}]]")
    return value


def functions_of(path):
    if path.suffix != ".py":
        raise text.BadInput(f"{path}: is no Python file; let `functions` name one that ends in .py")
    spec = importlib.util.spec_from_file_location("own_rows", path)
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:  # a reader's file may raise anything
        raise text.BadInput(f"{path}: {type(error).__name__}: {error}; correct it, or leave `functions` out") from None
    return {name: value for name, value in vars(module).items() if hasattr(value, "unit")}


def check_keys(path, place, table, needed, more):
    for key in sorted(needed - set(table)):
        refuse(path, place, f"no {key}; give it" + ("" if key != "unit" else f": one of {', '.join(UNITS)}"))
    for key in sorted(set(table) - needed - more):
        refuse(path, place, f"{key}: unknown; it may have {', '.join(sorted(needed | more))}")
    for key in sorted((needed | more) & set(table) - {"published", "parameters"}):
        if not isinstance(table[key], str) or not table[key].strip():
            refuse(path, place, f"{key}: is no text; write some")


def check_row(path, place, row, sources, functions):
    check_keys(path, place, row, ROW_KEYS, MORE_KEYS)
    if row["source"] not in sources:
        refuse(path, place, f"source: {row['source']}: no [[source]] has this name; add one")
    if row["unit"] not in UNITS:
        refuse(path, place, f"unit: {row['unit']}: unknown; take one of {', '.join(UNITS)}")
    if isinstance(row["published"], bool) or not isinstance(row["published"], str if row["unit"] == "text" else (int, float)):
        refuse(path, place, f"published: {row['published']}: " + ("is no text; write one" if row["unit"] == "text" else
                                                                 "is no number; give one, or the unit \"text\""))
    if row["unit"] != "text" and not abs(row["published"]) <= LARGEST:
        refuse(path, place, f"published: {row['published']:g}: is not finite; give the number of the source")
    function = functions.get(row["function"])
    if function is None:
        refuse(path, place, f"function: {row['function']}: unknown; there are {', '.join(sorted(functions))}")
    if function.unit != "any" and str(function.unit) not in UNITS:
        refuse(path, place, f"function: {row['function']}: gives {function.unit}, an unknown unit; take any or one of {', '.join(UNITS)}")
    if function.unit != "any" and UNITS[function.unit][0] != UNITS[row["unit"]][0]:
        refuse(path, place, f"unit: {row['unit']}: the function {row['function']} gives {function.unit}; take its kind of unit")
    parameters = row.setdefault("parameters", {})
    if not isinstance(parameters, dict):
        refuse(path, place, "parameters: is no table; write such as { rate = 1000 }")
    try:
        inspect.signature(function).bind(None, **parameters)
    except TypeError as error:
        refuse(path, place, f"parameters: {error}; see {row['function']}")
    if "of" in parameters and parameters["of"] not in functions:
        refuse(path, place, f"parameters: of: {parameters['of']}: no function; there are {', '.join(sorted(functions))}")
    compare = COMPARE.fullmatch(row["compare"])
    if not compare:
        refuse(path, place, f"compare: {row['compare']}: unknown; give within N %, within a factor of N, within N, at least, at most, "
                            "equal or shown")
    if compare["factor"] and float(compare["factor"]) < 1:
        refuse(path, place, f"compare: {row['compare']}: no number is within it; give a factor of 1 or more")
    if (row["unit"] == "text") != (compare["bound"] == "equal"):
        refuse(path, place, f"compare: {row['compare']}: texts are equal or not, numbers are near; take the other")
    if "unknown" in row and compare["percent"]:
        refuse(path, place, f"compare: {row['compare']}: a source that leaves {row['unknown']} out can be compared by its order alone; "
                            "take within a factor of N, within N (of an exponent), at least, at most or shown")


def verdict_of(row, value):
    """match, miss or shown."""
    compare, published = COMPARE.fullmatch(row["compare"]), row["published"]
    if compare["bound"] == "shown":
        return "shown"
    if compare["bound"] == "equal":
        holds = value == published
    elif compare["bound"]:
        holds = value >= published if compare["bound"] == "at least" else value <= published
    elif compare["percent"]:
        holds = abs(value - published) <= abs(published) * float(compare["percent"]) / 100
    elif compare["factor"]:
        holds = value * published > 0 and 1 / float(compare["factor"]) <= value / published <= float(compare["factor"])
    else:
        holds = abs(value - published) <= float(compare["off"])
    return "match" if holds else "miss"


def measure_row(kerf, row, function, path):
    try:
        value = function(kerf, **row["parameters"])
    except text.BadInput as error:
        refuse(path, f"row ({row['what'][:60]})", str(error))
    except (Exception, SystemExit) as error:  # a reader's function may raise anything
        refuse(path, f"row ({row['what'][:60]})", f"{row['function']}: {type(error).__name__} {error}; correct its parameters")
    if row["unit"] != "text":
        if isinstance(value, str) or not isinstance(value, (int, float)):
            refuse(path, f"row ({row['what'][:60]})", f"{row['function']} gave {value!r}, no number; take another function")
        unit = row["unit"] if function.unit == "any" else function.unit
        value = value * UNITS[unit][1] / UNITS[row["unit"]][1]
    made = {key: row.get(key, "") for key in ("source", "place", "group", "what", "published", "unit", "held", "unknown", "why")}
    verdict = verdict_of(row, value)
    return {**made, "compare": row["compare"], "kerf": value if isinstance(value, str) or math.isfinite(value) else "none", "verdict": verdict}


def measure(order):
    with contextlib.redirect_stdout(sys.stderr):  # what a reader's function prints is no part of the JSON
        return json.dumps(measured(order))


def measured(order):
    path = order["rows"] or str(ROWS)
    sources, rows, functions = load(path)
    if order["only"]:
        wanted = order["only"].split(",")
        for name in wanted:
            if name not in sources:
                raise text.BadInput(f"--only: {name}: no source of {path}; it has {', '.join(sources)}")
        rows = [row for row in rows if row["source"] in wanted]
        if not rows:
            raise text.BadInput(f"--only: {order['only']}: no row has this source; take another")
    kerf = Kerf(order)
    with concurrent.futures.ThreadPoolExecutor(order["jobs"] or os.cpu_count()) as pool:
        made = list(pool.map(lambda row: measure_row(kerf, row, functions[row["function"]], path), rows))
    used = {row["source"] for row in made}
    return {"provenance": order["provenance"], "unexplained": sum(row["verdict"] == "miss" and not row["why"] for row in made),
            "sources": [source for source in sources.values() if source["name"] in used], "rows": made,
            "regions": kerf.regions() if order["plots"] else None, "energy": energy_panels(kerf) if order["plots"] else None}


def energy_panels(kerf):
    """Contacts with a wall of 100 N/mm, and of 1 N/mm whose force acts 15 ms late, each with and without observer and controller."""
    panels = []
    for title, figures in {"100 N/mm, no delay": {"stiffness_n_per_mm": 100, "seconds": 0.5},
                           "1 N/mm, a delay of 15 ms": {"stiffness_n_per_mm": 1, "delay_periods": 15, "seconds": 1}}.items():
        curves = []
        for passivity, label in ((0, "spring alone"), (1, "observer and controller")):
            run = kerf.probe("contact", passivity=passivity, start_mm=1, **figures)
            curves.append({"label": label, "s": run["s"], "port_mj": run["port_mj"], "observed_mj": run["observed_mj"]})
        panels.append({"title": title, "curves": curves})
    return {"panels": panels}


# --- the page

HEAD = """\
# Compared with published numbers

`./kerf lab reproduce --page docs/reality.md` makes this page. Each number in the column `kerf` comes from a run of kerf's code; none
is typed in.

* A *match* is within the tolerance of its row.
* A *miss* is printed and [explained](#the-misses), never left out.
* A row is *shown* without a verdict if its source does not publish something that a verdict needs.
* If kerf's number is not the same quantity as the published number, the row names it after `kerf:`.

If a parameter is not published, only orders of magnitude, exponents and directions are compared, and a match means no more than that.

Nothing here was measured on a device. Of most sources only the abstract, or a quotation in another work, was read;
[Sources](#sources) lists what was read of each.

In the tables K is the stiffness of the wall and B its damping; b and f are the viscous damping and the Coulomb friction of the device;
D is the encoder step and T the period of the servo.

"""

ADD = """\
## Add a row

A row is one TOML table. `lab/report/reproduce.toml` has the rows of this page. Write your rows to another file and name it with `--rows`:

    functions = "mine.py"   # only if a row needs a function that lab/report/reproduce_rows.py does not have

    [[source]]
    name = "me-2026"
    cite = "A. Author: A title. A journal 1, 2026"
    seen = "table 2"

    [[row]]
    source = "me-2026"
    place = "table 2, row 3"
    group = "Stability of a sampled wall"
    what = "highest stable K, B = 0"
    published = 1200
    unit = "N/m"
    function = "linear_stiffness"
    parameters = { mass = 0.1, viscous = 0.0006, damping = 0, rate = 1000, delay = 0 }
    compare = "within 10 %"
    held = "mass, damping and rate of the paper"

* `compare` is `within N %`, `within a factor of N`, `within N`, `at least` or `at most` for numbers, `equal` for texts, or `shown`.
  With `at least`, kerf's number must be at least the published number.
* `unknown` names the parameters that the source does not publish. A row with `unknown` may not have `within N %`.
* `why` explains a miss. A miss without `why` makes the command end with exit code 1.
* `function` is a Python function that gets `kerf` and the row's `parameters`. For maps the parameters are the options of
  `./kerf lab zwidth --help`.

A file of functions marks each function with the unit of its number:

    from reproduce_rows import gives, linear_stiffness

    @gives("N/mm")
    def half_of_it(kerf, **axes):
        return linear_stiffness(kerf, **axes) / 2

    ./kerf lab reproduce --rows mine.toml               # prints the rows
    ./kerf lab reproduce --only chai3d,isaac-lab        # only the rows of these sources

"""


def figure(value, digits=3):
    """So many digits, and all before the point."""
    if isinstance(value, str):
        return value
    return f"{value:.{digits}g}" if abs(value) < 10 ** digits else f"{value:.0f}"


def digits_of(published):
    """Kerf's number has as many digits as the published one, at least three."""
    return 3 if isinstance(published, str) else max(3, len(f"{published:g}".lstrip("-0.").replace(".", "")))


def deviation(row):
    if row["unit"] == "text" or isinstance(row["kerf"], str):
        return "-"
    if row["compare"].startswith("within ") and not row["compare"].endswith("%") and "factor" not in row["compare"]:
        return f"{row['kerf'] - row['published']:+.2g}"
    if not row["published"]:
        return "-"
    part = row["kerf"] / row["published"]
    if not 0.5 < part < 2:
        return f"x {part:.3g}" if part > 0 else "-"
    return f"{100 * (part - 1):+.1f} %" if abs(part - 1) >= 0.0005 else "0.0 %"


def with_unit(value, row):
    number = figure(value, digits_of(row["published"])) if value != 0 else "0"
    return number if row["unit"] in ("1", "text") or value == "none" else f"{number} {row['unit']}"


def tables(data):
    groups = {}
    for row in text.rows_of(data):
        groups.setdefault(row["group"], []).append(row)
    return "".join(f"## {group}\n\n" + text.table(
        ["published", ">number", ">kerf", ">deviation", "verdict", "held constant"],
        [[f"{row['what']} [{row['source']}: {row['place']}]", with_unit(row["published"], row), with_unit(row["kerf"], row),
          deviation(row), f"**{row['verdict']}**" if row["verdict"] == "miss" else
          row["verdict"] if row["verdict"] == "shown" else f"match ({row['compare']})", held(row)] for row in rows]) + "\n"
        for group, rows in groups.items())


def held(row):
    return row["held"] + (f"; parameter not published: {row['unknown']}" if row["unknown"] else "")


def summary(data):
    rows = text.rows_of(data)
    count = {verdict: sum(row["verdict"] == verdict for row in rows) for verdict in ("match", "miss", "shown")}
    return (f"{len(rows)} numbers of {len(data['sources'])} sources: {count['match']} match, {count['miss']} miss, {count['shown']} are shown "
            f"without a verdict.\n\n")


def misses(data):
    found = [row for row in data["rows"] if row["verdict"] == "miss"]
    if not found:
        return ""
    return "## The misses\n\n" + "".join(
        f"* *{row['what']}* [{row['source']}]: {with_unit(row['published'], row)} published, {with_unit(row['kerf'], row)} here. "
        f"{row['why'] or 'Not explained.'}\n" for row in found) + "\n"


def page(data, regions_link, energy_link):
    return (HEAD + summary(data)
            + f"![The plane of Diolaiti et al.]({regions_link})\n\n" + REGIONS + f"![Port energy of a contact]({energy_link})\n\n" + ENERGY
            + tables(data) + misses(data)
            + "## Sources\n\n" + "".join(f"* **{source['name']}**: {source['cite']}. Read: {source['seen']}.\n" for source in data["sources"])
            + "\n" + ADD + data["provenance"] + "\n")


REGIONS = """\
The axes are those of Diolaiti et al.: damping b over K T, and friction f over K times the encoder step D. Each square stands for two
runs against a spring wall of 1 N/mm, called *presses* in the tables below: a push of 0.05 N from the wall's surface, and a hit at
200 mm/s with 1 N. Both have 0.1 kg, 1 kHz, encoder steps of 0.1 mm, no delay, exact numbers and no limits.

* Right of b/(KT) = 1/2 and above f/(KD) = 1/2 the wall is passive.
* Left of b/(KT) = 1/2 and above f/(KD) = 1/2 the wall is not passive. The tip still settles, because friction dissipates the energy
  that sampling adds.
* Below f/(KD) = 1/2 friction cannot hold the tip against the force of one encoder step. Near this line the tip settles after one or
  both of the presses, and far below it after neither.

"""

ENERGY = """\
The curves show the energy that the device port has taken from the hand, computed from the true work of the motors. Below 0 the wall
has given energy to the hand. A force of 1 N pushes a mass of 0.1 kg with damping of 0.2 N s/m onto the wall from a distance of 1 mm.
Observer and controller are the servo's (docs/forces.md 5.6), at 1 kHz.

"""


def regions(data):
    import figure as fig
    from matplotlib.patches import Patch, Rectangle
    plane = data["regions"]
    colours = {("rests", "rests"): ("#CFE8DC", "settles after both"), ("rests", "other"): ("#F7E3A1", "settles after the push only"),
               ("other", "rests"): ("#B8B4DC", "settles after the hit only"), ("other", "other"): ("#F0B79B", "settles after neither")}
    picture, axes = fig.new_figure(760, 560, left=75, right=25, top=45, bottom=110)
    axes = axes[0][0]
    half = (plane["beta"][1] - plane["beta"][0]) / 2
    for cell in plane["cells"]:
        kinds = tuple("rests" if cell[name] == "rests" else "other" for name in ("light", "hard"))
        axes.add_patch(Rectangle((cell["beta"] - half, cell["sigma"] - half), 2 * half, 2 * half, facecolor=colours[kinds][0],
                                 edgecolor="white", linewidth=0.8))
    axes.axvline(0.5, color=fig.BLACK, linewidth=1.8, label="b/(KT) = 1/2")
    axes.axhline(0.5, color=fig.BLUE, linewidth=1.8, linestyle="--", label="f/(KD) = 1/2")
    for axis, label in (("x", "viscous damping of the device, b / (K T)"), ("y", "Coulomb friction, f / (K D)")):
        getattr(axes, f"set_{axis}lim")(0, plane["beta"][-1] + half)
        getattr(axes, f"set_{axis}label")(label)
    axes.set_title("A spring wall in the axes of Diolaiti et al.")
    handles = [Patch(color=colour, label=label) for colour, label in colours.values()] + axes.get_legend_handles_labels()[0]
    picture.legend(handles=handles, loc="lower center", ncols=3)
    return fig.svg(picture)


def energy(data):
    import figure as fig
    panels = data["energy"]["panels"]
    picture, rows = fig.new_figure(1120, 430, columns=len(panels), left=80, right=25, top=45, bottom=60, across=85)
    for axes, panel in zip(rows[0], panels):
        for curve, colour in zip(panel["curves"], (fig.RED, fig.BLUE)):
            axes.plot(curve["s"], curve["port_mj"], color=colour, label=curve["label"])
        axes.axhline(0, color=fig.BLACK, linewidth=0.8)
        axes.set_yscale("symlog", linthresh=1)
        axes.set_title(panel["title"])
        axes.set_xlabel("time (s)")
        axes.set_ylabel("energy taken by the port (mJ)")
        axes.grid(True, axis="y")
        axes.legend(loc="lower left")
    return fig.svg(picture)
