// SPDX-License-Identifier: Apache-2.0
#include "lab/stability/page.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <mutex>
#include <optional>
#include <sstream>
#include <utility>
#include <vector>

#include "hil/hil_error.hpp"
#include "lab/run/lab_run.hpp"
#include "lab/stability/arm.hpp"
#include "lab/stability/limit_cycle.hpp"
#include "lab/stability/map_file.hpp"
#include "lab/stability/map_picture.hpp"
#include "lab/stability/one_axis.hpp"
#include "shared/text/text.hpp"

namespace kerf::zwidth {
namespace {

std::pair<double, double> cell_in(const std::string& text) {
  const std::size_t colon = text.find(':');
  const auto stiffness = number_in(text.substr(0, colon));
  const auto damping =
      colon == std::string::npos ? std::nullopt : number_in(text.substr(colon + 1));
  if (!stiffness || !damping || !(*stiffness >= 1e-4) || *stiffness > 127 || *damping < 0 ||
      *damping > 2) {
    throw HilError("--cells: " + text +
                   " is no cell; give stiffness:damping in N/mm and N s/mm, such as 2:0.002");
  }
  return {*stiffness, *damping};
}

using Curve = std::vector<SwingTick>;
using Curves = std::vector<Curve>;  // one for each hit

/// A curve without the points that lie within half a pixel of the last one drawn: at 32 kHz there
/// are some hundred for each that is seen. The axes are at least as long as their longest curve, so
/// a share of that is at most the same share of the panel.
class Thinning {
 public:
  explicit Thinning(const Curves& curves) {
    double left = 0, right = 0, low = 0, high = 0;
    for (const Curve& curve : curves) {
      for (const SwingTick& tick : curve) {
        left = std::min(left, tick.tip_mm);
        right = std::max(right, tick.tip_mm);
        low = std::min(low, tick.mm_per_s);
        high = std::max(high, tick.mm_per_s);
      }
    }
    wide_ = (right - left) / (2 * PanelLayout::kPanelWidth);
    tall_ = (high - low) / (2 * PanelLayout::kPanelHeight);
  }

  void write(std::ostream& script, const Curve& curve) const {
    const SwingTick* drawn = nullptr;
    for (const SwingTick& tick : curve) {
      if (drawn != nullptr && &tick != &curve.back() && is_near(*drawn, tick)) continue;
      script << tick.tip_mm << ' ' << tick.mm_per_s << '\n';
      drawn = &tick;
    }
  }

