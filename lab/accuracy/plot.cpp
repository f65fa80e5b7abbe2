// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <sstream>

#include "lab/accuracy/label_places.hpp"
#include "lab/accuracy/page.hpp"

namespace kerf::accuracy {
namespace {

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

/// A logarithmic axis with room at both ends; ticks at 1, 2, 5 where it is short.
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
