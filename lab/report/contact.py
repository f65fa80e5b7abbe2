# SPDX-License-Identifier: Apache-2.0
"""The page of contact (docs/contact.md) and its plots. JSON of `kerf studies extremes --report`:

    provenance                  day, machine and compiler of the run
    rows                        {group, name, value, unit, limit, aim, pass, skipped}: value null if it was not measured, and
                                skipped has the reason; limit or aim null: there is none
    comparison                  the paper's force and the swept proxy; null if it was not measured
        walls                   {name, paper_most_n, paper_unfelt_mm, presses, losses}: presses are lists of depth_mm, paper_n,
                                proxy_n; losses of rate_hz, paper_mm_per_s, proxy_mm_per_s, null: never
        slide                   {paper_step, proxy_step, paper_degrees, proxy_degrees, ticks}: ticks are lists of travel_mm,
                                paper, proxy
    hands                       {name, ticks}: lists of s, height_mm, proxy_height_mm, force_n, removed_mm3"""
import text

ABOUT = """\
# Contact

Made by `./kerf studies extremes --page docs/contact.md`; every figure comes from one run, nothing is typed by
hand. A run repeats bit for bit, but for the times of ticks. `--report` writes the rows as JSON, `--only` measures
some groups of them. The command exits with 1 if a limit is not kept.

The swept proxy (`[force] model = "proxy"`) keeps the whole tool out of the solid, and a spring pulls the hand to
it. The paper's force (`"paper"`) is the sum of the density's gradients inside of the tool. docs/theory.md derives
both. They are measured as the servo runs them: in fixed point, by the fastest kernels of this machine. Unless stated,
a voxel is 0.1 mm, a tick 1 ms, the tool a ball of 16 voxels, and a face is a ramp of density over two voxels.
docs/validation.md lists what is tested in fixed point and in double.

"""

COMPARED = """\
## The paper's force and the swept proxy

![Both forces on the same motions](%s)

The paper's force gives way to a hand that presses on. It grows with the area in touch, here to %s N, and ends where
the ball is wholly inside; behind a wall of two voxels it pushes onward. A press of 3 mm meets no resistance along %s mm
of it in the thick wall and %s mm at the thin one. The proxy stays in front, and its force grows with the depth.

The paper's force acts only near a face. A hand that moves farther than this zone in one tick can cross the face between
two ticks. The table has the lowest speed at which this happens for some phase of the ticks. The proxy is measured up to
10 m/s; faster hands are stopped by the supervisor.

| update rate | paper, %s | paper, %s | proxy, both |
|---:|---:|---:|---:|
%s
Both slide smoothly over a ball: at 50 mm/s the force changes by at most %s %% (paper) and %s %% (proxy) of its mean
from tick to tick, and stays within %s and %s degrees of the normal.

"""