 private:
  [[nodiscard]] bool is_near(const SwingTick& a, const SwingTick& b) const {
    return std::abs(a.tip_mm - b.tip_mm) <= wide_ && std::abs(a.mm_per_s - b.mm_per_s) <= tall_;
  }
  double wide_, tall_;
};

Curves curves_of_axis(const MapSpec& spec, const Subject& subject, double stiffness,
                      StepCounter& ticks) {
  Curves curves;
  for (const double speed : kHitsMmPerS) {
    Curve& curve = curves.emplace_back();
    static_cast<void>(hit_one_axis(subject, stiffness, speed, spec.seconds, spec.seed, ticks,
                                   [&](const SwingTick& tick) { curve.push_back(tick); }));
  }
  return curves;
}

Curves curves_of_arm(const MapSpec& spec, const Subject& subject, double stiffness,
                     StepCounter& ticks) {
  Curves curves(kArmHits);
  watch_arm(walls_scene(subject), subject, stiffness, spec.seconds, spec.seed, ticks,
            [&](std::size_t hit) {
              return [&curve = curves[hit]](const SwingTick& tick) { curve.push_back(tick); };
            });
  std::erase_if(curves, [](const Curve& curve) { return curve.empty(); });
  if (curves.empty()) throw NotMet();
  return curves;
}

void draw(std::ostream& script, const std::string& title, const Curves& curves) {
  struct Hit {
    const char* name;
    const char* colour;
  };
  constexpr std::array<Hit, kArmHits> kHits{{{"push", "#0072B2"},
                                             {"50 mm/s", "#D55E00"},
                                             {"200 mm/s", "#009E73"},
                                             {"slide", "#CC79A7"},
                                             {"corner", "#E69F00"}}};
  const Thinning thinning(curves);
  for (std::size_t h = 0; h < curves.size(); ++h) {
    gnuplot_block(script, ("hit" + std::to_string(h)).c_str(),
                  [&] { thinning.write(script, curves[h]); });
  }
  script << "set title \"" << title << "\" noenhanced\nplot ";
  for (std::size_t h = curves.size(); h-- > 0;) {
    script << "$hit" << h << " using 1:2 title '" << kHits[h].name << "' with lines linecolor rgb '"
           << kHits[h].colour << (h > 0 ? "', " : "'\n");
  }
}

constexpr const char* kAbout = R"(# Stability

Made by `./kerf lab zwidth --page docs/stability.md`; every figure comes from one run, nothing is typed by hand. The
same seed gives the same bytes on any number of cores. docs/theory.md 5.7 derives the analytic limits, 5.1 the force
of the wall.

The Z-width of a device is the range of stiffness K that it can render, from free air to the stiffest stable wall. A
sampled wall adds a little energy in every tick; damping of device, wall and hand removes it. Above some K more is added
than removed, and the tip oscillates.

Each cell of a map is a device at a flat wall, without a hand unless stated. The runs of a cell start 0.1 mm before the
wall, at rest, at 50 and at 200 mm/s, and push with the Coulomb friction plus 0.5 N.

* Split each run in thirds. A cell *swings* if the last third's travel exceeds three encoder steps and 97 % of the middle
  third's.
* A cell is *active* if the wall's work goes on rising by as much.
* *First* is the lowest K of a column that swings or is active, to 0.5 %, between two cells of the grid. A finer grid may
  find a narrower unstable island below. Stable cells above it are reported apart, because a hand cannot reach them.
* There is no thermal limit: weaker motors would end an oscillation.
* A run lasts longer than asked if mass and damping make a decay too slow to see in thirds.

The boundary depends on the phase of the encoder steps relative to the wall, with friction by up to a factor of two. The
seed sets this phase, equal in every column, so that two columns differ by their axes alone. Another `--seed` shows how
far the boundary moves.

*One axis* runs the servo's own coupling, velocity estimator, stabilisers and force limits, as the same templates and in
the loop's numbers, with exact mechanics. *Whole arm* (`--arm`) runs the servo step with the emulated device, its driver
and its packets in virtual time; it also slides onto the flat and hits the corner of three walls. The mechanics are
plausible values, not those of a unit: for your device, give `--mass`, `--viscous`, `--friction` and `--quantum`.

)";

constexpr const char* kHow = R"(## Maps of your own

    ./kerf lab zwidth --quick --plot zwidth.svg                   # the theory's loop and kerf's side by side
    ./kerf lab zwidth --rate 4000 --delay 0.5 --csv map.csv       # any axis takes a value, a list or a range
    ./kerf lab zwidth --map delay,quantum --delay 0:3:13 --quantum 0:0.2:11 --plot k.svg # the highest K as a colour
    ./kerf lab zwidth --portraits portrait.svg --cells 1:0.002,10:0.002                  # position against speed; --arm too
    ./kerf lab zwidth --arm --delay 0 --stiffness 0.1:50:40 --plot arm.svg               # the whole servo step; minutes
    ./kerf lab zwidth --stabiliser none,passivity,energy_bounding --plot s.svg           # one panel for each

`--law`, `--estimator` and `--stabiliser` also take the laws that a program of yours registers (docs/own-law.md).

A map larger than one machine is cut into shards. Each keeps its finished columns in a part file and goes on from there
when it is started again; `merge` refuses parts of other seeds, programs or axes, and names what is missing. With GNU
parallel, and as a job array of Slurm (`examples/cluster/zwidth.sbatch`):

    parallel ./kerf lab zwidth --rate 250,500,1000,2000 --jobs 1 --shard {}/8 --part zwidth-{}.part ::: {1..8}
    ./kerf lab merge zwidth-*.part --plot zwidth.svg --csv zwidth.csv --json zwidth.json

)";

