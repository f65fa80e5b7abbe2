// SPDX-License-Identifier: Apache-2.0
#include "lab/contact/page.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <sstream>

#include "lab/rig/geometry.hpp"
#include "lab/run/lab_run.hpp"

namespace kerf::extremes {
namespace {

constexpr const char* kAbout = R"(# Contact

Made by `./kerf lab extremes --page docs/contact.md`; every figure comes from one run, nothing is typed by
hand. A run repeats bit for bit, but for the times of ticks. `--report` writes the rows as JSON, `--only` measures
some groups of them. The command exits with 1 where a limit is not kept.

The swept proxy (`[force] model = "proxy"`) keeps the whole tool out of the solid, and a spring pulls the hand to
it. The paper's force (`"paper"`) is the sum of the density's gradients inside of the tool. docs/theory.md derives
both. They are measured as the servo runs them: in fixed point, by the fastest kernels of this machine. Unless said,
a voxel is 0.1 mm, a tick 1 ms, the tool a ball of 16 voxels, and a face is a ramp of density over two voxels.
docs/validation.md lists what is tested in fixed point and in double.

)";

constexpr const char* kCompared = R"(## The paper's force and the swept proxy

![Both forces on the same motions](%s)

The paper's force gives way to a hand that presses on. It grows with the area in touch, here to %s N, and ends where
the ball is wholly inside; behind a wall of two voxels it pushes onward. A press of 3 mm meets no resistance along %s mm
of it in the thick wall and %s mm at the thin one. The proxy stays in front, and its force grows with the depth.

The paper's force acts only near a face. A hand that moves farther than this zone in one tick can cross the face between
two ticks. The table has the lowest speed at which this happens for some phase of the ticks. The proxy is measured up to
10 m/s; faster hands are stopped by the supervisor.

| update rate | paper, %s | paper, %s | proxy, both |
|---:|---:|---:|---:|
%s
Both slide smoothly over a ball: at 50 mm/s the force changes by at most %s %% (paper) and %s %% (proxy) of its mean
from tick to tick, and stays within %s and %s degrees of the normal.

)";

