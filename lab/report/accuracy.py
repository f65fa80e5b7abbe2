# SPDX-License-Identifier: Apache-2.0
"""The part of docs/contact.md on the accuracy of each setting, and its plot. JSON of `kerf lab accuracy --report`:

    provenance                  day, machine and compiler of the run
    rows                        one for each figure: {knob, value, standard, plain, shape, metric, figure, unit, us_p50, us_p99}.
                                standard: nothing is changed; plain: the times are those of plain loops of the lab"""
import math
import re

import text

ABOUT = """\
## Accuracy of each setting

Made by `./kerf lab accuracy --page docs/contact.md`: all tables of this part come from one run. On one machine a run repeats
bit for bit, except for the times. `--csv` writes all figures, each metric on each shape; `--report` writes them as JSON.
`./kerf lab accuracy --scene mine.toml` measures the default contact with the tool and the voxels of a scene.

A ball of 0.625 mm radius touches six shapes, at 100 positions each and at depths up to its radius: a plane at 100 tilts, a
ball, a torus, a plate as thin as two voxels of 0.125 mm, a groove of 90 degrees (crease), and a ball of enamel around dentin.
One setting is changed at a time. All others have their standard value, in bold in the tables.

"""

PROXY = """\
### The swept proxy

This is the default contact (docs/theory.md 4), as the servo runs it. From a position of contact a hand goes straight down,
into the solid. The tool should stay at the position of contact. So the spring should be as long as the distance that the
hand went, and point back along it. Faces are ramps over two voxels, as a scanner has them.

* `depth`: distance of the tool's centre along the normal from its ideal position of rest, in voxels.
* `force`: relative error of the spring's length against the distance that the hand went. `direction`: angle of the spring to
  the normal. Both are measured only if this distance is at least a tenth of the radius.
* `step`: the change of the force if the hand moves 0.00125 mm along the face (a hundredth of the standard voxel), relative
  to the force.
* `us p50`, `p99`: times of one tick that slides on the ball, without milling.

"""

NOTICED = """\
What a hand can notice:

* A difference in the direction of two forces: from 18.4 degrees on if the picture shows the same directions, from 25.6
  without a picture (Barbagli, Salisbury, Ho, Spence, Tan 2006, means of two of the three conditions in the abstract).
* A difference in magnitude: from 7 % on, at 2.5 to 10 N (Pang, Tan, Durlach 1991, abstract).

So with the standard settings the largest error of the direction is {direction} times smaller than a hand can notice, and the
largest error of the force is {force} times smaller. With voxels half as wide a tick takes {fine_time} times as long, and the largest
error of the direction is {fine_direction} instead of {standard_direction} degrees. Both angles are far below what a hand notices. So a hand does
not need small voxels. Use them for a shape that is thinner than two voxels.

"""

PAPER = """\
### The paper's force

One setting of the paper's contact force (docs/forces.md 7.1) is changed at a time. The standard has Q15 weights, a tool
pitch of one voxel, `farid` gradients stored as int16, trilinear interpolation, and voxels of 0.125 mm in 128^3.

The true force is that of the shape itself with sharp faces: F = -p0 SURFINT rho n dA over the tool's surface, exact to 1e-4.
Forces are fractions of full scale, p0 pi R^2. `rms` and `max` are over all shapes unless stated.

* `direction`: the angle to the true force, where this force is at least a tenth of full scale.
* `loop`: |SUM dW| / SUM |dW| around tilted circles with a radius of 0.375 mm, for one sample or for the whole tool. It is
  the work that a static tooth gives or takes on a closed path, and should be 0.
* `us p50`, `p99`: times of one tick of the tool without milling. Q15 runs the fast kernels of the servo in the methods
  `gather`, `aligned` and `splat`. Double runs the servo's C++ template, without fast kernels. Times in brackets are of
  plain loops of the lab (Q8, Q12, splines, other interpolations). Do not compare them with other times.

"""

REMOVAL = """\
### Removal

This study does not measure removal; `tests/kernel/milling_test.cpp` has limits for it. One stamp of a ball with a radius of
five voxels removes the ball's volume to 1 %. A straight sweep of a ball with a radius of ten voxels removes its capsule to 1
%, if the ball's centre stays on the lattice of the voxels. Off the lattice no sweep is that exact. A sweep is a row of
stamps, and each voxel at the rim is partly covered by many of them. By the paper's overlap rule each stamp removes the
covered fraction of the density that is left. If the stamps are a quarter of a voxel to a whole voxel apart, the radius of
the groove is up to about half a voxel larger than the tool's.
"""

