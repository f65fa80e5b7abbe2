# SPDX-License-Identifier: Apache-2.0
"""The part of docs/performance.md on kernels. JSON of `kerf bench kernels --report`:

    provenance                  day, machine and compiler of the run
    rows, queries, layout       rows {name, numeric, isa, ns_p50, ns_p99, ratio, bytes}"""
import text

ABOUT = """\
# Performance

Made by `./kerf bench kernels --page docs/performance.md`; every figure comes from one run, nothing is
typed by hand. Machines are noisy: compare the ratios, which divide two figures of the same run.

One tick of the servo's kernels on 256 x 256 x 161 voxels, at the costliest position of each kind; no result is
kept from tick to tick.

* `paper` is the paper's own form at -O2: an array of structures with the stored float gradient, and a dense 5x5x5
  refresh of the voxels that a cut changed. Ratios divide its time.
* `reference` is the plain fixed-point code with stored gradients.
* `scalar`, `avx2` and `avx512` are the servo's kernels, which all give the same bits: the method `aligned` for tools
  that are not rotated, and for tools in any pose (`any`) the method `gather` for contact and `splat` for milling.
* `bytes` is the memory of the tick beyond two bytes a voxel.

"""

QUERIES = """
## A query of the swept contact

The contact of a tool at one position, from samples of its surface: a ball of radius 8 voxels (805 samples)
and a cylinder of radius 5 and length 16 (658). `slide` is 2 voxels deep in a ball of radius 40, `half` is half inside
a flat solid, `immersed` is wholly inside. `turn` rotates the samples. A tick takes 2 or 3 queries while it slides and at
most 32. The ratio divides the plain loop, which is `scalar`.

"""

LAYOUT = """
## Layout of the volume

The servo stores its volume linearly, x fastest. The alternative is bricks of 8x8x8 voxels. The first rows compare
copies of a tool's box out of both, with warm caches and after 96 MB went through the caches before each tick; the ratio
divides the linear copy. The others are one tool in volumes of three sizes; the ratio divides the smallest.

"""


def table_of(rows):
    return text.table(["tick", "numbers", "kernel", ">p50 us", ">p99 us", ">ratio", ">bytes"],
                      [[row["name"], row["numeric"], row["isa"], f"{row['ns_p50'] / 1e3:.2f}", f"{row['ns_p99'] / 1e3:.2f}",
                        f"{row['ratio']:.3g}", str(row["bytes"])] for row in rows])


def page(data):
    return (ABOUT + data["provenance"] + "\n\n" + table_of(text.rows_of(data)) + QUERIES + table_of(data["queries"]) + LAYOUT
            + table_of(data["layout"]))