struct About {
  const char* group;
  const char* title;
  const char* text;
};
constexpr About kGroups[] = {
    {"walls", "Walls",
     R"(A hand makes random steps of 0.1 to 10 m/s at a tilted wall. The cylinder and the bur of `scenes/fluted_bur.toml` are
also turned at random. There is no supervisor.)"},
    {"air", "In air",
     R"(A tool is led to and fro along tilted walls, so near and so fast that the hand goes 5 to 80 voxels in a
tick. `--check` tells the speed up to which a scene is free of drag at any distance (docs/theory.md 4.2).)"},
    {"rests", "Where a ball comes to rest",
     R"(Offsets from the ideal solid at random tilts. On edges from the volume's own iso-surface, since trilinear density
holds no sharp edge.)"},
    {"slides", "Slides",
     R"(The step is the change of the force from tick to tick over its mean. The turning of the normal alone makes 1.04 % at
R 40 and 4.5 % at R 14; there the limit is 0.08 N or twice the mean. `CT` has edges blurred by a deviation of one voxel,
and noise of 2 %.)"},
    {"shapes", "Tools that are no balls",
     R"(At rest on flats of any tilt and on sharp edges of 90 degrees, the edges against the volume's own iso-surface; and
sliding at 50 mm/s over a ball of R 40, 2 voxels deep. Limits are 1.5 times those of the ball.

On CT with noise a rim or a point touches in one place, where the noise of one voxel makes waves of the surface itself;
a ball's height and normal are means of some fifty samples. A scene smooths such a volume when it loads it
(`denoise = "auto"`, docs/theory.md 2.4), and so do the rows with limits; `denoise off` is the same without. `exact
contact` shows the surface that was not smoothed: height and normal of the iso-surface where the tool's close samples
touch it at the ideal place, the normal over half a voxel. A contact without any mean would feel this.)"},
    {"edges", "Along and over sharp edges",
     R"(A ball, and a cylinder whose side lies on the edge, two voxels deep on a sharp convex edge of 90 degrees at 0.05
voxels a tick. The density is the solid's share of a cube of two voxels, as a scan has it. A ramp of the distance from
the solid has a ridge that voxels do not hold: its trilinear iso-surface is a row of bumps about a voxel apart, and from
bump to bump the place nearest to the hand itself jumps.)"},
    {"isos", "Low and high iso",
     R"(Tools at rest on flats of any tilt and on balls of R 14, where the iso is a share of full density other than the
half. The angle between force and normal may be 1.5 times that at an iso of 0.45.)"},
    {"cutting", "Cutting by force",
     R"(The whole servo with `[cut] model = "preston"` and a ball of radius 1 mm. It is led by hand over a flat; pressed on it
with a force that goes up to 1.2 N and back, however far the flat gives way; and sunk into a crown at the rate of
enamel, at the worst of nine places. `GE tooth` is a real tooth by CT, below `--data` or `$KERF_DATA`.)"},
    {"traps", "Traps",
     R"(A random search in the whole servo: a hand presses a tool of 0.4 to 1 mm or the fluted bur, half of them with a
shaft, some with a handpiece, turned anyhow, with 0.1 to 1 N for 5 s, from any side and with a tremor of 0.1 mm: into a
flat, a crown, layers, rubble, pits, shells, plates, or a block that ends at the volume's border. Half of these have
soft matter in them, which may not be cut in half of those; machinability is 1, 4 or 8 times that of enamel. Of 24
scenes 18 run in fixed point at 1 kHz and 250 Hz, the others at 8 kHz and in double. Wherever force presses
with more than the threshold, matter must leave. A shaft may bear what its own cylinders, where they touch, can balance
by any forces along their normals; the rest is the head's. What is all softer than the iso must bear nothing. 240
presses; 10,000 with `--only traps`; `--seed` names the first scene.)"},
    {"ticks", "Ticks",
     R"(On 256 x 256 x 161 voxels. The costliest tick of each tool is searched among thousands: at flat, sharp, hollow and
noisy solids, in a slot with a play of 0.1 voxels, in tissue just below the iso and, where its data are, at the GE
tooth; with goals near and far, and from the start search. The ticks that took longest are repeated from the same
state, and the fastest repetition counts. The row says where the tick was found. Times are of the machine named
above; where another is slower, so is the paper's tick beside them.)"},
    {"hands", "Hands",
     R"(An emulated Omni, its driver and the whole servo in virtual time, with `scenes/touch.toml`; `groove` and `cut_cavity`
have `[cut] model = "preston"`. Force above 150 Hz is the rms over windows of 0.128 s that are wholly in contact. One
count of an encoder is up to 0.06 mm, or 0.024 N. The second stab of `jerk` misses the crown.)"},
};

std::string cell(const std::optional<double>& limit) {
  return limit ? page_number(*limit) : "";
}

std::string table_of(const std::vector<Row>& rows, const std::string& group) {
  std::string table = "| what | value | | must | aim | |\n|---|---:|---|---:|---:|---|\n";
  for (const Row& row : rows) {
    if (row.group != group) continue;
    if (!row.skipped.empty()) {
      table += "| " + row.name + " | | | " + cell(row.must) + " | " + cell(row.aim) +
               " | skipped: " + row.skipped + " |\n";
      continue;
    }
    const char* verdict = !row.must ? "" : !row.pass() ? "**missed**" : "kept";
    table += "| " + row.name + " | " + page_number(row.value) + " | " +
             (row.unit == "1" ? "" : row.unit) + " | " + cell(row.must) + " | " + cell(row.aim) +
             " | " + verdict + " |\n";
  }
  return table + "\n";
}

std::string speed(const std::optional<double>& mm_per_s) {
  return mm_per_s ? page_number(*mm_per_s) + " mm/s" : "never";
}

std::string compared(const Comparison& comparison, const std::string& plot) {
  const Wall &thick = comparison.walls[0], &thin = comparison.walls[1];
  std::string speeds;
  for (std::size_t i = 0; i < thick.losses.size(); ++i) {
    const Loss &at = thick.losses[i], &also = thin.losses[i];
    speeds += "| " + page_number(at.rate_hz) + " Hz | " + speed(at.paper_mm_per_s) + " | " +
              speed(also.paper_mm_per_s) + " | " +
              speed(at.proxy_mm_per_s ? at.proxy_mm_per_s : also.proxy_mm_per_s) + " |\n";
  }
  const Slide& slide = comparison.slide;
  char text[4096];
  std::snprintf(text, sizeof text, kCompared, plot.c_str(), page_number(thick.paper_most_n).c_str(),
                page_number(thick.paper_unfelt_mm).c_str(),
                page_number(thin.paper_unfelt_mm).c_str(), thick.name.c_str(), thin.name.c_str(),
                speeds.c_str(), page_number(100 * slide.paper_step).c_str(),
                page_number(100 * slide.proxy_step).c_str(),
                page_number(slide.paper_degrees).c_str(), page_number(slide.proxy_degrees).c_str());
  return text;
}

/// How many limits are kept, and which are not.
std::string verdict(const std::vector<Row>& rows) {
  const auto judged = std::ranges::count_if(rows, &Row::judged);
  const auto missed = std::ranges::count_if(rows, [](const Row& row) { return !row.pass(); });
  std::string text = "Of " + std::to_string(judged) + " limits " + std::to_string(judged - missed) +
                     " are kept" + (missed > 0 ? "; missed are\n\n" : ".\n");
  for (const Row& row : rows) {
    if (row.pass()) continue;
    text += "* " + row.group + ", " + row.name + ": " + page_number(row.value) + " " + row.unit +
            " instead of " + cell(row.must) + "\n";
  }
  return text + "\n";
}

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
  constexpr std::size_t kEvery = 32;  // ticks: finer is not visible
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

std::string page(const std::vector<Row>& rows, const Comparison& comparison,
                 const std::string& plot, const std::string& hands_plot) {
  std::string text =
      kAbout + lab_provenance() + "\n\n" + verdict(rows) + compared(comparison, plot);
  for (const About& about : kGroups) {
    text += std::string("## ") + about.title + "\n\n" + about.text + "\n\n";
    if (std::string(about.group) == "hands") {
      text += "![Height and force of each hand](" + hands_plot + ")\n\n";
    }
    text += table_of(rows, about.group);
  }
  text.pop_back();
  return text;
}

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