# Group, title, text.
GROUPS = [
    ("walls", "Walls", """\
A hand makes random steps of 0.1 to 10 m/s at a tilted wall. The cylinder and the bur of `scenes/fluted_bur.toml` are
also rotated at random. There is no supervisor. If a tick has no query left for a push, the tool may stay 0.05 voxels deep
(`kWedged` of the sweep), less what a mesh reaches beyond its samples: 0.03 voxels of the bur (docs/theory.md 4.2)."""),
    ("air", "In air", """\
A tool moves to and fro along tilted walls, so near and so fast that the hand moves 2.4 to 80 voxels in a
tick. `--check` prints the speed up to which a scene is free of drag at any distance (docs/theory.md 4.2). The force is that of
the coupling with 0.4 N/mm and the hand's velocity, the larger one of no damping and of 1 N s/mm, the ends of what a scene may have: a
spring of a thousandth of a voxel that is left in air would be newtons."""),
    ("rests", "Where a ball comes to rest", """\
Offsets from the ideal solid at random tilts. On edges from the volume's own iso-surface, since trilinear density
has no sharp edge."""),
    ("slides", "Slides", """\
The step is the change of the force from tick to tick over its mean. The rotation of the normal alone makes 1.04 % at
R 40 and 4.5 % at R 14; there the limit is 0.08 N or twice the mean. `CT` has edges blurred by a deviation of one voxel,
and noise of 2 %."""),
    ("shapes", "Tools that are no balls", """\
At rest on flats of any tilt and on sharp edges of 90 degrees, the edges against the volume's own iso-surface; and
sliding at 50 mm/s over a ball of R 40, 2 voxels deep. Limits are 1.5 times those of the ball.

On CT with noise a rim or a point touches at one position, where the noise of one voxel makes waves of the surface itself;
a ball's height and normal are means of some fifty samples. A scene smooths such a volume when it loads it
(`denoise = "auto"`, docs/theory.md 2.4), and so do the rows with limits; `denoise off` is the same without. `exact
contact` shows the surface that was not smoothed: height and normal of the iso-surface where the tool's close samples
touch it at the ideal position, the normal over half a voxel. A contact that averages over no samples would have these
errors."""),
    ("edges", "Along and over sharp edges", """\
A ball, and a cylinder whose side lies on the edge, two voxels deep on a sharp convex edge of 90 degrees at 0.05
voxels a tick. The density is the solid's fraction of a cube of two voxels, as in a scan. A ramp of the distance from
the solid has a ridge that voxels do not hold: its trilinear iso-surface is a row of bumps about a voxel apart, and from
bump to bump the position nearest to the hand jumps."""),
    ("isos", "Low and high iso", """\
Tools at rest on flats of any tilt and on balls of R 14, with an iso that is not half of full density. The angle between force and normal may be 1.5 times that at an iso of 0.45."""),
    ("cutting", "Cutting by force", """\
The whole servo with `[cut] model = "preston"` and a ball of radius 1 mm. A hand moves it over a flat; presses it on
the flat with a force that rises to 1.2 N and falls again, however far the flat gives way; and lowers it into a crown at
the rate of enamel, at the worst of nine positions. `GE tooth` is a real tooth by CT, below `--data` or `$KERF_DATA`."""),
    ("traps", "Traps", """\
A random search in the whole servo: a hand presses a tool of 0.4 to 1 mm or the fluted bur, half of them with a
shaft, some with a handpiece, in any orientation, with 0.1 to 1 N for 5 s, from any side and with a tremor of 0.1 mm: into a
flat, a crown, layers, rubble, pits, shells, plates, or a block that ends at the volume's border. Half of these have
soft matter in them, which may not be cut in half of those; machinability is 1, 4 or 8 times that of enamel. Of 24
scenes 18 run in fixed point at 1 kHz and 250 Hz, the others at 8 kHz and in double. If the force is
above the threshold, volume must be removed. A shaft may carry the load that forces along the normals of its touching
cylinders can balance; the head carries the rest. A solid that is softer than the iso everywhere must carry no load. 240
presses; 10,000 with `--only traps`; `--seed` names the first scene."""),
    ("ticks", "Ticks", """\
On 256 x 256 x 161 voxels. The costliest tick of each tool is searched among thousands: at flat, sharp, hollow and
noisy solids, in a slot with a play of 0.1 voxels, in tissue just below the iso and, if its data are present, at the GE
tooth; with goals near and far, and from the start search. The ticks that took longest are repeated from the same
state, and the fastest repetition counts. The row names the solid at which the tick was found. Times are of the machine
named above. The limits are for a processor with AVX-512; on another, or a slower one, the paper's tick beside them is
slower too."""),
    ("hands", "Hands", """\
An emulated Omni, its driver and the whole servo in virtual time, with `scenes/touch.toml`; `groove` and `cut_cavity`
have `[cut] model = "preston"`. Force above 150 Hz is the rms over windows of 0.128 s that are wholly in contact. One
count of an encoder is up to 0.06 mm, or 0.024 N. The second stab of `jerk` misses the crown."""),
]


def limit(value):
    return "" if value is None else text.figure(value)


def table_of(rows, group):
    def cells(row):
        unit = "" if row["unit"] == "1" else row["unit"]
        if row["skipped"]:
            return [row["name"], "", "", limit(row["limit"]), limit(row["aim"]), "skipped: " + row["skipped"]]
        verdict = "" if row["limit"] is None else "kept" if row["pass"] else "**missed**"
        return [row["name"], text.figure(row["value"]), unit, limit(row["limit"]), limit(row["aim"]), verdict]

    found = [cells(row) for row in rows if row["group"] == group]
    return text.table(["what", ">value", "", ">must", ">aim", ""], found) + "\n"


def verdict(rows):
    """How many limits are kept, and which are not."""
    judged = sum(row["limit"] is not None and not row["skipped"] for row in rows)
    missed = [row for row in rows if not row["pass"]]
    return (f"Of {judged} limits {judged - len(missed)} are kept" + ("; missed are\n\n" if missed else ".\n")
            + "".join(f"* {row['group']}, {row['name']}: {text.figure(row['value'])} {row['unit']} instead of "
                      f"{limit(row['limit'])}\n" for row in missed) + "\n")


def speed(mm_per_s):
    return "never" if mm_per_s is None else text.figure(mm_per_s) + " mm/s"


def compared(comparison, plot):
    thick, thin = comparison["walls"]
    slide = comparison["slide"]
    one, other = thick["losses"], thin["losses"]
    speeds = "".join(
        f"| {text.figure(rate)} Hz | {speed(paper)} | {speed(also)} | {speed(proxy if proxy is not None else also_proxy)} |\n"
        for rate, paper, also, proxy, also_proxy in zip(one["rate_hz"], one["paper_mm_per_s"], other["paper_mm_per_s"],
                                                        one["proxy_mm_per_s"], other["proxy_mm_per_s"]))
    return COMPARED % (plot, text.figure(thick["paper_most_n"]), text.figure(thick["paper_unfelt_mm"]),
                       text.figure(thin["paper_unfelt_mm"]), thick["name"], thin["name"], speeds,
                       text.figure(100 * slide["paper_step"]), text.figure(100 * slide["proxy_step"]),
                       text.figure(slide["paper_degrees"]), text.figure(slide["proxy_degrees"]))