PERCENT, PERMILLE, PPM = 100, 1000, 1e6

# What a hand tells apart, with a picture (Barbagli et al. 2006, Pang et al. 1991: see NOTICED).
HAND_DIRECTION_DEG, HAND_FORCE = 18.4, 0.07

# Column of a table: title, metric, factor to the title's unit, shape.
THEORY = ("force rms %", "force_vs_theory_rms", PERCENT, "all")
THEORY_MAX = ("max %", "force_vs_theory_max", PERCENT, "all")
DIRECTION = ("direction rms deg", "force_direction_rms", 1, "all")
DEPTH = ("depth rms vox", "depth_rms", 1, "all")
DEPTH_MAX = ("max vox", "depth_max", 1, "all")
STEP_PERCENT = ("step max %", "step_max", PERCENT, "all")
DIRECTION_MAX = ("max deg", "force_direction_max", 1, "all")
DOUBLE = ("against double rms ppm", "force_vs_double_rms", PPM, "all")
DOUBLE_MAX = ("max ppm", "force_vs_double_max", PPM, "all")
NORMAL = ("normal rms deg", "normal_rms", 1, "ball")
NORMAL_MAX = ("max deg", "normal_max", 1, "ball")
CORNER = ("corner rms", "interpolation_rms", 1, "corners")
CORNER_MAX = ("max", "interpolation_max", 1, "corners")
SAMPLE_LOOP = ("loop, sample", "loop_sample_rms", 1, "all")
TOOL_LOOP = ("loop, tool", "loop_tool_rms", 1, "all")
STEP = ("step max permille", "step_max", PERMILLE, "all")
NOISE = ("noise", "noise_gain", 1, "noise")
MEMORY = ("bytes a voxel", "memory", 1, "any")
SAMPLES = ("samples", "samples", 1, "any")
ORDER = ("order", "order", 1, "all")

PROXY_COLUMNS = [SAMPLES, DEPTH, DEPTH_MAX, THEORY, THEORY_MAX, DIRECTION, DIRECTION_MAX, STEP_PERCENT]
# Knob and what it is.
PROXY_KNOBS = [
    ("proxy voxel", "Edge of a voxel. The shapes keep their size in mm."),
    ("proxy spacing", "Distance of the samples on the tool's surface, relative to the servo's own distance."),
    ("proxy numbers", "Number type of the loop."),
    ("proxy kernels", "Instruction sets of this machine. They give the same bits. kerf plans the rate of a scene for each of them (docs/scenes.md)."),
]

# Knob, its text, its columns.
TABLES = [
    ("arithmetic", """\
### Arithmetic

`against double` is the difference to the force of the same program text in double, in millionths of full scale. `corner` is
the error of one trilinear interpolation between eight random 16-bit values, in units of their last bit. The servo has Q15
and double. Q8 and Q12 are coarser weights in the same interpolation.""",
     [DOUBLE, DOUBLE_MAX, CORNER, CORNER_MAX, MEMORY]),
    ("pitch", """\
### Pitch of the tool's samples

The pitch is in voxel edges. A sample represents the cube around it. With a coarse pitch the cubes together do not have the
volume of the ball.""",
     [SAMPLES, THEORY, THEORY_MAX, DIRECTION, TOOL_LOOP, STEP]),
    ("kernel", """\
### Gradient kernel

`normal` is the angle between the gradient and the exact normal, at the voxels on the ball's face. `noise` is the standard
deviation of the gradient for white noise with a deviation of 1 in the voxels.""",
     [NORMAL, NORMAL_MAX, NOISE, SAMPLE_LOOP, TOOL_LOOP, THEORY]),
    ("storage", """\
### What is stored beside the density

Int16 gradients are the servo's method `gather`. `aligned` is its method for round tools, and `splat` its method for any tool
in scenes that cut; the time of `splat` includes the modification force. `spline 2` and `spline 3` are the exact derivative of
the density's quadratic and cubic B-spline: a reference for the accuracy, not for the time. The last row has voxels half as
wide. Compare it with the row 0.0625 mm, method `gather`, in "Voxel edge".""",
     [SAMPLES, MEMORY, DOUBLE, DOUBLE_MAX, THEORY, DIRECTION, SAMPLE_LOOP, TOOL_LOOP]),
    ("interpolation", """\
### Interpolation of the stored gradient

The servo has trilinear interpolation. The others are B-splines of degree 0, 2 and 3 in plain double. `step`: the change of
the force over 0.01 voxel along the face, in thousandths of full scale.""",
     [STEP, DIRECTION, SAMPLE_LOOP, TOOL_LOOP, THEORY, NOISE]),
    ("voxel", """\
### Voxel edge

The same shapes in 64^3, 128^3 and 256^3 voxels, with a tool pitch of one voxel. `order`: log2 of the ratio of the error in
the row above to the error in this row. A blur of a fixed width in voxels gives 2 in the limit.""",
     [SAMPLES, THEORY, THEORY_MAX, ORDER, DIRECTION, TOOL_LOOP]),
]

