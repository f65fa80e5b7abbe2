// SPDX-License-Identifier: Apache-2.0
#include "lab/accuracy/page.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "lab/accuracy/study.hpp"
#include "lab/run/lab_run.hpp"

namespace kerf::accuracy {
namespace {

/// A figure of a table or a sentence: a metric of a shape, scaled to the title's unit.
struct PageColumn {
  const char* title;
  const char* metric;
  double scale = 1;
  const char* shape = "all";

  /// Empty if the metric was not measured.
  [[nodiscard]] std::string cell(const Entry& entry) const {
    const double* figure = entry.find(metric, shape);
    return figure == nullptr ? "" : page_number(*figure * scale);
  }
};

namespace column {
constexpr double kPercent = 100, kPermille = 1000, kPpm = 1e6;
constexpr PageColumn kTheory{"force rms %", "force_vs_theory_rms", kPercent};
constexpr PageColumn kTheoryMax{"max %", "force_vs_theory_max", kPercent};
constexpr PageColumn kDirection{"direction rms deg", "force_direction_rms"};
constexpr PageColumn kDirectionMax{"max deg", "force_direction_max"};
constexpr PageColumn kDouble{"against double rms ppm", "force_vs_double_rms", kPpm};
constexpr PageColumn kDoubleMax{"max ppm", "force_vs_double_max", kPpm};
constexpr PageColumn kNormal{"normal rms deg", "normal_rms", 1, "ball"};
constexpr PageColumn kNormalMax{"max deg", "normal_max", 1, "ball"};
constexpr PageColumn kCorner{"corner rms", "interpolation_rms", 1, "corners"};
constexpr PageColumn kCornerMax{"max", "interpolation_max", 1, "corners"};
constexpr PageColumn kSampleLoop{"loop, sample", "loop_sample_rms"};
constexpr PageColumn kToolLoop{"loop, tool", "loop_tool_rms"};
constexpr PageColumn kStep{"step max permille", "step_max", kPermille};
constexpr PageColumn kNoise{"noise", "noise_gain", 1, "noise"};
constexpr PageColumn kMemory{"bytes a voxel", "memory", 1, "any"};
constexpr PageColumn kSamples{"samples", "samples", 1, "any"};
constexpr PageColumn kOrder{"order", "order"};
}  // namespace column

/// `text` with each {} replaced by the next figure.
std::string filled(std::string text, std::initializer_list<std::string> figures) {
  std::size_t at = 0;
  for (const std::string& figure : figures) {
    at = text.find("{}", at);
    text.replace(at, 2, figure);
    at += figure.size();
  }
  return text;
}

/// Looks up the choice of a value; values are unique among the knobs.
class Choices {
 public:
  explicit Choices(const std::vector<Entry>& entries) : entries_(entries) {}

  [[nodiscard]] const Entry& at(std::string_view value) const {
    for (const Entry& entry : entries_) {
      if (entry.value == value) return entry;
    }
    return entries_.front();
  }
  [[nodiscard]] std::string of(std::string_view value, const PageColumn& column) const {
    return column.cell(at(value));
  }
  [[nodiscard]] std::string us(std::string_view value) const {
    return page_number(at(value).times.p50_ns / 1e3);
  }
  /// How many times longer the tick of `slow` takes.
  [[nodiscard]] std::string times(std::string_view slow, std::string_view fast) const {
    return page_number(at(slow).times.p50_ns / at(fast).times.p50_ns);
  }

