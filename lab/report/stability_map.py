# SPDX-License-Identifier: Apache-2.0
"""Plots of stability. map (`kerf lab zwidth --plot`) reads the JSON of `--json`:

    mapped                      the two axes of the plot, "stiffness" or a name of AXES
    varied                      all axes that were given more than one value
    stiffness_n_per_mm          of the cells of a column
    seconds, seed, seeds, whole_arm    of the hits
    columns                     {axes, by_travel, by_energy, undecided_from_n_per_mm, analytic, cells}: the value of each
                                axis as a text; by each rule the lowest and the highest first crossing of the seeds, null
                                with a reason; cells {swings, active, undecided, arithmetic}, an empty list: not measured

portraits (`--portraits`) reads the same without mapped, varied and columns, and with

    axes                        the value of each axis
    cells                       {stiffness_n_per_mm, damping_ns_per_mm, hits: [{name, tip_mm, mm_per_s}]}"""
import math

from text import BadInput

NEVER = math.inf

# Key in `axes`, unit, and label in a plot if it is not the name with the unit.
AXES = {
    "loop": ("loop", ""), "device": ("device", ""),
    "damping": ("damping_ns_per_mm", "N s/mm", "damping of the wall, B (N s/mm)"),
    "rate": ("rate_hz", "Hz"), "delay": ("delay_periods", "periods", "delay from reading to force (periods)"),
    "quantum": ("quantum_mm", "mm", "step of the encoders at the tip (mm)"),
    "friction": ("friction_n", "N", "Coulomb friction of the device (N)"),
    "viscous": ("viscous_ns_per_mm", "N s/mm"), "mass": ("mass_kg", "kg"), "estimator": ("estimator", ""),
    "filter": ("filter_ms", "ms"), "hand": ("hand", ""), "mode": ("mode_hz", "Hz"), "numeric": ("numeric", ""),
    "law": ("law", ""), "stabiliser": ("stabiliser", ""), "limits": ("limits", ""),
    "push": ("push_n", "N", "push of the hand, above friction (N)"), "hit": ("hit_mm_per_s", "mm/s"), "start": ("start_mm", "mm")}
LOOPS = {"ideal": "the loop of the theory: linear, exact numbers", "kerf": "the loop of kerf: friction, encoder steps, its own force"}

RESTS, ACTIVE, SWINGS, UNDECIDED, NONE = "#CFE8DC", "#F7E3A1", "#F0B79B", "#B8B4DC", "#D9D9D9"
ARITHMETIC = "#9CCFE0"
HITS = {"push": "#0072B2", "50 mm/s": "#D55E00", "200 mm/s": "#009E73", "slide": "#CC79A7", "corner": "#E69F00"}
MOST_NUMBERS = 14  # a side: more do not fit into the cells


class Scale:
    """Positions of an axis' values: numbers to scale, words one after another. A cell ends half-way to its neighbours, of
    the stiffness by ratio."""

    def __init__(self, name, values):
        self.label = "stiffness of the wall, K (N/mm)" if name == "stiffness" else label_of(name)
        self.log, self.texts = name == "stiffness", None
        try:
            self.values = sorted(values, key=float)
            self.places = [float(value) for value in self.values]
        except ValueError:
            self.values = self.texts = list(values)
            self.places = list(range(len(values)))
        places = [math.log10(place) for place in self.places] if self.log else self.places
        if len(places) == 1:
            half = 0.1 if self.log else abs(places[0]) / 2 if places[0] and not self.texts else 0.5
            edges = [places[0] - half, places[0] + half]
        else:
            inner = [(a + b) / 2 for a, b in zip(places, places[1:])]
            edges = [2 * places[0] - inner[0], *inner, 2 * places[-1] - inner[-1]]
        self.edges = [10**edge for edge in edges] if self.log else edges

    def apply(self, axes, axis):
        getattr(axes, f"set_{axis}label")(self.label)
        if self.log:
            import figure as fig
            fig.log_axis(axes, axis, self.edges[0], self.edges[-1])
        else:
            getattr(axes, f"set_{axis}lim")(self.edges[0], self.edges[-1])
        if self.texts:
            getattr(axes, f"set_{axis}ticks")(self.places, self.texts)


def crossing(boundary, key="first_n_per_mm", reason="reason"):
    """A first crossing: 0 if even the lowest stiffness is bad, NEVER if none is, NaN if it is not measured."""
    texts = {"below all": 0, "above all": NEVER, "undecided": NEVER, "not measured": math.nan}
    return texts[boundary[reason]] if boundary[key] is None else boundary[key]