# A figure of a choice: {VALUE|COLUMN}, its time {VALUE|us}, or the ratio of two times {VALUE|VALUE}.
ADVICE = """\
### What to choose

* For a round tool: the method `aligned`. It takes {aligned|us} us a tick and is at most {aligned|DOUBLE_MAX} ppm of full scale away from double.
  Nothing is stored, so a cut refreshes nothing.
* For any other tool: `gather` ({int16 gradients|us} us, at most {int16 gradients|DOUBLE_MAX} ppm, {int16 gradients|MEMORY} bytes a voxel), and `splat` if the scene cuts
  ({splat|us} us, at most {splat|DOUBLE_MAX} ppm, nothing stored).
* Few samples favour `gather`, many `aligned`: {aligned|SAMPLES} samples take {int16 gradients|us} against {aligned|us} us, and {aligned 0.0625 mm|SAMPLES} (in voxels of 0.0625 mm)
  {0.0625 mm|us} against {aligned 0.0625 mm|us} us. The servo takes `aligned` if it can, because it also needs no memory and no refresh.
* Fixed point: Q15, at most {Q15|DOUBLE_MAX} ppm away from double (Q12 {Q12|DOUBLE_MAX}, Q8 {Q8|DOUBLE_MAX}). All of them are {Q15|THEORY} % away from the true force. For
  the hand Q8 would be enough. The kernels have Q15 because their 16 bits hold it.
* A pitch of 1. Half of it takes {1/2|1} times as long for an error of {1/2|THEORY} instead of {1|THEORY} %. A pitch of 2 has {2|THEORY} %.
* Gradients by `farid`: normals to {farid|NORMAL} deg rms (`sobel5` {sobel5|NORMAL}, `central` {central|NORMAL}). `central` blurs less, so its force
  is nearer to the true force ({central|THEORY} against {farid|THEORY} %). But it passes {central|NOISE} of the noise instead of {farid|NOISE}. And a closed path of
  the tool makes or takes {central|TOOL_LOOP} of the absolute work instead of {farid|TOOL_LOOP}.
* If a closed path must make no energy: a spline of the density. The loop of the tool makes or takes {spline 2|TOOL_LOOP}
  (quadratic) or {spline 3|TOOL_LOOP} (cubic) of the absolute work instead of {int16 gradients|TOOL_LOOP}.
* Never the nearest voxel. With it, a motion of 0.01 voxel can change the force by {nearest|STEP} thousandths of full scale; with
  trilinear interpolation, by {trilinear|STEP}.
* Most of the error against the true force is blur, by the kernel and by the ramp of one voxel at each face. Voxels of
  0.0625 mm instead of 0.125 mm take {0.0625 mm|0.125 mm} times as long in the method `gather`, and have {0.0625 mm|THEORY} instead of {0.125 mm|THEORY} %.

"""

SHAPES = ["plane", "ball", "torus", "plate", "crease", "layered ball", "all"]


class Entry:
    """One choice of a knob."""

    def __init__(self, row):
        self.knob, self.value, self.standard, self.plain = row["knob"], row["value"], row["standard"], row["plain"]
        self.us, self.us_p99 = row["us_p50"], row["us_p99"]
        self.figures = {}

    def find(self, metric, shape="all"):
        return self.figures.get((shape, metric))

    def cell(self, column):
        """Empty if the metric was not measured."""
        _, metric, scale, shape = column
        found = self.find(metric, shape)
        return "" if found is None else text.figure(found * scale)

    def time(self, us):
        return f"({text.figure(us)})" if self.plain else text.figure(us)

    @property
    def name(self):
        return f"**{self.value}**" if self.standard else self.value