constexpr const char* kDevicesText =
    R"(The lowest K in N/mm that swings or is active, at two dampings B: the default, and the one with the highest K on the
device's map.

* *Linear, exact* is the boundary without friction and encoder steps.
* The firm hand has 0.1 kg, 0.005 N s/mm, 0.5 N/mm. In *whole arm* a spring of 0.2 N/mm pushes.
* Each measured K is the minimum of three seeds: on one axis 160 stiffnesses from 0.05 to 50 N/mm, runs of 2 s; with the
  whole arm 14 stiffnesses, runs of 1 s.
* *Recommended K* is the minimum of the row over 1.5. The margin covers unstable islands narrower than a step of the map:
  one lies at 0.82 of a first crossing (Omni, no delay, B 0.002).
* The delay of a real device is not known; assume two periods until you measure it.
* Take no more damping than the map shows as stable: beyond its maximum the lag of the velocity and the encoder steps
  drive the oscillation.

These are the emulator's devices. The check of a scene (docs/devices.md, "Gains") is stricter: less viscous damping,
0.0002 N s/mm, and a delay of 2 ms at every rate, because it applies to units that nobody has measured.

)";

constexpr const char* kStabilisersText =
    R"(
## Stabilisers

The same with B = 0.002 N s/mm and a stabiliser that has the device's mass and damping: one axis / whole arm, one seed,
40 and 14 stiffnesses. docs/energy.md has the effect on the hand. `passivity` books a force in the tick that commands
it. With a delay the force acts later, and the port may give far more energy than is booked: `port_minimum_mj` of `--csv`
has the lowest energy of the port in each cell. A run that swings and is active ends its cell.

)";

constexpr const char* kRatesText =
    R"(Without friction the boundary grows in proportion to the rate; measured, it grows less. Encoder steps are the same at
every rate. The velocity window spans up to 16 ms at every rate, so its lag is more periods of a fast loop, which
tolerates less damping than the linear boundary predicts. In grey columns the damping is unstable without any wall.

)";

constexpr const char* kKnobsText = R"(## The effect of each parameter

An Omni with B = 0.002 N s/mm and a delay of one period; one parameter changes at a time, the default is bold, K in N/mm.
The linear boundary includes mass, both dampings, delay, rate, hand and filter. *Re-entry* is the lowest stable K above
the first crossing. One seed, 40 stiffnesses from 0.05 to 50 N/mm, runs of 2 s; a finer map finds more islands.

)";

constexpr const char* kNumbersText = R"(
They differ where a run is chaotic, which is near every boundary of a loop with friction and encoder steps: a difference
of 2^-16 mm or N moves an encoder step to another tick, and with it the rest position of the tip. No number type is better
in general.

)";

struct Device {
  const char* word;
  const char* name;
};
constexpr Device kDevices[] = {
    {"omni", "Omni"}, {"falcon", "Falcon"}, {"woodenhaptics", "WoodenHaptics"}};

void set(MapSpec& spec, AxisId axis, const std::string& text) {
  spec.table[index_of(axis)] = axis_values(axis, text);
}

/// Stiffness against damping; `quick` for a test.
MapSpec map_of(bool quick, int across, int down) {
  MapSpec spec;
  spec.mapped = {index_of(AxisId::damping), kAxisCount};
  set(spec, AxisId::damping, quick ? "0:0.03:3" : "0:0.03:" + std::to_string(across));
  spec.stiffness_n_per_mm =
      stiffness_values(quick ? "0.05:50:6" : "0.05:50:" + std::to_string(down));
  spec.seconds = quick ? 0.3 : 2;
  return spec;
}

/// A first crossing; the ends are those of all maps of the page.
std::string first_text(double n_per_mm) {
  if (n_per_mm == StabilityBoundary::kNever) return "> 50";
  return n_per_mm > 0 ? page_number(n_per_mm) : "< 0.05";
}

/// The lower of both rules; 0 if there is none.
double first_of(const Column& column) {
  if (column.cells.empty()) return 0;
  return std::min(column.swing.first_n_per_mm, column.energy.first_n_per_mm);
}