def lowest(column):
    """The lowest stiffness that is not proven to rest; 0 if the column has no cells."""
    if not column["cells"]:
        return 0
    undecided = column["undecided_from_n_per_mm"]
    return min(crossing(column["by_travel"]), crossing(column["by_energy"]), NEVER if undecided is None else undecided)


def label_of(name):
    _, unit, *label = AXES[name]
    return label[0] if label else f"{name} ({unit})" if unit else name


def foot(data, axes, varies):
    """The settings that all panels share."""
    def value(name):
        return axes[AXES[name][0]]

    def say(name, before="", after="", standard=None):
        return [] if name in varies or value(name) == standard else [f"{before}{value(name)}{after}"]

    is_loop = not {"loop", "device"} & set(varies)
    parts = say("device")
    if "device" not in varies:
        parts += say("mass", "", " kg") + say("viscous", "b ", " N s/mm")
    if is_loop:
        parts += say("friction", "friction ", " N") + say("quantum", "encoder ", " mm") + say("numeric")
        parts += say("estimator", "speed by ") + say("law", "law ", "", "coupling")
    parts += say("stabiliser", "stabiliser ", "", "none") + say("filter", "low-pass ", " ms", "0")
    parts += say("limits", "limits ", "", "on") if is_loop else []
    parts += say("mode", "mode ", " Hz", "0") if data["whole_arm"] else []
    parts += say("rate", "", " Hz") + say("delay", "delay ", " periods") + say("damping", "B ", " N s/mm") + say("hand", "hand ")
    parts += ["whole arm" if data["whole_arm"] else "one axis"]
    given = say("push", "push ", " N", "any") + say("hit", "hit ", " mm/s", "any") + say("start", "start ", " mm", "any")
    parts += given or ["any press"]
    parts += ["a slide", "a corner"] if data["whole_arm"] else []
    seed, seeds = data["seed"], data.get("seeds", 1)
    parts += [f"{data['seconds']:g} s each at most", f"seeds {seed} to {seed + seeds - 1}" if seeds > 1 else f"seed {seed}"]
    lines = [""]
    for part in parts:
        if len(lines[-1]) + len(part) > 150:
            lines.append("")
        lines[-1] += part + ", "
    return "\n".join(lines).rstrip(", ")


