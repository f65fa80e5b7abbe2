// SPDX-License-Identifier: Apache-2.0
#include "hil/lab/performance_page.hpp"

#include <cstdio>

#include "hil/lab/lab_run.hpp"

namespace kerf {
namespace {

constexpr const char* kAbout = R"(# Performance

Made by `./kerf bench kernels --page docs/performance.md`; every figure comes from one run, nothing is
typed by hand. Machines are noisy: compare the ratios, which divide two figures of the same run.

One tick of the servo's kernels on 256 x 256 x 161 voxels, the worst place of each kind, nothing kept
from tick to tick. `paper` is the paper's own form at -O2: an array of structures with the stored float
gradient, and a dense 5x5x5 refresh of what a cut changed. `reference` is the plain fixed-point text
of the plan `gather`; `scalar`, `avx2` and `avx512` are the plan `aligned`, which gives the same bits on
each. `bytes` is what the tick needs beyond two bytes a voxel.

)";

}  // namespace

std::string performance_page(const std::vector<KernelRow>& rows) {
  std::string page = kAbout;
  page += lab_provenance() + "\n\n";
  page += "| tick | numbers | way | p50 us | p99 us | ratio | bytes |\n";
  page += "|---|---|---|---:|---:|---:|---:|\n";
  for (const KernelRow& row : rows) {
    char line[192];
    std::snprintf(line, sizeof line, "| %s | %s | %s | %.2f | %.2f | %.1f | %zu |\n",
                  row.name.c_str(), row.numeric.c_str(), row.isa.c_str(), row.p50_ns / 1e3,
                  row.p99_ns / 1e3, row.ratio(), row.bytes);
    page += line;
  }
  return page;
}

}  // namespace kerf
