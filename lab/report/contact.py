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

Made by `./kerf studies extremes --page docs/contact.md`: all tables of this part come from one run. A run repeats bit for
bit, except for the times of ticks. `--report` writes the rows as JSON, `--only` measures some groups of them. The exit code
is 1 if a limit is not kept.

The page measures two contact forces, derived in docs/theory.md and in docs/forces.md 7:

* the swept proxy (`[force] model = "proxy"`), the default, keeps the whole tool out of the solid, and a spring pulls the
  hand to the proxy;
* the paper's force (`"paper"`) is the sum of the gradients of density inside the tool.

Both are measured as the servo runs them: in fixed point, by the fastest kernels of the machine named below. Unless stated, a
voxel is 0.1 mm, a tick 1 ms, the tool a ball with a diameter of 16 voxels, and a face a ramp of density over two voxels. R 40
is a radius of 40 voxels, and *sd* a standard deviation. In the tables *must* is the limit of a row; *aim* is not checked.

[Promises](#promises-and-their-tests) lists what kerf promises, with the tests. [Accuracy](#accuracy-of-each-setting)
measures each setting of both forces.

"""

PROMISES = """\
## Promises and their tests

The table has what kerf promises about contact, cutting, stability and robustness, with the test of each promise. `./kerf
test` runs the tests in `tests/`. Where numbers matter they run in fixed point and in double, and most contact tests at 0.25,
1 and 8 kHz. The words `walls`, `rests`, `slides`, `air`, `isos`, `cutting` and `traps` are groups of rows above (`--only`).
*In these rows* means: see column *must* of the named group. Tests cite the promises by the letters F (force), N (numbers and
gradients) and S (stability) with a number.

| | promise | limit | test |
|---|---|---|---|
| F5 | a closed path on a static ball gives no energy | 0.005 of the absolute work | `tests/servo/closed_loops_test.cpp` |
| F7 | no motion up to 10 m/s crosses a wall of 2 voxels or more | in these rows | `walls`, `tests/proxy/iso_test.cpp` |
| | a tick queries the field a bounded number of times | in these rows | `walls`, `tests/proxy/iso_test.cpp` |
| F8 | the force is smooth over bumps: R 14, 100 mm/s, 1 voxel deep | in these rows | `slides` |
| | fixed point and double agree on one motion | 0.05 % of the mean force | `tests/proxy/slide_test.cpp` |
| F9 | a ball rests on a plane of any tilt | in these rows | `rests` |
| F10, S16 | the feed and the force of a flat tool follow Preston's law | 2 % and 1 % | `tests/kernel/preston_test.cpp` |
| F11 | removed plus carried volume is the integral of G F | 1e-6 | `tests/kernel/preston_test.cpp`, `tests/servo/force_cut_test.cpp`, `cutting` |
| F12, F15 | without force or spindle nothing is cut; a cut depends only on the force of the same tick | exact | `tests/kernel/preston_test.cpp`, `tests/kernel/milling_test.cpp` |
| F13 | what a tick cannot cut is carried to the next, so cuts below one density step are exact | 1e-6 | `tests/kernel/milling_test.cpp` |
| F14 | one stamp of a ball of R 5 or more removes the ball's volume | 1 % | `tests/kernel/milling_test.cpp` |
| S1 to S6 | exact stability boundary of a sampled wall, with delay, filter, device and hand | the last digit of tabled values; 0.2 % for the plant of an Omni (S6) | `tests/stability/stable_gains_test.cpp` |
| S7, S8 | damping at which a wall is passive, with filter and any delay | 1e-6 N s/m, with a filter 1e-5 N s/m | `tests/stability/passive_limits_test.cpp` |
| S9 to S13 | the simulation of one axis finds the exact stability boundary; with friction and encoder steps it finds the 44 boundaries of another simulator | 2 %; 10 % | `tests/stability/one_axis_test.cpp`, `tests/lab/zwidth_test.cpp` |
| S14 | the energy observer is the integral of force times velocity | 1e-9 J; the sum of its parts (docs/forces.md 5.5) is exact to the last bit | `tests/servo/energy_ledger_test.cpp` |
| S15 | with the passivity controller a wall of 20 N/mm is stable under a push of 1 N | within 2 mm, energy by the observer at least -1e-9 J | `tests/servo/stabiliser_test.cpp` |
| S17 | the difference of two encoder readings gives velocities only in multiples of D/T (D: encoder step, T: tick) | 1e-6 of D/T | `tests/stability/one_axis_test.cpp` |
| S18 | error of the velocity estimator with encoder steps of 0.055 mm | 0.6 and 0.4 mm/s rms at 10 and 200 mm/s | `tests/servo/velocity_window_test.cpp` |
| | material softer than the iso gives no force | in these rows | `tests/kernel/contact_volumes_test.cpp`, `tests/proxy/iso_test.cpp`, `traps` |
| | no drag in air up to the speed that `--check` prints | in these rows | `tests/proxy/air_test.cpp`, `tests/plan/bounds_test.cpp`, `air` |
| | normals do not depend on the iso | in these rows | `tests/proxy/iso_test.cpp`, `isos` |
| | no command, hold or new tool moves the proxy through a wall | force within 2 % of the undisturbed one | `tests/servo/kept_place_test.cpp`, `tests/proxy/place_anew_test.cpp` |
| | a solid at the border of a volume is cut as if there were air outside | exact | `tests/volume/crop_resample_test.cpp`, `tests/servo/border_test.cpp` |
| | a gap in the reports makes no jump of the velocity | 2 % over 2 to 400 reports | `tests/servo/velocity_window_test.cpp` |
| | a hand that moves with the force is released at once, without the slew limit | 0 N within a tick | `tests/servo/force_limits_test.cpp` |
| | a tool in its bore removes nothing behind it | 0.5 % | `tests/servo/material_share_test.cpp` |
| | a tool cuts what it rests on: rims, flanks, radii from 1 to 7.5 voxels | no stop | `tests/servo/rim_cut_test.cpp`, `tests/tool/tool_mesh_test.cpp` |
| | a pressing tool keeps cutting | no random press stops (open cases below) | `tests/studies/extremes_test.cpp`, `tests/proxy/shaft_test.cpp`, `tests/proxy/spent_work_test.cpp`, `traps` |
| | filters, resets and refused starts behave in the same way at all rates | the filter of the gimbal: 20 ms | `tests/servo/output_and_reset_test.cpp` |
| | the check of the safety contract detects each breach that is planted | all | `.ci/mutate.py safety`, `tests/lab/contract_test.cpp`, `tests/lab/fault_run_test.cpp` |
| | Omni, Falcon and WoodenHaptics switch the force on after the same time at all rates from 250 to 8000 Hz; a start that must wait is reported | within 16 ms; after 1 s | `tests/lab/arming_test.cpp`, `tests/shell/run_test.cpp` |
| | every signal that ends a program switches the motors off first | all signals | `tests/shell/motor_guard_test.cpp`, `tests/programs/signals_test.cpp`, `tests/programs/kills_test.cpp` |
| | a broken file gives one line, never a crash or a large allocation | fuzzed | `tests/volume/sandbox_test.cpp`, `tests/volume/read_test.cpp`, `.ci/fuzz.sh` |
| | no output is written through a planted link, and no file is replaced by an incomplete one | all | `tests/posix/new_file_test.cpp` |
| | with few descriptors, a small stack or a full disk a program gives one line and exit code 2 | all | `tests/programs/limits_test.cpp` |
| | programs that do not match (device, rate, lock-step) end with the same line on both sides | all | `tests/programs/partners_test.cpp`, `tests/hil/sockets_test.cpp` |
| | the window never writes outside of its heap blocks, and a picture that is kept from an earlier frame equals a newly drawn one | random user | `tests/visualizer/app/window_test.cpp`, `kerf-visualizer-monkey` |

### Where a promise is narrower than its words

* F7: rotating tools penetrate deeper than a ball (`walls`).
* F14: a sweep whose stamps lie between voxels removes up to 23 % more than the capsule. The radius of its groove is at
  most 0.55 voxels larger than that of the tool.
* S15: between two readings of the encoders the port itself may give 4.0 mJ (the test allows 10 mJ). No account of
  the energy observer contains this energy.
* Open: of 10,000 random presses from `--seed 0` two stop cutting (scene 478, press 16; scene 483, press 0). In both the tool
  has a shaft, and the constraint planes of the servo do not carry the force of the hand. In scene 478 the only plane is at
  the shaft. It leaves 0.11 N of 0.76 N for the head, but the head touches nothing. In scene 483 one plane at the shaft and
  one at the head leave 0.56 N of 0.78 N. The cut takes these 0.56 N as the normal force of the head, but at the head no
  material is left. The likely cause: if a part of a shaft touches two faces, it has only one plane for both.
  `tests/studies/contact/stuck_rows.cpp` lists both presses, so `traps` shows them and fails for any other.
"""

COMPARED = """\
## The paper's force and the swept proxy

![Both forces on the same motions](%s)

The paper's force does not stop a hand that presses on. The force grows with the contact area, here to %s N, and it is
zero when the ball is wholly inside. Behind a wall of two voxels it pushes the hand onward. A hand that goes 3 mm deep
meets no resistance along %s mm of its way in a wall of 5 mm, and along %s mm at a wall of two voxels. The proxy stays
in front of the wall, and its force grows with the depth of the hand.

The paper's force acts only in a zone near a face. A hand that moves across this zone in one tick can pass the face without
any force, if the ticks fall just before and behind the zone. The table has the lowest speed at which this can happen. The
proxy is measured up to 10 m/s, because the supervisor stops a faster hand.

| update rate | paper, %s | paper, %s | proxy, both |
|---:|---:|---:|---:|
%s
Both forces are smooth while the tool slides over a ball. At 50 mm/s the force changes from tick to tick by at most %s %%
(paper) and %s %% (proxy) of its mean. Its direction stays within %s (paper) and %s (proxy) degrees of the normal.

"""

# Group, title, text.
GROUPS = [
    ("walls", "Walls", """\
A hand makes random steps of 0.1 to 10 m/s at a tilted wall, without a supervisor. The cylinder and the bur of
`scenes/fluted_bur.toml` are also rotated at random. *Behind*: a tool at the hand's position would be in the wall or behind
it. *Sunk* is the depth of the tool in the wall. The tool may stay up to 0.05 voxels deep (`kWedged` of the sweep) if it is
wedged between two walls, or if a tick has no query of the density left to push it out. The sweep reads depths at samples,
and a mesh reaches farther than its samples: the bur by 0.03 voxels. So for a mesh the sweep allows its samples less depth, by
this length, and the mesh itself is at most 0.05 voxels deep (docs/theory.md 4.2)."""),
    ("air", "In air", """\
A tool moves to and fro along tilted walls, 0.03 to 0.5 mm beside them, and so fast that the hand moves 2.4 to 80 voxels in a
tick. `--check` prints the speed up to which a scene has no drag, at any distance from a wall (docs/theory.md 4.2).

The force follows from the spring at 0.4 N/mm and from the velocity of the hand. It is the larger of two forces: without
damping, and with 1 N s/mm. These are the lowest and the highest damping of a scene. The test is sharp: if a spring of only a
thousandth of a voxel remained in air, the damper would already give several newtons."""),
    ("rests", "Where a ball comes to rest", """\
The offset is the distance of the tool from its ideal position of rest, at random tilts. *Convex 40* is a solid ball of
R 40, *concave 40* a hollow. On edges the offset is relative to the volume's own iso-surface, because trilinear density has
no sharp edge."""),
    ("slides", "Slides", """\
The force step is the largest change of the force from one tick to the next, divided by the mean force. The rotation of
the normal alone makes 1.04 % at R 40 and 4.5 % at R 14. The limit at R 14 is 0.08 N, which is 200 % of the mean force.
*Surface sd* is the standard deviation of the height of the tool on the surface. `CT` has edges blurred by a Gaussian with
an sd of one voxel, and noise of 2 %."""),
    ("shapes", "Tools that are no balls", """\
The tools rest on flats of any tilt and on sharp edges of 90 degrees. On edges the offset is relative to the volume's own
iso-surface. The tools also slide at 50 mm/s over a ball of R 40, 2 voxels deep. The limits are 1.5 times those of the ball.

A rim or a point touches at one position only. On CT with noise, the noise of single voxels makes the surface wavy at this
position. (The height and the normal of a ball are means of some fifty samples.) So when a scene loads such a volume, it
smooths the volume (`denoise = "auto"`, docs/theory.md 2.4). The rows with limits have this smoothing, the rows with `denoise
off` do not.

The rows `exact contact` are for comparison, on the surface without smoothing. They show the errors of a contact that
takes no mean over samples. The tool is lowered until its first close sample touches the iso-surface: this gives the
height of the contact. The normal follows from such heights at positions half a voxel to each side."""),
    ("edges", "Along and over sharp edges", """\
The tool is a ball, or a cylinder whose side lies on the edge. The hand leads it along and over a sharp convex edge of 90
degrees, two voxels below the position of rest, at 0.05 voxels a tick. The density of a voxel is the fraction of solid in
a cube of two voxels, as in a scan. The ramp of the other rows, which follows the distance from the solid, is not used
here: at an edge it has a ridge that voxels cannot represent. Its trilinear iso-surface would be a row of bumps about a
voxel apart, and the position nearest to the hand would jump from bump to bump."""),
    ("isos", "Low and high iso", """\
Tools rest on flats of any tilt and on balls of R 14. The iso is from 0.02 to 0.95 of full density. The limit of the angle
between force and normal is 1.5 times the angle at an iso of 0.45."""),
    ("cutting", "Cutting by force", """\
The whole servo runs with `[cut] model = "preston"` and a ball of radius 1 mm. G is the removal rate per newton, F the normal
force. The hand makes three motions:

* it moves the ball over a flat (rows *removed against the integral of G F*);
* it presses on the flat with a force that rises to 1.2 N and falls again, and that does not depend on the depth of the
  cut (rows *removed by the same force*);
* it lowers the ball by 2.5 mm into a crown, which is cut at the rate of enamel. The worst of nine positions counts (rows
  *milling into*).

`GE tooth` is a CT of a real tooth, in the folder of `--data` or `$KERF_DATA`."""),
    ("traps", "Traps", """\
A random search in the whole servo: a hand presses a tool into a solid with 0.1 to 1 N for 5 s, with a tremor of 0.1 mm. If
the force is above the threshold, volume must be removed.

* Tools: the shapes with a radius of 0.4 to 1 mm, and the fluted bur. Half of them have a shaft, some a handpiece. Wrist,
  start and direction are random.
* Solids: a flat, a crown, layers, rubble, pits, shells, plates, or a block that ends at the volume's border, rotated at
  random. Three of eight scenes contain soft material; in half of these scenes the soft material may not be cut.
  Machinability is 1, 4 or 8 times that of enamel.
* Three of four scenes run in fixed point at 1 kHz or 250 Hz, the others at 8 kHz or in double.
* If shaft and head touch, a press need not cut if the shaft alone can carry it, that is, if forces along the normals of
  the shaft's contacts can add up to the press. The part of a press that the shaft cannot carry is the load of the head,
  and must cut.
* A solid that is softer than the iso everywhere must carry no load (row *force in solids*: such solids have 0.2 to 0.97
  of the density of the iso).

A run has 240 presses, or 10,000 with `--only traps`. `--seed` is the number of the first scene."""),
    ("ticks", "Ticks", """\
The volumes have 256 x 256 x 161 voxels. The costliest tick of each tool is searched among thousands: at flat, sharp, hollow
and noisy solids, in a slot with a play of 0.1 voxels, in tissue just below the iso and, if its data are present, at the GE
tooth. The hand's positions are near the tool and far from it, and some ticks begin with the search for a start position. The
costliest ticks are repeated from the same state, and the fastest repetition counts. The row names the solid at which the
tick was found.

Times are of the machine named above. The limits are for a processor with AVX-512. On a slower processor, rows may miss
their limits. The rows *paper* show the tick of the paper's force on the same processor, for comparison."""),
    ("hands", "Hands", """\
An emulated Omni, its driver and the whole servo run in virtual time with `scenes/touch.toml`. The hands `groove` and
`cut_cavity` have `[cut] model = "preston"`. *Force above 150 Hz* is the rms of this part of the force, over windows of 0.128
s. A window counts if the tool is in contact during all of it. One count of an encoder is up to 0.06 mm, or 0.024 N. The
second stab of `jerk` misses the crown."""),
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
    tabled = [group for group, _, _ in GROUPS]
    elsewhere = sum(row["limit"] is not None and not row["skipped"] and row["group"] not in tabled for row in rows)
    of_them = f" ({elsewhere} of them in the comparison of both forces, without rows here)" if elsewhere else ""
    return (f"Of {judged} limits{of_them} {judged - len(missed)} are kept" + ("; missed are\n\n" if missed else ".\n")
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