def panels(count, below, right=25):
    """A figure with so many panels, three side by side and four as a square, over a foot of `below` pixels."""
    import figure as fig
    across = min(count, 2 if count == 4 else 3)
    down = -(-count // across)
    width, height = max(1120, (535 + right) * across), 450 * down + below
    picture, axes = fig.new_figure(width, height, rows=down, columns=across, left=75, right=right, top=45, bottom=below + 60,
                                   across=70 + right, down=105)
    flat = [one for row in axes for one in row]
    for spare in flat[count:]:
        spare.remove()
    return picture, flat[:count], width, height


def map(data):
    import figure as fig
    columns = data["columns"]
    if not columns:
        raise BadInput("lab/report: the map has no columns; measure at least one")
    varies = data["varied"]
    x_axis, y_axis = data["mapped"]
    if x_axis == "stiffness":
        x_axis, y_axis = y_axis, x_axis
    by_title = {}
    for column in columns:
        titles = [LOOPS.get(column["axes"]["loop"], "") if name == "loop" else
                  f"{name} {column['axes'][AXES[name][0]]} {AXES[name][1]}".strip()
                  for name in varies if name not in data["mapped"]]
        by_title.setdefault(", ".join(titles), []).append(column)
    verdicts = y_axis == "stiffness"

    def scale(name):
        if name == "stiffness":
            return Scale(name, data["stiffness_n_per_mm"])
        return Scale(name, list(dict.fromkeys(column["axes"][AXES[name][0]] for column in columns)))

    x, y = scale(x_axis), scale(y_axis)
    picture, flat, width, height = panels(len(by_title), 150 if verdicts else 90, 25 if verdicts else 135)
    for axes, (title, of_panel) in zip(flat, by_title.items()):
        axes.set_title(title)
        x.apply(axes, "x")
        y.apply(axes, "y")
        if verdicts:
            draw_verdicts(axes, of_panel, x, y, AXES[x_axis][0])
        else:
            draw_heights(picture, axes, of_panel, x, y, (AXES[x_axis][0], AXES[y_axis][0]), data["stiffness_n_per_mm"])
    draw_legend(picture, columns, data["stiffness_n_per_mm"] if verdicts else None, (150 if verdicts else 85) / height)
    picture.text(20 / width, 18 / height, foot(data, columns[0]["axes"], varies), fontsize=8.5, color=fig.FRAME, va="bottom")
    return fig.svg(picture)


def colour_of(cell):
    verdicts = (("swings", SWINGS), ("active", ACTIVE), ("undecided", UNDECIDED), ("arithmetic", ARITHMETIC))
    return next((colour for name, colour in verdicts if cell[name]), RESTS)


def draw_verdicts(axes, columns, x, y, key):
    """Rectangles of one verdict each, and the boundaries as lines over them."""
    import figure as fig
    from matplotlib.patches import Rectangle
    lines = []
    for column in sorted(columns, key=lambda column: x.values.index(column["axes"][key])):
        i = x.values.index(column["axes"][key])
        colours = [colour_of(cell) for cell in column["cells"]]
        colours = colours or [NONE] * len(y.places)
        start = 0
        for k in range(1, len(colours) + 1):
            if k < len(colours) and colours[k] == colours[start]:
                continue
            axes.add_patch(Rectangle((x.edges[i], y.edges[start]), x.edges[i + 1] - x.edges[i], y.edges[k] - y.edges[start],
                                     facecolor=colours[start], edgecolor=colours[start], linewidth=0.6))
            start = k
        swing = column["by_travel"]
        lines.append([*analytic_lines(column), swing["first_n_per_mm"], column["by_energy"]["first_n_per_mm"]])
        band = [crossing(swing), crossing(swing, "last_n_per_mm", "last_reason")]
        if band[0] < band[1]:
            axes.vlines(x.places[i], *(min(max(end, y.edges[0]), y.edges[-1]) for end in band), **BAND)
    places = [x.places[x.values.index(value)] for value in x.values
              if any(column["axes"][key] == value for column in columns)]
    heights = [[value if value else math.nan for value in line] for line in zip(*lines)]
    for line, style in zip(heights, line_styles(len(places))):
        axes.plot(places, line, **style)


def analytic_lines(column):
    """The exact boundary if the column's loop is the one that it is derived for; the same if it is not, for loops that
    are at least near; then passive and quantum."""
    analytic = column["analytic"]
    exact, holds = analytic["exact_n_per_mm"], analytic["exact_holds"]
    near = column["axes"]["stabiliser"] == "none" and column["axes"]["law"] in ("coupling", "linear", "two_sided")
    passive = [analytic[key] if analytic["passive_holds"] else None for key in ("passive_n_per_mm", "quantum_n_per_mm")]
    return [exact if holds else None, exact if near and not holds else None, *passive]


BAND = {"color": "#D55E00", "linewidth": 3.5, "alpha": 0.45}


def line_styles(count):
    import figure as fig
    marker = "_" if count == 1 else None
    return [{"color": fig.BLACK, "linewidth": 2.2, "marker": marker, "markersize": 14},
            {"color": fig.GREY, "linewidth": 1.4, "linestyle": ":", "marker": marker, "markersize": 14},
            {"color": fig.BLUE, "linewidth": 1.6, "linestyle": "--", "marker": "x", "markersize": 4},
            {"color": fig.GREEN, "linewidth": 1.6, "linestyle": "-.", "marker": "^", "markersize": 5, "markerfacecolor": "white"},
            {"color": fig.RED, "linewidth": 1.2, "marker": "o", "markersize": 3.5},
            {"color": "#AA4499", "linestyle": "none", "marker": "o", "markersize": 6, "markerfacecolor": "none"}]


def draw_heights(picture, axes, columns, x, y, keys, stiffness):
    """The stiffness up to which each cell is stable, as a colour, and as a number if there is room."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LinearSegmentedColormap, LogNorm
    from matplotlib.patches import Rectangle
    import figure as fig
    low, high = stiffness[0], stiffness[-1] if stiffness[-1] > stiffness[0] else 1.1 * stiffness[0]
    colours = LinearSegmentedColormap.from_list("stiffness", [SWINGS, ACTIVE, "#8CC8B0"])
    norm = LogNorm(low, high)
    for column in columns:
        i, k = (scale.values.index(column["axes"][key]) for scale, key in ((x, keys[0]), (y, keys[1])))
        first = lowest(column) if column["cells"] else None
        is_open = first is not None and first == column["undecided_from_n_per_mm"]
        colour = NONE if first is None else UNDECIDED if is_open else colours(norm(min(max(first, low), high)))
        axes.add_patch(Rectangle((x.edges[i], y.edges[k]), x.edges[i + 1] - x.edges[i], y.edges[k + 1] - y.edges[k],
                                 facecolor=colour, edgecolor=colour, linewidth=0.6))
        if first is not None and max(len(x.values), len(y.values)) <= MOST_NUMBERS:
            text = f"<{low:g}" if first < low else f">{high:g}" if first > stiffness[-1] else \
                f"{first:.2g}" + ("?" if is_open else "")
            axes.text(x.places[i], y.places[k], text, ha="center", va="center", fontsize=8.5, color=fig.BLACK)
    box = axes.get_position()
    width = picture.get_figwidth() * 96
    bar_axes = picture.add_axes((box.x1 + 20 / width, box.y0, 14 / width, box.height))
    bar = picture.colorbar(ScalarMappable(norm, colours), cax=bar_axes)
    fig.ticks(bar.ax.yaxis, (1, 2, 5))
    bar.set_label("highest stiffness, by the stricter rule (N/mm)")


def draw_legend(picture, columns, stiffness, top):
    """`stiffness`: of the cells whose verdicts the panels show; None: they show the highest stiffness."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch
    patches = [(RESTS, "settles: proven"), (ACTIVE, "travel small or falling, but the wall goes on giving energy"),
               (SWINGS, "oscillates (a limit cycle, or worse)"), (UNDECIDED, "undecided: neither settling nor oscillation is proven"),
               (NONE, "not stable even without a wall, or not measured")]
    if any(cell["arithmetic"] for column in columns for cell in column["cells"]):
        patches.insert(3, (ARITHMETIC, "settles except for the rounding of fixed point: below 1 µm, settles in double"))
    groups = [[Patch(color=colour, label=label) for colour, label in (patches if stiffness else patches[-2:])]]
    if stiffness:
        def is_seen(values):
            return any(stiffness[0] <= (value or 0) <= stiffness[-1] for value in values)

        exact, other, passive, quantum, swing, energy = line_styles(2)
        groups.append([Line2D([], [], label="measured: first oscillation, of any seed", **swing),
                       Line2D([], [], label="bar: first oscillation of each seed", **BAND),
                       Line2D([], [], label="measured: first energy that goes on", **energy)])
        seen = [is_seen(values) for values in zip(*(analytic_lines(column) for column in columns))]
        groups.append([Line2D([], [], label=label, **style) for drawn, label, style in zip(
            seen, ("exact for this loop", "exact for another loop: linear two-sided wall,\nbackward difference, no friction, steps, limits",
                   "passive: stable with any hand", "friction exceeds the encoder steps (for B = 0)"),
            (exact, other, passive, quantum)) if drawn])
    for place, group in zip((0.015, 0.42, 0.66), groups):
        picture.legend(handles=group, loc="upper left", bbox_to_anchor=(place, top), borderaxespad=0)


def portraits(data):
    import figure as fig
    cells = data["cells"]
    if not cells:
        raise BadInput("lab/report: no cells; give at least one")
    picture, flat, width, height = panels(len(cells), 60)
    for axes, cell in zip(flat, cells):
        axes.set_title(f"K {cell['stiffness_n_per_mm']:g} N/mm, B {cell['damping_ns_per_mm']:g} N s/mm")
        axes.set_xlabel("position of the tip, wall at 0 (mm)")
        axes.set_ylabel("velocity (mm/s)")
        axes.grid(True)
        axes.axvline(0, color=fig.FRAME, linewidth=0.8)
        for depth, hit in enumerate(cell["hits"]):
            axes.plot(hit["tip_mm"], hit["mm_per_s"], color=HITS.get(hit["name"], fig.GREY), label=hit["name"], linewidth=1,
                      zorder=3 - 0.1 * depth)
        low, high = axes.get_ylim()
        axes.set_ylim(low, high + 0.1 * (high - low))
        axes.legend(loc="upper right", ncol=len(cell["hits"]), columnspacing=1.2, handlelength=1.4)
    picture.text(20 / width, 18 / height, foot(data, data["axes"], ["damping"]), fontsize=8.5, color=fig.FRAME, va="bottom")
    return fig.svg(picture)