/// One column; on one axis at so many stiffnesses.
Column column_of(const Measure& measure, const Assignment& values, bool arm, bool quick,
                 std::uint64_t seed = 1, int down = 40) {
  MapSpec spec = map_of(quick, 2, arm ? 14 : down);
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    spec.table[i] = values[i].empty() ? AxisValues{} : AxisValues{values[i]};
  }
  spec.arm = arm;
  spec.seed = seed;
  if (arm) spec.seconds = quick ? 0.3 : 1;
  std::string what;
  for (const std::string& value : values) what += value.empty() ? "" : value + " ";
  return measure(spec, what).columns.begin()->second;
}

/// The lower of both rules, of several places of the encoder's steps.
double least_of_seeds(const Measure& measure, const Assignment& values, bool arm, bool quick) {
  constexpr std::uint64_t kSeeds = 3;
  constexpr int kFine = 160;  // steps of 4 %: an island that is narrower is passed over
  double least = StabilityBoundary::kNever;
  for (std::uint64_t seed = 1; seed <= (quick ? 1 : kSeeds); ++seed) {
    least = std::min(least, first_of(column_of(measure, values, arm, quick, seed, kFine)));
  }
  return least;
}

std::string devices_table(const Measure& measure, const Part& maps, bool quick) {
  std::string text =
      "| device | delay, periods | B, N s/mm | linear, exact | one axis | with a firm hand | whole "
      "arm | "
      "recommended K |\n|---|---:|---:|---:|---:|---:|---:|---:|\n";
  const std::vector<Assignment> assignments = maps.spec.columns();
  for (const Device& device : kDevices) {
    // The damping that carries most on the device's map.
    double best = -1;
    std::string best_damping = "0.002";
    for (const auto& [index, column] : maps.columns) {
      if (assignments[index][index_of(AxisId::device)] != device.word) continue;
      const double first =
          std::min(first_of(column), analytic_of(subject_of(assignments[index])).exact);
      if (first <= best) continue;
      best = first;
      best_damping = assignments[index][index_of(AxisId::damping)];
    }
    const std::vector<std::string> dampings =
        quick ? std::vector{best_damping} : std::vector<std::string>{"0.002", best_damping};
    const std::vector<std::string> delays =
        quick ? std::vector<std::string>{"1"} : std::vector<std::string>{"0", "1", "2"};
    for (const std::string& damping : dampings) {
      for (const std::string& delay : delays) {
        Assignment values;
        values[index_of(AxisId::device)] = device.word;
        values[index_of(AxisId::damping)] = damping;
        values[index_of(AxisId::delay)] = delay;
        const double free = least_of_seeds(measure, values, false, quick);
        const double arm = least_of_seeds(measure, values, true, quick);
        const double exact = analytic_of(subject_of(values)).exact;
        values[index_of(AxisId::hand)] = "firm";
        const double held = least_of_seeds(measure, values, false, quick);
        const double least = std::min({free, held, arm, exact});
        constexpr double kMargin = 1.5;
        text += std::string("| ") + device.name + " | " + delay + " | " + damping + " | " +
                page_number(exact) + " | " + first_text(free) + " | " + first_text(held) + " | " +
                first_text(arm) + " | **" + (least > 0 ? text_below(least / kMargin, 2) : "none") +
                "** |\n";
      }
    }
  }
  return text;
}

std::string stabilisers_table(const Measure& measure, bool quick) {
  std::string text = "| device | delay, periods |", line = "|---|---:|";
  const std::vector<std::string> words =
      quick ? std::vector<std::string>{"none"}
            : std::vector<std::string>{"none", "passivity", "energy_bounding"};
  const std::vector<std::string> delays =
      quick ? std::vector<std::string>{"1"} : std::vector<std::string>{"0", "1", "2"};
  for (const std::string& word : words) {
    text += " " + word + " |";
    line += "---:|";
  }
  text += "\n" + line + "\n";
  for (const Device& device : kDevices) {
    for (const std::string& delay : delays) {
      text += std::string("| ") + device.name + " | " + delay + " |";
      for (const std::string& word : words) {
        Assignment values;
        values[index_of(AxisId::device)] = device.word;
        values[index_of(AxisId::damping)] = "0.002";
        values[index_of(AxisId::delay)] = delay;
        values[index_of(AxisId::stabiliser)] = word;
        text += " " + first_text(first_of(column_of(measure, values, false, quick))) + " / " +
                first_text(first_of(column_of(measure, values, true, quick))) + " |";
      }
      text += "\n";
    }
  }
  return text;
}

