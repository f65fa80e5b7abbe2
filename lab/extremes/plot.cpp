// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstddef>
#include <sstream>

#include "lab/extremes/page.hpp"
#include "lab/rig/points.hpp"

namespace kerf::extremes {
namespace {

constexpr const char* kPaperLine = "lines dashtype 2 linewidth 2 linecolor rgb '#D55E00'";
constexpr const char* kProxyLine = "lines linewidth 2 linecolor rgb '#0072B2'";
constexpr const char* kOtherLine = "lines dashtype 4 linewidth 2 linecolor rgb '#E69F00'";

void begin(std::ostream& script, int width, int height, const char* layout) {
  script.precision(5);
  script << "set encoding utf8\nset terminal svg size " << width << ',' << height
         << " dynamic font 'Helvetica,13' background rgb 'white'\n"
            "set grid back linecolor rgb '#dddddd' linetype 1 linewidth 0.5\n"
            "set border 3 linecolor rgb '#555555'\n"
            "set tics nomirror out textcolor rgb '#333333'\n"
            "set key left top samplen 3\nset tmargin 2.5\n"
            "set multiplot layout "
         << layout << '\n';
}

void data(std::ostream& script, const char* name, const auto& rows, const auto& line_of) {
  script << '$' << name << " << EOD\n";
  for (const auto& row : rows) line_of(row);
  script << "EOD\n";
}

void draw(std::ostream& script, const Wall& wall) {
  data(script, "press", wall.presses, [&](const Press& at) {
    script << at.depth_mm << ' ' << at.paper_n << ' ' << at.proxy_n << '\n';
  });
  script << "set title 'slow press into " << wall.name
         << "'\nset xlabel 'hand below the face (mm)'\nset ylabel 'force (N)'\n"
         << "plot $press using 1:3 title 'proxy' with " << kProxyLine
         << ", $press using 1:2 title 'paper' with " << kPaperLine << '\n';
}

void draw_losses(std::ostream& script, const std::vector<Wall>& walls) {
  const char* names[] = {"thick", "thin"};
  for (std::size_t w = 0; w < walls.size(); ++w) {
    data(script, names[w], walls[w].losses, [&](const Loss& at) {
      if (at.paper_mm_per_s) script << at.rate_hz << ' ' << *at.paper_mm_per_s << '\n';
    });
  }
  script << "set title 'speed from which a hand can pass unfelt'\nset xlabel 'update rate (Hz)'\n"
            "set ylabel 'speed (mm/s)'\nset logscale xy\nset xrange [18:1100]\n"
            "set yrange [10:20000]\nset key right bottom\nset xtics (20,50,100,200,500,1000)\n"
            "plot 10000 title 'proxy: not up to here' with "
         << kProxyLine << ", $thick title 'paper, " << walls[0].name << "' with " << kPaperLine
         << ", $thin title 'paper, " << walls[1].name << "' with " << kOtherLine
         << "\nunset logscale\nset xrange [*:*]\nset key left top\nset xtics auto\n";
}

void draw(std::ostream& script, const Slide& slide) {
  data(script, "slide", slide.ticks, [&](const SlideTick& at) {
    script << at.travel_mm << ' ' << at.paper << ' ' << at.proxy << '\n';
  });
  script << "set title 'slide over a ball of R 40 voxels, 2 deep, 50 mm/s'\n"
            "set xlabel 'path (mm)'\nset ylabel 'force over its mean'\nset yrange [0.98:1.02]\n"
            "plot $slide using 1:3 title 'proxy' with "
         << kProxyLine << ", $slide using 1:2 title 'paper' with " << kPaperLine
         << "\nset yrange [*:*]\n";
}

/// From shortly before the first contact on.
void draw(std::ostream& script, const HandRun& run, bool cuts) {
  constexpr std::size_t kEvery = 32;  // ticks: what the eye can tell
  constexpr double kBeforeS = 0.3;
  const auto first = std::ranges::find_if(run.ticks, &HandTick::contact) - run.ticks.begin();
  const double begin = std::max(0.0, static_cast<double>(first) - kBeforeS * run.rate_hz);
  script << "$hand << EOD\n";
  for (auto i = static_cast<std::size_t>(begin); i < run.ticks.size(); i += kEvery) {
    const HandTick& tick = run.ticks[i];
    script << static_cast<double>(i) / run.rate_hz << ' ' << tick.height_mm << ' '
           << tick.proxy_height_mm << ' ' << length(tick.force_n) << ' ' << tick.removed_mm3
           << '\n';
  }
  script << "EOD\nset title '" << run.name
         << ": height of the tip (mm)' noenhanced\n"
            "plot $hand using 1:2 title 'hand' with "
         << kPaperLine << ", $hand using 1:3 title 'tool as felt' with " << kProxyLine
         << "\nset title '" << run.name
         << ": force (N)' noenhanced\nplot $hand using 1:4 notitle with " << kProxyLine << '\n';
  if (run.ticks.back().removed_mm3 > 0) {
    script << "set title '" << run.name
           << ": removed (mm^3)' noenhanced\nplot $hand using 1:5 notitle with " << kProxyLine
           << '\n';
  } else if (cuts) {
    script << "set multiplot next\n";
  }
}

}  // namespace

std::string plot_of(const Comparison& comparison) {
  std::ostringstream script;
  begin(script, 1100, 800, "2,2");
  for (const Wall& wall : comparison.walls) draw(script, wall);
  draw_losses(script, comparison.walls);
  draw(script, comparison.slide);
  script << "unset multiplot\n";
  return script.str();
}

std::string plot_of(const std::vector<HandRun>& hands) {
  bool cuts = false;
  for (const HandRun& run : hands) {
    cuts = cuts || run.ticks.back().removed_mm3 > 0;
  }
  std::ostringstream script;
  const std::string layout = std::to_string(hands.size()) + (cuts ? ",3" : ",2");
  begin(script, 1100, 250 * static_cast<int>(hands.size()), layout.c_str());
  // Room for the key, which the first picture has for all.
  script << "unset grid\nset xtics 2\nset xlabel 's' offset 0,0.5\nset key right top\n"
            "set offsets 0,0,graph 0.7,graph 0.1\n";
  for (const HandRun& run : hands) {
    draw(script, run, cuts);
    script << "unset key\nset offsets 0,0,graph 0.15,graph 0.1\n";
  }
  script << "unset multiplot\n";
  return script.str();
}

}  // namespace kerf::extremes
