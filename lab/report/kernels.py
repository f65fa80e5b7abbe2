# SPDX-License-Identifier: Apache-2.0
"""The part of docs/performance.md on kernels. JSON of `kerf bench kernels --report`:

    provenance                  day, machine and compiler of the run
    rows, queries, layout       rows {name, numeric, isa, ns_p50, ns_p99, ratio, bytes}

A machine measures only the instruction sets that it has. Rows of the others stay as the page had them, with the day and
machine that they are of."""
import pathlib
import re

import text

SETS = ("avx512", "avx2", "neon")  # `scalar` runs everywhere
PROVENANCE = re.compile(r"^\d{4}-\d\d-\d\d, .*$", re.MULTILINE)
KEPT = re.compile(r"^Rows of `(\w+)` are of another machine: (.*)$", re.MULTILINE)

ABOUT = """\
# Performance

`./kerf bench kernels --page docs/performance.md` makes the tables up to *Pictures*. All figures come from one run; none is typed in.
Machines are noisy: compare the ratios, which divide two figures of the same run.

Each row is one tick of the servo's kernels on 256 x 256 x 161 voxels. No result is kept from tick to tick. `contact/cube16/any` is the name
of a tick:

* `contact`: contact force. The tool moves around a solid ball, 2 voxels deep. `mill`: contact force, and removal by overlap. The tool is
  surrounded by material, which costs most. `preston`: removal by force.
* `ball16` is a ball of 16 voxels diameter, `cube16` a cube of 16 voxels edge.
* `aligned`: the tool is not rotated. `any`: its rotation changes from tick to tick. `cold`: before each tick 96 MB go through the caches.
  `border`: a part of the tool is outside of the volume. `groove`: the tool moves in a groove of its own width. `inside`: in the solid.
* `paper` is the paper's algorithm at -O2: an array of structures with the stored float gradient, and a dense 5x5x5 refresh of the voxels
  that a cut changed. The ratio of a row is the time of `paper` over the time of the row.
* `reference` is plain fixed-point code with stored gradients.
* `scalar`, `avx2` and `avx512` are the servo's kernels, which all give the same bits. Balls, and tools that are not
  rotated, use the method `aligned`. A cube in any pose (`cube16/any`) uses `gather` for contact and `splat` for milling.
* Rows of an instruction set that the measuring machine does not have stay unchanged. A line names the machine that measured them.
* `bytes` is the memory that the tick needs in addition to the two bytes of each voxel.

"""

QUERIES = """
## A query of the swept contact

A query computes the contact of a tool at one position from samples of its surface. The tools are a ball of radius 8 voxels (805 samples)
and a cylinder of radius 5 and length 16 voxels (658 samples). In `slide` the tool is 2 voxels deep in a ball of radius 40, in `half` it is
half inside a flat solid, and in `immersed` it is wholly inside. `turn` rotates the samples. A tick needs 2 or 3 queries while the tool
slides, and at most 32. The ratio is the time of the plain loop, `scalar`, over the time of the row.

"""

LAYOUT = """
## Layout of the volume

The servo stores its volume linearly, x fastest. The alternative is bricks of 8x8x8 voxels.

* The rows `copy` compare the time to copy the box around the tool from each layout. The caches are warm; in `cold`, 96 MB go through them
  before each tick. The ratio is the time of the linear copy over the time of the row.
* The other rows compare one tool in volumes of three sizes. The ratio is the time in the smallest volume over the time of the row.

"""


class Before:
    """The page as it was: the rows of sets that a run did not measure."""

    def __init__(self, page, data):
        measured = {row["isa"] for key in ("rows", "queries", "layout") for row in data[key]}
        origin = PROVENANCE.search(page)
        origins = dict.fromkeys(SETS, origin[0] if origin else "") | dict(KEPT.findall(page))
        self.rows, self.origins = {}, {}  # rows by tick, all kernels of a tick in their order
        for line in page.splitlines():
            cells = line.strip("| ").split(" | ")
            if line.startswith("| ") and len(cells) == 7:
                self.rows.setdefault(cells[0], []).append(cells)
                if cells[2] in SETS and cells[2] not in measured:
                    self.origins[cells[2]] = origins[cells[2]]

    def provenance(self):
        return "".join(f"\n\nRows of `{name}` are of another machine: {origin}" for name, origin in self.origins.items())

    def added_to(self, rows):
        """`rows`, cells each, with the kept ones of the same ticks, in the order of the page."""
        ticks = {}
        for row in rows:
            ticks.setdefault(row[0], []).append(row)
        for tick, found in ticks.items():
            before = self.rows.get(tick, [])
            order = [cells[2] for cells in before]
            found += [cells for cells in before if cells[2] in self.origins]
            found.sort(key=lambda cells: order.index(cells[2]) if cells[2] in order else len(order))
        return [row for found in ticks.values() for row in found]


def table_of(rows, before):
    return text.table(["tick", "numbers", "kernel", ">p50 us", ">p99 us", ">ratio", ">bytes"], before.added_to(
        [[row["name"], row["numeric"], row["isa"], f"{row['ns_p50'] / 1e3:.2f}", f"{row['ns_p99'] / 1e3:.2f}",
          f"{row['ratio']:.3g}", str(row["bytes"])] for row in rows]))


def page(data, file=""):
    """`file`: the page as it was; it need not be there."""
    old = pathlib.Path(file)
    head, rows = ABOUT + data["provenance"], text.rows_of(data)
    before = Before(old.read_text(encoding="utf-8") if old.is_file() else "", data)
    return (head + before.provenance() + "\n\n" + table_of(rows, before) + QUERIES + table_of(data["queries"], before) + LAYOUT
            + table_of(data["layout"], before))
