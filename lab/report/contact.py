# SPDX-License-Identifier: Apache-2.0
"""The part of docs/contact.md that the study of contact makes, and its plots. JSON of `kerf studies extremes --report`:

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
[Promises](#promises-and-their-tests) lists what kerf promises, with the tests. [Accuracy](#accuracy-of-each-setting) measures
each setting of both forces.

"""

PROMISES = """\
## Promises and their tests

What kerf promises of contact, cutting, stability and robustness, and the test of each promise. All tests run with `./kerf
test`; where numbers matter they run in fixed point and in double, most contact tests at 0.25, 1 and 8 kHz. The words `walls`,
`rests`, `slides`, `air`, `isos`, `cutting` and `traps` are groups of rows above (`--only`), which have limits and figures.
Tests cite the numbers F (force), N (numbers and gradients) and S (stability).

| | promise | limit | test |
|---|---|---|---|
| F5 | a closed path on a static ball gives no energy | 0.005 of the work to and fro | `tests/servo/closed_loops_test.cpp` |
| F7 | no motion up to 10 m/s crosses a wall of 2 voxels or more | in these rows | `walls`, `tests/proxy/iso_test.cpp` |
| | a tick queries the field a bounded number of times | in these rows | `walls`, `tests/proxy/iso_test.cpp` |
| F8 | the force is smooth over bumps: R 14, 100 mm/s, 1 voxel deep | in these rows | `slides` |
| | fixed point and double agree on one motion | 0.05 % of the mean force | `tests/proxy/slide_test.cpp` |
| F9 | a ball rests on a plane of any tilt | in these rows | `rests` |
| F10, S16 | feed and force of a flat tool follow Preston's law | 2 % and 1 % | `tests/kernel/preston_test.cpp` |
| F11 | removed and carried volume is the integral of G F | 1e-6 | `tests/kernel/preston_test.cpp`, `tests/servo/force_cut_test.cpp`, `cutting` |
| F12, F15 | without force or spindle nothing is cut; a cut depends on the force of its own tick alone | exact | `tests/kernel/preston_test.cpp`, `tests/kernel/milling_test.cpp` |
| F13 | the carry makes cuts below one density step exact | 1e-6 | `tests/kernel/milling_test.cpp` |
| F14 | stamp of a ball of R 5 voxels and more has its volume | 1 % | `tests/kernel/milling_test.cpp` |
| S1 to S6 | exact stability boundary of a sampled wall, with delay, filter, device and hand | last digit of tables, 0.2 % | `tests/stability/stable_gains_test.cpp` |
| S7, S8 | damping of a passive wall, with filter and any delay | 1e-6 | `tests/stability/passive_limits_test.cpp` |
| S9 to S13 | one axis in time against the boundary; with friction and encoder steps | 2 %; 10 % of 44 tabled values | `tests/stability/one_axis_test.cpp`, `tests/lab/zwidth_test.cpp` |
| S14 | the energy observer is the integral of force and velocity | 1e-9 J; sources sum to the last bit | `tests/servo/energy_ledger_test.cpp` |
| S15 | the passivity controller keeps 20 N/mm under 1 N stable | within 2 mm, booked energy at least -1e-9 J | `tests/servo/stabiliser_test.cpp` |
| S17, S18 | velocity of the estimator from encoder steps of 0.055 mm | 0.6 and 0.4 mm/s rms at 10 and 200 mm/s | `tests/servo/velocity_window_test.cpp` |
| | material softer than the iso gives no force | in these rows | `tests/kernel/contact_volumes_test.cpp`, `tests/proxy/iso_test.cpp`, `traps` |
| | no drag in air outside of the range that `--check` prints | in these rows | `tests/proxy/air_test.cpp`, `tests/plan/bounds_test.cpp`, `air` |
| | normals do not depend on the iso | in these rows | `tests/proxy/iso_test.cpp`, `isos` |
| | no command, hold or new tool moves the proxy through a wall | force within 2 % | `tests/servo/kept_place_test.cpp`, `tests/proxy/place_anew_test.cpp` |
| | a solid at the border of a volume is cut as if air lay outside | exact | `tests/volume/crop_resample_test.cpp`, `tests/servo/border_test.cpp` |
| | a gap in the reports gives no jump of the velocity | 2 % over 2 to 400 reports | `tests/servo/velocity_window_test.cpp` |
| | a hand that moves with the force is released at once | 0 N within a tick | `tests/servo/force_limits_test.cpp` |
| | a tool in its bore removes nothing behind it | 0.5 % | `tests/servo/material_share_test.cpp` |
| | a tool cuts what it rests on: rims, flanks, radii from 1 to 7.5 voxels | no stop | `tests/servo/rim_cut_test.cpp`, `tests/tool/tool_mesh_test.cpp` |
| | a pressing tool keeps cutting | no random press stops (open cases below) | `tests/studies/extremes_test.cpp`, `tests/proxy/shaft_test.cpp`, `tests/proxy/spent_work_test.cpp`, `traps` |
| | filters, resets and refused starts behave equally at all rates | 20 ms | `tests/servo/output_and_reset_test.cpp` |
| | the safety contract detects each of its seeded breaches | all | `.ci/mutate.py safety`, `tests/lab/contract_test.cpp`, `tests/lab/fault_run_test.cpp` |
| | all devices arm within the same time from 250 to 8000 Hz | 1 s until a message | `tests/lab/arming_test.cpp`, `tests/shell/run_test.cpp` |
| | every signal that ends a program switches the motors off first | all signals | `tests/shell/motor_guard_test.cpp`, `tests/programs/signals_test.cpp`, `tests/programs/kills_test.cpp` |
| | a broken file gives one line, never a crash or much memory | fuzzed | `tests/volume/sandbox_test.cpp`, `tests/volume/read_test.cpp`, `.ci/fuzz.sh` |
| | no output follows a planted link or half replaces a file | all | `tests/posix/new_file_test.cpp` |
| | few descriptors, small stacks or a full disk: one line and exit code 2 | all | `tests/programs/limits_test.cpp` |
| | wrong partners (device, rate, lock-step) end with the same line on both sides | all | `tests/programs/partners_test.cpp`, `tests/hil/sockets_test.cpp` |
| | the window writes outside of no block of its heap, and a kept picture equals a new one | random user | `tests/visualizer/app/window_test.cpp`, `kerf-visualizer-monkey` |

### Where a promise is narrower than its words

* F7: turning tools penetrate more than a ball (`walls`).
* F14: a sweep whose stamps lie between voxels removes up to 23 % more than the capsule; its groove is within 0.55 voxels.
* S15: the port itself may give 4.0 mJ between two readings, which no account contains.
* Open: of 10,000 random presses from `--seed 0` two stop (scene 478, press 16; scene 483, press 0). Each is a tool with a shaft.
  The planes that the servo keeps do not carry the hand's force. In 478 the only plane is the shaft's, and of 0.76 N it leaves
  0.11 N to a head that touches nothing. In 483 a plane of the shaft and one of the head leave 0.56 of 0.78 N, which the cut counts
  as the press of the head, where no material is left. Most likely a part of a shaft that touches two faces has one plane.
  `tests/studies/contact/stuck_rows.cpp` lists them, so `traps` shows them and fails for any other.
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
    return "".join(parts) + PROMISES


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
