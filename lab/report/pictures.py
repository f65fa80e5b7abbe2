# SPDX-License-Identifier: Apache-2.0
"""The part of docs/performance.md on pictures, and its tables for the terminal. JSON of `kerf bench pictures --report`:

    day, processor, gl_renderer, cores, width, height       of the run
    cast_set                    instruction set of the rays of `cast` and `cast-blend`
    rows                        {renderer, gradient, volume, tool, cropped, partial, fps, cpu_ms}: volume as 256x256x161, tool
                                voxels across, 0: none
    gradients                   {gradient, angle_deg, noisy_angle_deg, p99_deg, milled_angle_deg, milled_p99_deg,
                                thick_2_p99_deg, thick_5_p99_deg, thick_10_p99_deg}"""
import text

ABOUT = """\
## Pictures

`./kerf bench pictures --page docs/performance.md` makes the tables of this section. All figures come from one run; only the figures of
the paper are typed in. Machines are noisy: compare figures of the same run.

The table shows the time of a frame: update of the renderer and drawing of the volumes, without tool and panel, with a fixed camera. The
volume is a synthetic molar (`visualizer/bench/bench_tooth.cpp`), which fills the picture. The grid has air around the tooth (padding). The
tooth fills about the same fraction of the grid as the tooth of the paper.

* `cropped`: the grid has no air around the tooth; the picture is the same.
* `static`: the whole picture is drawn.
* `10^3`, `16^3`: the whole picture is drawn after a ball of this many voxels was cut.
* `partial`: only the pixels that this cut can have changed are drawn, as in the visualizer while the camera does not move.
* `fps` is one over the median wall time. `cpu ms` is the median CPU time, summed over the threads. Each figure is from 3 to 10 frames.
* `paper fps` is the frame rate that the paper reports for its technique of the same kind, static / while milling, on the paper's
  hardware. It does not predict the rate of this machine.

If `gl` below is a software OpenGL, the figures of `iso`, `blend`, `surface` and `slices` are not valid for a graphics card.

"""

GRADIENTS = """
### Gradients

The table shows the cost of `--gradient` for `iso` on the padded 256x256x161 volume. It also shows the angle between the normals and the
exact normals on a ball of 28 voxels radius, as root mean square and for 99 of 100 pixels (p99):

* `ball` has a border that is antialiased over two voxels.
* `noisy` also has noise of 1.5 % of full density.
* `milled` is the hollow that a ball has cut; its voxels are nearly full or empty.
* `1x1x2`, `1x1x5` and `1x1x10` are the ball in voxels of these edges, for 99 of 100 pixels.

Each gradient is stored in 8 bytes for each voxel and computed again around a cut.

* `adaptive` uses 15x15x15 voxels if their normal differs little from the normal of `farid5`. At an edge it differs, and `adaptive` uses
  `farid5`, which has 5x5x5 voxels. If the edges of a voxel differ, `adaptive` uses equal lengths along each axis, five of the longest edges to
  each side; the other gradients count voxels.
* `corners` changes the sign of the highest spatial frequency that voxels can have, so smooth surfaces are drawn with hatching.
* `central` draws rings.

`surface`, `cast`, exported surfaces and the page shade by the same gradients. Their tests limit `adaptive` to 3 degrees for 99 of 100
points of a ball in voxels from 1x1x1 to 1x10x10.

"""

# The paper's table of frame rates at 512x512, static / while milling: technique, then 128^3 and 256^3, each padded and cropped.
PAPER = {
    "iso": ("GPU iso", ("13 / 13", "40 / 39"), ("6 / 6", "21 / 21")),
    "blend": ("GPU volume", ("4 / 4", "10 / 10"), ("1 / 1", "5 / 5")),
    "surface": ("CPU iso", ("133", "-"), ("35 / 29, 22 (10^3, 16^3)", "-")),
    "slices": ("CPU volume", ("6 / 6", "21 / 21"), ("2 / 2", "8 / 5")),
}


def figure(value):
    return "-" if value is None else f"{value:.1f}" if value < 100 else f"{value:.0f}"


def paper_rate(row):
    if row["renderer"] not in PAPER:
        return "-"
    technique, small, large = PAPER[row["renderer"]]
    return f"{technique} {(small if row['volume'].startswith('128x') else large)[row['cropped']]}"


def find(rows, key, tool, partial, **wanted):
    """The value of the row of this tool; None if it was not measured."""
    for row in rows:
        if row["tool"] == tool and row["partial"] == partial and all(row[name] == value for name, value in wanted.items()):
            return row[key]
    return None


def padded_tooth(rows):
    return [row for row in rows if row["volume"].startswith("256x") and not row["cropped"]]


def picture_table(data):
    subjects = {}
    for row in text.rows_of(data):
        if row["gradient"] == "adaptive":  # the others are of the other table
            subjects.setdefault((row["renderer"], row["volume"], row["cropped"]), []).append(row)
    lines = []
    for (renderer, volume, cropped), rows in subjects.items():
        cells = [("fps", 0, False), ("fps", 10, False), ("fps", 16, False), ("fps", 10, True), ("fps", 16, True),
                 ("cpu_ms", 0, False), ("cpu_ms", 16, False), ("cpu_ms", 16, True)]
        lines.append([renderer, volume + (" cropped" if cropped else ""), *(figure(find(rows, *cell)) for cell in cells),
                      paper_rate(rows[0])])
    return text.table(["renderer", "volume", ">fps: static", ">10^3", ">16^3", ">10^3 partial", ">16^3 partial",
                       ">cpu ms: static", ">16^3", ">16^3 partial", "paper fps"], lines)


def gradient_table(data):
    rows = padded_tooth(data["rows"])

    def cpu(gradient, tool, partial):
        return figure(find(rows, "cpu_ms", tool, partial, renderer="iso", gradient=gradient))

    return text.table(["gradient", ">degrees: ball", ">p99", ">noisy", ">milled", ">p99", ">1x1x2 p99", ">1x1x5 p99",
                       ">1x1x10 p99", ">cpu ms: static", ">16^3", ">16^3 partial"],
                      [[row["gradient"], *(f"{row[name]:.2f}" for name in ("angle_deg", "p99_deg", "noisy_angle_deg",
                                                                           "milled_angle_deg", "milled_p99_deg", "thick_2_p99_deg",
                                                                           "thick_5_p99_deg", "thick_10_p99_deg")),
                        cpu(row["gradient"], 0, False), cpu(row["gradient"], 16, False), cpu(row["gradient"], 16, True)]
                       for row in data["gradients"]])


def machine(data):
    return (f"{data['day']}, {data['processor']}, {data['cores']} core(s) used, {data['width']}x{data['height']} pixels, "
            f"gl: {data['gl_renderer']}; cast: `{data['cast_set']}`.\n\n")


def page(data):
    return ABOUT + machine(data) + picture_table(data) + GRADIENTS + gradient_table(data)


def tables(data):
    return picture_table(data) + "\n" + gradient_table(data)