def entries_of(data):
    entries = {}
    for row in text.rows_of(data):
        entry = entries.setdefault((row["knob"], row["value"]), Entry(row))
        entry.figures.setdefault((row["shape"], row["metric"]), row["figure"])
    return list(entries.values())


def advice(entries):
    by_value = {}
    for entry in entries:
        by_value.setdefault(entry.value, entry)

    def filled(found):
        value, what = found[1], found[2]
        if what == "us":
            return text.figure(by_value[value].us)
        if what in globals():
            return by_value[value].cell(globals()[what])
        return text.figure(by_value[value].us / by_value[what].us)

    return re.sub(r"\{([^{}|]+)\|([^{}|]+)\}", filled, ADVICE)


def knob_table(entries, knob, columns):
    return text.table([knob.removeprefix("proxy "), ">us p50", ">p99", *(">" + title for title, *_ in columns)],
                      [[entry.name, entry.time(entry.us), entry.time(entry.us_p99), *map(entry.cell, columns)]
                       for entry in entries if entry.knob == knob])


def shape_table(standard, columns):
    return text.table(["shape", *(">" + title for title, *_ in columns)],
                      [[shape, *(standard.cell((*column[:3], shape)) for column in columns)] for shape in SHAPES])


def of_proxy(entries):
    """The section of the default contact."""
    standard = next(entry for entry in entries if entry.standard)
    fine = [entry for entry in entries if entry.knob == "proxy voxel"][-1]
    direction, force = standard.find("force_direction_max"), standard.find("force_vs_theory_max")
    parts = [PROXY, NOTICED.format(
        direction=text.figure(HAND_DIRECTION_DEG / direction), force=text.figure(HAND_FORCE / force),
        fine_time=text.figure(fine.us / standard.us), fine_direction=text.figure(fine.find("force_direction_max")),
        standard_direction=text.figure(direction))]
    for knob, about in PROXY_KNOBS:
        parts.append(about + "\n\n" + knob_table(entries, knob, PROXY_COLUMNS) + "\n")
    return "".join(parts) + "The standard on each shape.\n\n" + shape_table(standard, PROXY_COLUMNS[1:]) + "\n"


def page(data, plot):
    all_entries = entries_of(data)
    proxy = [entry for entry in all_entries if entry.knob.startswith("proxy")]
    entries = [entry for entry in all_entries if entry not in proxy]
    parts = [ABOUT, data["provenance"], "\n\n", of_proxy(proxy), PAPER,
             f"![Error against the time of a tick]({plot})\n\n", advice(entries)]
    for knob, about, columns in TABLES:
        parts.append(about + "\n\n" + knob_table(entries, knob, columns) + "\n")
    standard = next(entry for entry in entries if entry.standard)
    columns = [THEORY, THEORY_MAX, DIRECTION, DIRECTION_MAX, SAMPLE_LOOP, TOOL_LOOP, STEP]
    parts.append("### The shapes\n\nThe standard on each shape.\n\n" + shape_table(standard, columns) + "\n")
    return "".join(parts) + REMOVAL


WIDTH, HEIGHT = 395, 290  # pixels of a panel
PANELS = [("force against theory, rms (% of full scale)", "force_vs_theory_rms", 100),
          ("direction of the force, rms (deg)", "force_direction_rms", 1),
          ("work of a closed loop, rms (fraction of the work to and fro)", "loop_tool_rms", 1),
          ("difference to double, rms (fraction of full scale)", "force_vs_double_rms", 1)]
BETTER = 0.99  # errors that differ by less are the same


def plot(data):
    """Errors against the time of a tick, both logarithmic. Each choice is a point in the colour of its knob; the line is the
    front, which no choice beats in both. A label is drawn if there is room for it, those of the front first."""
    import figure as fig
    from matplotlib.lines import Line2D
    colours = {"standard": fig.BLACK, "arithmetic": fig.ORANGE, "pitch": fig.SKY, "kernel": fig.GREEN, "storage": fig.RED,
               "interpolation": fig.PINK, "voxel": fig.BLUE}
    entries = [entry for entry in entries_of(data) if not entry.knob.startswith("proxy")]
    picture, axes = fig.new_figure(2 * (WIDTH + 95) + 20, 2 * (HEIGHT + 95) + 55, rows=2, columns=2, left=75, right=40, top=85,
                                   bottom=60, across=95, down=95)
    for panel, one in zip(PANELS, (axes[0][0], axes[0][1], axes[1][0], axes[1][1])):
        draw(one, panel, entries, colours)
    handles = [Line2D([], [], linestyle="none", marker="o", color=colour, label=knob) for knob, colour in colours.items()]
    handles.append(Line2D([], [], color=fig.GREY, linewidth=1.8, label="front"))
    picture.legend(handles=handles, loc="upper left", bbox_to_anchor=(0.06, 0.985), ncol=len(handles), columnspacing=1.6,
                   handletextpad=0.4)
    return fig.svg(picture)