def page(data, plot, hands_plot):
    rows = text.rows_of(data)
    parts = [ABOUT, data["provenance"], "\n\n", verdict(rows), compared(text.rows_of(data, "comparison"), plot)]
    for group, title, about in GROUPS:
        parts.append(f"## {title}\n\n{about}\n\n")
        if group == "hands":
            parts.append(f"![Height and force of each hand]({hands_plot})\n\n")
        parts.append(table_of(rows, group))
    return "".join(parts)[:-1]


def styles():
    """Lines of the paper, of the proxy, and of the paper again at another wall."""
    import figure as fig
    return ({"color": fig.RED, "linestyle": "--", "linewidth": 1.8}, {"color": fig.BLUE, "linewidth": 1.8},
            {"color": fig.ORANGE, "linestyle": "-.", "linewidth": 1.8})


def plot(data):
    """The paper's force and the swept proxy."""
    import figure as fig
    comparison = text.rows_of(data, "comparison")
    paper, proxy, other = styles()
    picture, ((thick, thin), (loss, slide)) = fig.new_figure(1100, 800, rows=2, columns=2, across=90, down=110)
    for axes, wall in zip((thick, thin), comparison["walls"]):
        presses = wall["presses"]
        axes.set_title(f"slow press into {wall['name']}")
        axes.plot(presses["depth_mm"], presses["proxy_n"], label="proxy", **proxy)
        axes.plot(presses["depth_mm"], presses["paper_n"], label="paper", **paper)
        axes.set_xlabel("hand below the face (mm)")
        axes.set_ylabel("force (N)")
        axes.legend(loc="upper left")
    loss.set_title("speed from which a hand can pass the face without force")
    loss.axhline(10000, label="proxy: not up to here", **proxy)
    for wall, style in zip(comparison["walls"], (paper, other)):
        losses = wall["losses"]
        points = [(rate, mm) for rate, mm in zip(losses["rate_hz"], losses["paper_mm_per_s"]) if mm is not None]
        loss.plot([rate for rate, _ in points], [mm for _, mm in points], label=f"paper, {wall['name']}", marker="o", markersize=3.5,
                  **style)
    fig.log_axis(loss, "x", 18, 1100, (1, 2, 5))
    fig.log_axis(loss, "y", 10, 20000)
    loss.set_xlabel("update rate (Hz)")
    loss.set_ylabel("speed (mm/s)")
    loss.legend(loc="lower right")
    ticks = comparison["slide"]["ticks"]
    slide.set_title("slide over a ball of R 40 voxels, 2 deep, 50 mm/s")
    slide.plot(ticks["travel_mm"], ticks["proxy"], label="proxy", **proxy)
    slide.plot(ticks["travel_mm"], ticks["paper"], label="paper", **paper)
    slide.set_xlabel("path (mm)")
    slide.set_ylabel("force over its mean")
    slide.set_ylim(0.98, 1.02)
    slide.legend(loc="upper left")
    for axes in (thick, thin, loss, slide):
        axes.grid(True)
    return fig.svg(picture)


def hands(data):
    """Height, force and removal of each hand."""
    import figure as fig
    runs = text.rows_of(data, "hands")
    paper, proxy, _ = ({**style, "linewidth": 1.3} for style in styles())
    cuts = any(run["ticks"]["removed_mm3"][-1] > 0 for run in runs)
    picture, table = fig.new_figure(1100, 230 * len(runs) + 30, rows=len(runs), columns=3 if cuts else 2, left=55, across=60,
                                    down=80, top=65, bottom=50)
    for run, row in zip(runs, table):
        ticks = run["ticks"]
        row[0].set_title(f"{run['name']}: height of the tip (mm)")
        row[0].plot(ticks["s"], ticks["height_mm"], label="hand", **paper)
        row[0].plot(ticks["s"], ticks["proxy_height_mm"], label="tool as rendered", **proxy)
        row[1].set_title(f"{run['name']}: force (N)")
        row[1].plot(ticks["s"], ticks["force_n"], **proxy)
        if cuts and ticks["removed_mm3"][-1] > 0:
            row[2].set_title(f"{run['name']}: removed (mm³)")
            row[2].plot(ticks["s"], ticks["removed_mm3"], **proxy)
        elif cuts:
            row.pop().remove()
        for axes in row:
            axes.set_xlabel("time (s)", labelpad=2)
            axes.grid(True)
    picture.legend(handles=table[0][0].lines, loc="upper left", bbox_to_anchor=(0.04, 1 - 4 / (230 * len(runs) + 30)), ncol=2)
    return fig.svg(picture)