struct Knob {
  AxisId axis;
  const char* values;
  const char* also;  ///< a value of `estimator` that the axis needs; else empty
};
constexpr Knob kKnobs[] = {{AxisId::rate, "250,500,1000,2000,4000,8000", ""},
                           {AxisId::delay, "0,0.5,1,2,3", ""},
                           {AxisId::damping, "0,0.001,0.002,0.005,0.01,0.02", ""},
                           {AxisId::friction, "0,0.05,0.1,0.26", ""},
                           {AxisId::quantum, "0,0.01,0.055,0.2", ""},
                           {AxisId::viscous, "0,0.0002,0.0005,0.002", ""},
                           {AxisId::mass, "0.02,0.045,0.2", ""},
                           {AxisId::hand, "none,light,firm", ""},
                           {AxisId::estimator, "foaw,difference", ""},
                           {AxisId::filter, "0,1,5", "difference"},
                           {AxisId::law, "coupling,linear,two_sided", ""},
                           {AxisId::stabiliser, "none,passivity,energy_bounding", ""},
                           {AxisId::limits, "on,off", ""},
                           {AxisId::numeric, "fixed,float,double", ""}};

std::string knobs_table(const Measure& measure, bool quick) {
  std::string text =
      "| knob | value | swings from | active from | linear, exact | re-entry |\n"
      "|---|---:|---:|---:|---:|---:|\n";
  for (const Knob& knob : kKnobs) {
    MapSpec spec = map_of(quick, 2, 40);
    set(spec, AxisId::damping, "0.002");
    if (*knob.also != 0) set(spec, AxisId::estimator, knob.also);
    set(spec, knob.axis, knob.values);
    const Part part = measure(spec, axis_kinds()[index_of(knob.axis)].name);
    const std::vector<Assignment> assignments = spec.columns();
    for (const auto& [index, column] : part.columns) {
      const AxisKind& kind = axis_kinds()[index_of(knob.axis)];
      const double re_entry = column.swing.re_entry_from_n_per_mm;
      const std::string& value = assignments[index][index_of(knob.axis)];
      const bool standard = value == value_of({}, knob.axis);
      text += std::string("| ") + kind.name +
              (*kind.unit != 0 ? std::string(", ") + kind.unit : "") + " | " +
              (standard ? "**" + value + "**" : value) + " | " +
              first_text(column.swing.first_n_per_mm) + " | " +
              first_text(column.energy.first_n_per_mm) + " | " +
              page_number(analytic_of(subject_of(assignments[index])).exact) + " | " +
              (re_entry > 0 ? page_number(re_entry) : "-") + " |\n";
    }
  }
  return text;
}

/// The differences of the three numbers on a map: cells with another verdict than double's.
std::string numbers_text(const Measure& measure, bool quick) {
  const auto map = [&](const char* numeric) {
    MapSpec spec = map_of(quick, 20, 30);
    set(spec, AxisId::numeric, numeric);
    return measure(spec, numeric);
  };
  const Part truth = map("double");
  std::string text;
  for (const char* numeric : {"fixed", "float"}) {
    std::size_t cells = 0, other = 0, columns = 0;
    double widest = 1;
    for (const auto& [index, a] : map(numeric).columns) {
      const Column& b = truth.columns.at(index);
      for (std::size_t k = 0; k < a.cells.size(); ++k) {
        ++cells;
        other += a.cells[k].swings != b.cells[k].swings ? 1 : 0;
      }
      const double x = a.swing.first_n_per_mm, y = b.swing.first_n_per_mm;
      if (a.cells.empty() || !(x > 0) || !(y > 0) || !std::isfinite(x) || !std::isfinite(y))
        continue;
      columns += x != y ? 1 : 0;
      widest = std::max(widest, std::max(x, y) / std::min(x, y));
    }
    text += format(
        "* %s: %zu of %zu cells have another verdict than in double; the first crossing differs in "
        "%zu columns, at most by a\n  factor of %.3g.\n",
        numeric, other, cells, columns, widest);
  }
  return text;
}

}  // namespace