def marks_of(entries, metric, scale):
    """(us, error, label, knob, whether it is of the front), by time. The standard is in every knob, and once in the plot."""
    marks = {}
    for entry in entries:
        error = entry.find(metric)
        if error is None or error <= 0:
            continue
        knob = "standard" if entry.standard else entry.knob
        label = knob if entry.standard else f"{knob} {entry.value}" if knob in ("pitch", "voxel") else entry.value
        marks.setdefault((knob, label), (entry.us, error * scale))
    best, found = math.inf, []
    for (knob, label), (us, error) in sorted(marks.items(), key=lambda mark: mark[1][0]):
        found.append((us, error, label, knob, error < BETTER * best))
        best = min(best, error)
    return found


def limits(values):
    """A logarithmic axis with room at both ends, as exponents."""
    length = max(math.log10(max(values) / min(values)), 0.3)
    return math.log10(min(values)) - 0.2 * length, math.log10(max(values)) + 0.15 * length


def draw(axes, panel, entries, colours):
    import figure as fig
    title, metric, scale = panel
    marks = marks_of(entries, metric, scale)
    if not marks:
        axes.remove()
        return
    axes.set_title(title)
    axes.set_xlabel("time of a tick, p50 (us)")
    axes.grid(True)
    ends = []
    for axis, values in (("x", [mark[0] for mark in marks]), ("y", [mark[1] for mark in marks])):
        low, high = limits(values)
        fig.log_axis(axes, axis, 10**low, 10**high, (1, 2, 5) if high - low < 2.5 else (1,))
        ends.append((low, high))
    front = [mark for mark in marks if mark[4]]
    axes.step([mark[0] for mark in front], [mark[1] for mark in front], where="post", color=fig.GREY, linewidth=1.8)
    axes.scatter([mark[0] for mark in marks], [mark[1] for mark in marks], s=26, zorder=3,
                 color=[colours[mark[3]] for mark in marks])

    def pixels(mark):
        return [(math.log10(value) - low) / (high - low) * size
                for value, (low, high), size in zip(mark, ends, (WIDTH, HEIGHT))]

    room = Room(WIDTH, HEIGHT)
    for mark in marks:
        x, y = pixels(mark)
        room.taken.append((x - 5, y - 5, x + 5, y + 5))
    for before, after in zip(front, front[1:]):  # right, then down
        (x0, y0), (x1, y1) = pixels(before), pixels(after)
        room.taken += [(x0 - 2, y0 - 2, x1 + 2, y0 + 2), (x1 - 2, y1 - 2, x1 + 2, y0 + 2)]
    for mark in sorted(marks, key=lambda mark: 0 if mark[4] else 1 if mark[3] == "standard" else 2):
        place = room.place(mark[2], *pixels(mark))
        if place:
            main = mark[4] or mark[3] == "standard"
            axes.text(place[0] / WIDTH, place[1] / HEIGHT, mark[2], transform=axes.transAxes, ha=place[2], va="center",
                      fontsize=8.5, color=fig.BLACK if main else "#666666")


class Room:
    """Places labels beside points, first come, first served: to the right or left, above or below, inside the panel and over
    nothing else. In pixels, y upward."""

    def __init__(self, width, height):
        self.width, self.height, self.taken = width, height, []

    def place(self, label, x, y):
        """(x, y, alignment), or None."""
        wide = 7 * len(label)
        for up in (0, 14, -14):
            for at, left, align in ((x + 9, x + 9, "left"), (x - 9, x - 9 - wide, "right"), (x, x - wide / 2, "center")):
                box = left, y + up - 7, left + wide, y + up + 7
                inside = box[0] >= 0 and box[1] >= 0 and box[2] <= self.width and box[3] <= self.height
                if inside and not any(box[0] < other[2] and other[0] < box[2] and box[1] < other[3] and other[1] < box[3]
                                      for other in self.taken):
                    self.taken.append(box)
                    return at, y + up, align
        return None
