// SPDX-License-Identifier: Apache-2.0
#include <cstdio>

#include "lab/bench/kernel_bench.hpp"
#include "lab/run/lab_run.hpp"

namespace kerf {
namespace {

constexpr const char* kAbout = R"(# Performance

Made by `./kerf bench kernels --page docs/performance.md`; every figure comes from one run, nothing is
typed by hand. Machines are noisy: compare the ratios, which divide two figures of the same run.

One tick of the servo's kernels on 256 x 256 x 161 voxels, the worst place of each kind, nothing kept
from tick to tick. `paper` is the paper's own form at -O2: an array of structures with the stored float
gradient, and a dense 5x5x5 refresh of what a cut changed; ratios divide its time. `reference` is the
plain fixed-point text with stored gradients. `scalar`, `avx2` and `avx512` are the servo's kernels,
which give the same bits on each: the method `aligned` for unturned tools, and for tools in any pose
(`any`) the method `gather` for contact and `splat` for milling. `bytes` is what the tick needs beyond
two bytes a voxel.

)";

constexpr const char* kAboutQueries = R"(
## A query of the swept contact

What a tool feels at one place, read at samples of its surface: a ball of radius 8 voxels (805 samples)
and a cylinder of radius 5 and length 16 (658). `slide` dips 2 voxels into a ball of radius 40, `half`
lies half in a flat solid, `immersed` wholly. `turn` places the samples anew. A tick takes 2 or 3
queries while it slides and at most 32. The ratio divides the plain loop, which is `scalar`.

)";

constexpr const char* kAboutLayout = R"(
## Where the volume lies

The servo keeps its volume linear, x fastest. The copy of a tool's box out of 8x8x8 bricks is the other
choice: the first rows compare the two, warm and with 96 MB swept through the caches before each tick;
the ratio divides the linear copy. Then one tool in volumes of three sizes; the ratio divides the
smallest.

)";

std::string table_of(const std::vector<KernelRow>& rows) {
  std::string page = "| tick | numbers | kernel | p50 us | p99 us | ratio | bytes |\n";
  page += "|---|---|---|---:|---:|---:|---:|\n";
  for (const KernelRow& row : rows) {
    char line[192];
    std::snprintf(line, sizeof line, "| %s | %s | %s | %.2f | %.2f | %.3g | %zu |\n",
                  row.name.c_str(), row.numeric.c_str(), row.isa.c_str(), row.p50_ns / 1e3,
                  row.p99_ns / 1e3, row.ratio(), row.bytes);
    page += line;
  }
  return page;
}

}  // namespace

std::string performance_page(const std::vector<KernelRow>& rows,
                             const std::vector<KernelRow>& queries,
                             const std::vector<KernelRow>& layout) {
  return kAbout + lab_provenance() + "\n\n" + table_of(rows) + kAboutQueries + table_of(queries) +
         kAboutLayout + table_of(layout);
}

}  // namespace kerf