std::string portraits_of(const MapSpec& spec, const std::vector<std::string>& cells) {
  constexpr std::size_t kMost = 12;
  if (cells.empty() || cells.size() > kMost) {
    throw HilError("--portraits: give --cells, 1 to 12 of them, such as 2:0.002,20:0.002");
  }
  for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
    if (spec.table[axis].size() < 2 || axis == index_of(AxisId::damping)) continue;
    throw HilError(std::string("--portraits: the axis ") + axis_kinds()[axis].name + " has " +
                   std::to_string(spec.table[axis].size()) + " values; give it one");
  }
  std::vector<std::pair<double, double>> places;
  Subject subject = subject_of(spec.columns().front());
  for (const std::string& cell : cells) {
    const auto place = cell_in(cell);
    if (std::ranges::find(places, place) != places.end()) {
      throw HilError("--cells: " + cell + " stands there twice; name each once");
    }
    subject.damping_ns_per_mm = place.second;
    const std::string why = impossible(spec, subject);
    if (!why.empty()) throw HilError("--cells: " + cell + ": " + why + "; take another");
    places.push_back(place);
  }
  std::ostringstream script;
  const PanelLayout layout(places.size(), 50, 0);
  layout.begin(script);
  script << "set label 1 \"" << foot_of(spec, AxisId::damping) << "\" at screen 0.02, screen "
         << 30.0 / layout.height << " left noenhanced font ',11' textcolor rgb '#555555'\n";
  script << "set xlabel 'place of the tip, wall at 0 (mm)'\nset ylabel 'speed (mm/s)'\n"
            "set grid back linecolor rgb '#dddddd'\nset key right top horizontal samplen 2\nset "
            "offsets graph 0, 0, graph 0.15, 0\n";
  std::mutex no_results;
  TickWatch watch(no_results);
  for (const auto& [stiffness, damping] : places) {
    subject.damping_ns_per_mm = damping;
    StepCounter ticks;
    const TickWatch::Watched watched(watch, ticks, laws_of(spec.columns().front()));
    const Curves curves = spec.arm ? curves_of_arm(spec, subject, stiffness, ticks)
                                   : curves_of_axis(spec, subject, stiffness, ticks);
    draw(script, format("K %g N/mm, B %g N s/mm", stiffness, damping), curves);
  }
  script << "unset multiplot\n";
  return script.str();
}

StabilityPage stability_page(const Measure& measure, const std::string& devices,
                             const std::string& rates, bool quick) {
  MapSpec of_devices = map_of(quick, 31, 36);
  set(of_devices, AxisId::device, "omni,falcon,woodenhaptics");
  const Part device_maps = measure(of_devices, "devices");
  MapSpec of_rates = map_of(quick, 21, 30);
  if (!quick) of_rates.seconds = 1;
  set(of_rates, AxisId::rate, "250,500,1000,2000,4000,8000");
  const Part rate_maps = measure(of_rates, "rates");

  StabilityPage page;
  page.text = std::string(kAbout) + "## Devices\n\n![Maps of three devices](" + devices + ")\n\n" +
              kDevicesText + devices_table(measure, device_maps, quick) + kStabilisersText +
              stabilisers_table(measure, quick) + "\n## Rates\n\n![Maps of six rates](" + rates +
              ")\n\n" + kRatesText + kKnobsText + knobs_table(measure, quick) +
              "\n## Fixed point, float and double\n\n" + numbers_text(measure, quick) +
              kNumbersText + kHow + lab_provenance() + "\n";
  page.devices_plot = plot_of(device_maps);
  page.rates_plot = plot_of(rate_maps);
  return page;
}

}  // namespace kerf::zwidth
