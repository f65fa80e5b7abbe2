// SPDX-License-Identifier: Apache-2.0
#include "lab/accuracy/page.hpp"

#include "lab/accuracy/page_column.hpp"
#include "lab/rig/lab_run.hpp"

namespace kerf::accuracy {
namespace {

struct Table {
  const char* knob;
  const char* about;
  std::vector<PageColumn> columns;
};

std::vector<Table> tables() {
  using namespace column;
  return {{"arithmetic",
           R"(## Arithmetic

Force against the same text in double, in millionths of full scale, and one trilinear interpolation of
random 16-bit corners, in steps of the corners. The servo has Q15, float and double; Q8 and Q12 are
coarser weights through its lerp.)",
           {kDouble, kDoubleMax, kCorner, kCornerMax, kMemory}},
          {"pitch",
           R"(## Pitch of the tool's samples

In voxel edges. A sample stands for the cube around it, so a coarse ball has not the ball's volume.)",
           {kSamples, kTheory, kTheoryMax, kDirection, kToolLoop, kStep}},
          {"kernel",
           R"(## Gradient kernel

`normal` is the gradient at the voxels on the ball's face against the true normal; `noise` what remains
of white noise of deviation one.)",
           {kNormal, kNormalMax, kNoise, kSampleLoop, kToolLoop, kTheory}},
          {"storage",
           R"(## What is stored beside the density

Int16 gradients are the servo's method `gather`, `aligned` its method for round tools, `splat` that for any
tool in scenes that cut (its time holds the modification force, too). `spline 2` and `spline 3` are the
exact derivative of the density's quadratic and cubic B-spline: their accuracy is the reference, their
time is not. The last row has voxels half as wide: compare it with that of `gather` in "Voxel edge".)",
           {kSamples, kMemory, kDouble, kDoubleMax, kTheory, kDirection, kSampleLoop, kToolLoop}},
          {"interpolation",
           R"(## Interpolation of the stored gradient

Trilinear is the servo's; the others are B-splines of degree 0, 2 and 3 in plain double. `step`: what
0.01 voxel along the face changes, in thousandths of full scale.)",
           {kStep, kDirection, kSampleLoop, kToolLoop, kTheory, kNoise}},
          {"voxel",
           R"(## Voxel edge

The same millimetres in 64^3, 128^3 and 256^3 voxels, tool pitch = voxel. `order`: log2 of how much
smaller the error is than in the row above; a blur of fixed width in voxels gives 2 in the limit.)",
           {kSamples, kTheory, kTheoryMax, kOrder, kDirection, kToolLoop}}};
}

std::string row_of(const std::string& first, const std::vector<std::string>& cells) {
  std::string row = "| " + first + " |";
  for (const std::string& cell : cells) row += " " + cell + " |";
  return row + "\n";
}

std::string head_of(const char* first, const std::vector<std::string>& titles) {
  std::string head = row_of(first, titles) + "|---|";
  for (std::size_t i = 0; i < titles.size(); ++i) head += "---:|";
  return head + "\n";
}

/// In brackets where it is not the time of what the servo runs.
std::string time_cell(const Entry& entry, double ns) {
  const std::string us = page_number(ns / 1e3);
  return entry.plain ? "(" + us + ")" : us;
}

std::string table_of(const Table& table, const std::vector<Entry>& entries) {
  std::vector<std::string> titles{"us p50", "p99"};
  for (const PageColumn& column : table.columns) titles.emplace_back(column.title);
  std::string text = std::string(table.about) + "\n\n" + head_of(table.knob, titles);
  for (const Entry& entry : entries) {
    if (entry.knob != table.knob) continue;
    std::vector<std::string> cells{time_cell(entry, entry.times.p50_ns),
                                   time_cell(entry, entry.times.p99_ns)};
    for (const PageColumn& column : table.columns) cells.push_back(column.cell(entry));
    text += row_of(entry.standard ? "**" + entry.value + "**" : entry.value, cells);
  }
  return text + "\n";
}

/// The standard on each shape: the figures of "all" come from these.
std::string shapes_of(const Entry& standard) {
  using namespace column;
  const std::vector<PageColumn> columns{kTheory,     kTheoryMax, kDirection, kDirectionMax,
                                        kSampleLoop, kToolLoop,  kStep};
  std::vector<std::string> titles;
  titles.reserve(columns.size());
  for (const PageColumn& column : columns) titles.emplace_back(column.title);
  std::string text = "## The shapes\n\nThe standard on each shape.\n\n" + head_of("shape", titles);
  for (const char* shape : {"plane", "ball", "torus", "plate", "crease", "layered ball", "all"}) {
    std::vector<std::string> cells;
    for (PageColumn column : columns) {
      column.shape = shape;
      cells.push_back(column.cell(standard));
    }
    text += row_of(shape, cells);
  }
  return text + "\n";
}

constexpr const char* kRemoval = R"(## Removal

Not measured here; `tests/kernel/milling_test.cpp` bounds it. One stamp of a ball of five voxels' radius removes
the ball's volume to 1 %, and a straight sweep of ten voxels' radius that stays on the voxels' lattice its capsule.
Off the lattice no sweep is that exact: voxels at its rim are partly covered by many stamps in a row, and by the
paper's overlap rule each stamp takes its share of what is left. A groove then has a radius that is up to about
half a voxel larger than the tool's, at steps of a quarter to a whole voxel: the coarser the voxels, the more.
)";

constexpr const char* kAbout = R"(# Accuracy

Made by `./kerf lab accuracy --page docs/accuracy.md`; every figure comes from one run, nothing is typed
by hand. On one machine a run repeats bit for bit, but for the times. `--csv` writes all figures, each metric on each
shape; `--report` writes the same as JSON.

One setting of the paper's contact force (docs/theory.md 7.1) is changed at a time. The others stay at the standard,
in bold: Q15 weights, tool pitch = voxel, `farid` gradients stored as int16, trilinear, voxels of 0.125 mm in 128^3. A
ball of 0.625 mm radius touches six shapes, at 100 places each and at depths up to its radius: a plane at 100 tilts, a
ball, a torus, a plate as thin as two voxels, a groove of 90 degrees, a ball of enamel around dentin.

Truth is the shape itself with sharp faces: F = -p0 SURFINT rho n dA over the tool's surface, exact to 1e-4.
Forces are shares of full scale, p0 pi R^2. `rms` and `max` are over all shapes unless said.

* `direction`: the angle to the force of theory, where that has a tenth of full scale.
* `loop`: |SUM dW| / SUM |dW| around tilted circles of 0.375 mm, of one sample or of the whole tool. It is the work that
  a static tooth gives or takes on a closed path, and should be nothing.
* `us p50`, `p99`: times of one tick of the tool without milling. Where the servo has fast kernels they run: Q15 in the
  methods `gather`, `aligned` and `splat`. Float and double are the servo's templates. Times in brackets are of plain
  loops of the lab (Q8, Q12, splines, other interpolations): compare them with no other time.

)";

}  // namespace

std::string page(const std::vector<Entry>& entries, const std::string& plot) {
  std::string text = kAbout;
  text += lab_provenance() + "\n\n";
  text += "![Error against the time of a tick](" + plot + ")\n\n";
  text += page_advice(entries);
  for (const Table& table : tables()) text += table_of(table, entries);
  for (const Entry& entry : entries) {
    if (!entry.standard) continue;
    text += shapes_of(entry);
    break;
  }
  return text + kRemoval;
}

}  // namespace kerf::accuracy