 private:
  const std::vector<Entry>& entries_;
};

/// The page's advice on the choice: fixed sentences, figures of this run. Needs every
/// choice of a whole study.
std::string page_advice(const std::vector<Entry>& entries) {
  using namespace column;
  const Choices c(entries);
  constexpr const char* kAlignedFine = "aligned 0.0625 mm";
  std::string text = "## What to choose\n\n";
  text += filled(
      R"(* A round tool: the method `aligned`, {} us a tick, at most {} ppm of full scale away from double. Nothing is
  stored, so a cut refreshes nothing.
* Any other tool: `gather` ({} us, at most {} ppm, {} bytes a voxel), and `splat` where the scene cuts ({} us,
  at most {} ppm, nothing stored).
* Few samples favour `gather`, many `aligned`: {} of them take {} against {} us, {} (in voxels of 0.0625 mm)
  {} against {} us. The servo takes `aligned` wherever it can: it also needs no memory and no refresh.
)",
      {c.us("aligned"), c.of("aligned", kDoubleMax), c.us("int16 gradients"),
       c.of("int16 gradients", kDoubleMax), c.of("int16 gradients", kMemory), c.us("splat"),
       c.of("splat", kDoubleMax), c.of("aligned", kSamples), c.us("int16 gradients"),
       c.us("aligned"), c.of(kAlignedFine, kSamples), c.us("0.0625 mm"), c.us(kAlignedFine)});
  text += filled(
      R"(* Fixed point: Q15, at most {} ppm away from double (Q12 {}, Q8 {}). Theory is {} % away from all of them: the
  hand could do with Q8; the 16 bits of the kernels hold Q15.
)",
      {c.of("Q15", kDoubleMax), c.of("Q12", kDoubleMax), c.of("Q8", kDoubleMax),
       c.of("Q15", kTheory)});
  text += filled(
      R"(* Pitch 1. Half of it takes {} times as long for an error of {} instead of {} %; twice of it leaves {} %.
)",
      {c.times("1/2", "1"), c.of("1/2", kTheory), c.of("1", kTheory), c.of("2", kTheory)});
  text += filled(
      R"(* Gradients by `farid`: normals to {} deg rms (`sobel5` {}, `central` {}). `central` blurs less, so its force
  is nearer to theory ({} against {} %), but it passes {} of the noise instead of {}, and a closed path of
  the tool makes or takes {} of the work that goes to and fro instead of {}.
)",
      {c.of("farid", kNormal), c.of("sobel5", kNormal), c.of("central", kNormal),
       c.of("central", kTheory), c.of("farid", kTheory), c.of("central", kNoise),
       c.of("farid", kNoise), c.of("central", kToolLoop), c.of("farid", kToolLoop)});
  text += filled(
      R"(* Where no energy may come from nothing: a spline of the density. The tool's loop makes or takes {}
  (quadratic) or {} (cubic) of the work instead of {}.
)",
      {c.of("spline 2", kToolLoop), c.of("spline 3", kToolLoop),
       c.of("int16 gradients", kToolLoop)});
  text += filled(
      R"(* Never the nearest voxel: 0.01 voxel can change the force by {} thousandths of full scale, trilinear by {}.
)",
      {c.of("nearest", kStep), c.of("trilinear", kStep)});
  text += filled(
      R"(* Most of the error of theory is blur, by the kernel and by the ramp of one voxel at each face. Voxels of
  0.0625 mm instead of 0.125 mm take {} times as long in the method `gather` and bring {} instead of {} %.
)",
      {c.times("0.0625 mm", "0.125 mm"), c.of("0.0625 mm", kTheory), c.of("0.125 mm", kTheory)});
  return text + "\n";
}

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

/// In brackets if it is not a time of the servo's code.
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

constexpr double kWidth = 1200, kHeight = 1000;             // pixels of the picture
constexpr double kPanelWidth = 0.40, kPanelHeight = 0.345;  // of the picture

// Colours of Okabe and Ito, which differ for every kind of colour vision.
struct KnobColour {
  const char* knob;
  const char* rgb;
};
constexpr std::array<KnobColour, 7> kColours{{{"standard", "#000000"},
                                              {"arithmetic", "#E69F00"},
                                              {"pitch", "#56B4E9"},
                                              {"kernel", "#009E73"},
                                              {"storage", "#D55E00"},
                                              {"interpolation", "#CC79A7"},
                                              {"voxel", "#0072B2"}}};

struct Panel {
  const char* title;
  const char* metric;
  double scale;
  double left, bottom;  ///< of the picture
};
constexpr std::array<Panel, 4> kPanels{
    {{"force against theory, rms (% of full scale)", "force_vs_theory_rms", 100, 0.08, 0.54},
     {"direction of the force, rms (deg)", "force_direction_rms", 1, 0.57, 0.54},
     {"work of a closed loop, rms (share of the work to and fro)", "loop_tool_rms", 1, 0.08, 0.07},
     {"difference to double, rms (share of full scale)", "force_vs_double_rms", 1, 0.57, 0.07}}};

/// Two errors that differ by less than 1 % are the same.
constexpr double kBetter = 0.99;

struct Mark {
  std::string label;
  std::string knob;
  double us, error;
  bool front = false;
};

/// The standard is in every knob, and once in the picture.
std::vector<Mark> marks_of(const Panel& panel, const std::vector<Entry>& entries) {
  std::vector<Mark> marks;
  bool standard_seen = false;
  for (const Entry& entry : entries) {
    const double* error = entry.find(panel.metric);
    if (error == nullptr || *error <= 0 || (entry.standard && standard_seen)) continue;
    standard_seen = standard_seen || entry.standard;
    const bool bare = entry.knob == "pitch" || entry.knob == "voxel";
    marks.push_back({entry.standard ? "standard"
                     : bare         ? entry.knob + " " + entry.value
                                    : entry.value,
                     entry.standard ? "standard" : entry.knob, entry.times.p50_ns / 1e3,
                     *error * panel.scale});
  }
  std::sort(marks.begin(), marks.end(), [](const Mark& a, const Mark& b) { return a.us < b.us; });
  double best = std::numeric_limits<double>::infinity();
  for (Mark& mark : marks) {
    mark.front = mark.error < kBetter * best;
    best = std::min(best, mark.error);
  }
  return marks;
}

/// A logarithmic axis with room at both ends; ticks at 1, 2, 5 if it is short.
struct Axis {
  double low, high;  ///< log10

  Axis(double smallest, double largest) {
    const double length = std::max(std::log10(largest / smallest), 0.3);
    low = std::log10(smallest) - 0.2 * length;  // a label of the fastest choice fits beside it
    high = std::log10(largest) + 0.15 * length;
  }
  [[nodiscard]] double share(double value) const {
    return (std::log10(value) - low) / (high - low);
  }
  [[nodiscard]] std::string range() const {
    std::ostringstream text;
    text << "[" << std::pow(10, low) << ":" << std::pow(10, high) << "]";
    return text.str();
  }
  [[nodiscard]] std::string ticks() const {
    std::ostringstream text;
    const bool short_axis = high - low < 2.5;
    for (int decade = static_cast<int>(std::floor(low)); decade <= high; ++decade) {
      for (const int digit : {1, 2, 5}) {
        const double at = digit * std::pow(10, decade);
        if ((digit != 1 && !short_axis) || std::log10(at) < low || std::log10(at) > high) continue;
        text << (text.str().empty() ? "" : ",") << "'" << at << "' " << at;
      }
    }
    return "(" + text.str() + ")";
  }
};

void draw_labels(std::ostream& script, const std::vector<Mark>& marks, const Axis& x,
                 const Axis& y) {
  const double width = kPanelWidth * kWidth, height = kPanelHeight * kHeight;
  LabelPlaces places(width, height);
  const auto right = [&](const Mark& mark) { return x.share(mark.us) * width; };
  const auto up = [&](const Mark& mark) { return y.share(mark.error) * height; };
  const Mark* before = nullptr;  // the front goes right, then down
  for (const Mark& mark : marks) {
    places.keep_mark_free(right(mark), up(mark));
    if (!mark.front) continue;
    if (before != nullptr) {
      places.keep_line_free(right(*before), up(*before), right(mark), up(*before));
      places.keep_line_free(right(mark), up(*before), right(mark), up(mark));
    }
    before = &mark;
  }
  std::vector<const Mark*> order;
  order.reserve(marks.size());
  for (const Mark& mark : marks) order.push_back(&mark);
  const auto rank = [](const Mark* mark) {
    return mark->front ? 0 : mark->knob == kColours.front().knob ? 1 : 2;
  };
  std::stable_sort(order.begin(), order.end(),
                   [&](const Mark* a, const Mark* b) { return rank(a) < rank(b); });
  for (const Mark* mark : order) {
    const auto at = places.place(mark->label, right(*mark), up(*mark));
    if (!at) continue;
    script << "set label '" << mark->label << "' at graph " << at->x / width << ", graph "
           << at->y / height << ' ' << at->align << " textcolor rgb '"
           << (rank(mark) < 2 ? "#000000" : "#666666") << "'\n";
  }
}

/// One line above the panels; drawn with the next plot. (gnuplot's own key gets no wider than a
/// panel.)
void draw_legend(std::ostream& script) {
  constexpr double kLeft = 0.08, kStep = 0.115, kUp = 0.97;
  double x = kLeft;
  for (const KnobColour& colour : kColours) {
    script << "set label '" << colour.knob << "' at screen " << x << ", screen " << kUp
           << " left point pointtype 7 linecolor rgb '" << colour.rgb << "' offset 1,-0.2\n";
    x += kStep;
  }
  script << "set arrow from screen " << x << ", screen " << kUp << " to screen " << x + 0.025
         << ", screen " << kUp << " nohead linecolor rgb '#999999' linewidth 2\n"
         << "set label 'front' at screen " << x + 0.035 << ", screen " << kUp << " left\n";
}

void draw(std::ostream& script, const Panel& panel, const std::vector<Entry>& entries) {
  const std::vector<Mark> marks = marks_of(panel, entries);
  if (marks.empty()) return;
  const auto by_error = [](const Mark& a, const Mark& b) { return a.error < b.error; };
  const auto [least, most] = std::minmax_element(marks.begin(), marks.end(), by_error);
  const Axis x(marks.front().us, marks.back().us), y(least->error, most->error);
  script << "$marks << EOD\n";
  for (const Mark& mark : marks) {
    const auto colour = std::find_if(kColours.begin(), kColours.end(),
                                     [&](const KnobColour& c) { return mark.knob == c.knob; });
    script << mark.us << ' ' << mark.error << " 0x" << colour->rgb + 1 << '\n';
  }
  script << "EOD\n$front << EOD\n";
  for (const Mark& mark : marks) {
    if (mark.front) script << mark.us << ' ' << mark.error << '\n';
  }
  script << "EOD\n";
  draw_labels(script, marks, x, y);
  script << "set lmargin at screen " << panel.left << "\nset rmargin at screen "
         << panel.left + kPanelWidth << "\nset bmargin at screen " << panel.bottom
         << "\nset tmargin at screen " << panel.bottom + kPanelHeight << "\nset title '"
         << panel.title << "'\nset xrange " << x.range() << "\nset yrange " << y.range()
         << "\nset xtics " << x.ticks() << "\nset ytics " << y.ticks() << "\n"
         << "plot $front with steps linecolor rgb '#999999' linewidth 2, \\\n"
            "  $marks with points pointtype 7 pointsize 0.9 linecolor rgb variable\n"
            "unset label\nunset arrow\n";
}

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

std::string plot_script(const std::vector<Entry>& entries) {
  std::ostringstream script;
  script.precision(9);
  script << "set encoding utf8\nset terminal svg size " << kWidth << ',' << kHeight
         << " dynamic font 'Helvetica,13' background rgb 'white'\n"
         << R"(set logscale xy
set grid back linecolor rgb '#dddddd' linetype 1 linewidth 0.5
set border 3 linecolor rgb '#555555'
set tics nomirror out textcolor rgb '#333333'
set xlabel 'time of a tick, p50 (us)'
unset key
set multiplot
)";
  draw_legend(script);
  for (const Panel& panel : kPanels) draw(script, panel, entries);
  script << "unset multiplot\n";
  return script.str();
}

}  // namespace kerf::accuracy
