// SPDX-License-Identifier: Apache-2.0
#include "lab/zwidth/page.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "lab/rig/lab_run.hpp"
#include "lab/zwidth/map/tables.hpp"
#include "lab/zwidth/picture/map_plot.hpp"
#include "shared/text/format.hpp"
#include "shared/text/number.hpp"

namespace kerf::zwidth {
namespace {

constexpr const char* kAbout = R"(# Stability

Made by `./kerf lab zwidth --page docs/stability.md`; every figure comes from one run, nothing is typed by hand. The
same seed gives the same bytes on any number of cores. docs/theory.md 5.7 derives the analytic limits, 5.1 the force
of the wall.

A hand feels a wall as hard while its stiffness K is high, and as free air while none is there: what a device can show
between the two is its Z-width. A sampled wall gives a little energy in every tick; damping, of the device, of the wall
and of the hand, takes it away. Above some K it does not, and the tip swings on.

Each cell of a map is a device at a flat wall, without a hand unless said. It starts 0.1 mm before the wall at rest, at
50 and at 200 mm/s, and is pushed on with its Coulomb friction and 0.5 N more. A cell *swings* where one of these runs
has a travel in its last third above three encoder steps and 0.97 of that in the middle third. It is *active* where the
wall's work goes on rising by as much as that. *First* is where a column begins to do so: between the last fine cell of
the grid and the next one, to 0.5 %. A finer grid may find a narrower island below it; cells above it that come to rest
again are told apart, because no hand gets there through those that swing. The motors stay cool: a thermal limit would
end a swing by weakening them. A hit lasts longer than asked where mass and damping are such that its thirds would not
tell a swing that dies out.

Where the encoder's steps stand against the wall moves a boundary, with friction by up to a factor of two. The seed
puts them there, at the same places in every column, so that two columns differ by what their axes say. Another
`--seed` shows how far a boundary moves.

One axis has the servo's own coupling, velocity window, stabilisers and force limits, as the same templates, in the
loop's numbers, and exact mechanics. *Whole arm* is the servo step itself with the emulated device, its driver and its
packets in virtual time (`--arm`); it also slides onto the flat and hits the corner of three walls. The mechanics of the
devices are plausible values, not those of a unit: with a device of your own, give `--mass`, `--viscous`, `--friction`
and `--quantum`, and take its map.

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
    R"(The lower of both rules, in N/mm, at two dampings: the default, and the one that carries most on the device's map.
*Linear, exact* is the boundary without friction and encoder steps; the emulated firm hand is 0.1 kg, 0.005 N s/mm,
0.5 N/mm; in *whole arm* a spring of 0.2 N/mm pushes. Each measured K is the least of three seeds: on one axis at 160
stiffnesses from 0.05 to 50 N/mm with hits of 2 s, with the whole arm at 14 with hits of 1 s. The recommended one is the
least of the row over 1.5. That margin is also for islands of swings narrower than a step of the map: one was seen at
0.82 of a first crossing (Omni, no delay, B 0.002). The delay of a real device has not been measured; take two periods until it is. Take
no more damping than the map bears: beyond its hump the lag of the velocity and the encoder's steps drive the wall.

The devices here are the emulator's. The check of a scene (docs/devices.md, "Gains") takes less viscous damping,
0.0002 N s/mm, and a delay of 2 ms at every rate, so what it calls safe is lower: it speaks for units that nobody has
measured.

)";

constexpr const char* kStabilisersText =
    R"(
## Stabilisers

The same with B = 0.002 N s/mm and a stabiliser that knows the device's own mass and damping, on one axis and, behind
the stroke, with the whole arm; one seed, 40 stiffnesses and 14. What each costs the hand is in docs/energy.md. The account of `passivity` takes a force
for done in the tick that asks for it. With a delay the device is pushed later, and the port may give far more than is
booked: `port_minimum_mj` of `--csv` has the lowest energy of the port in each cell, over the hits that were played (one
that is bad by both rules ends a cell).

)";

constexpr const char* kRatesText =
    R"(Without friction the boundary grows with the rate; measured, it does so less and less. The encoder's steps are the
same at every rate, and the velocity window spans up to 16 ms at every rate, so its lag counts more periods: a fast loop
bears less damping than the linear boundary says. Grey columns have more damping than is stable without any wall.

)";

constexpr const char* kKnobsText = R"(## What each knob does

An Omni with B = 0.002 N s/mm and a delay of one period, one knob at a time, K in N/mm; the standard in bold. The linear
boundary knows mass, both dampings, delay, rate, hand and filter. *Re-entry* is the lowest K above the first crossing
that comes to rest again. One seed, 40 stiffnesses from 0.05 to 50 N/mm, hits of 2 s: a finer map finds more islands of
either kind.

)";

constexpr const char* kNumbersText = R"(
They part where a run is chaotic, as near every boundary of a loop with friction and encoder steps: 2^-16 mm or N more
or less shift the tick in which an encoder's step is met, and with it where the tip comes to rest. No kind of numbers is
always on the better side.

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

/// Stiffness against damping; `quick` where a test only wants to see it work.
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
  if (n_per_mm == Crossing::kNever) return "> 50";
  return n_per_mm > 0 ? page_number(n_per_mm) : "< 0.05";
}

/// The lower of both rules; 0 where there is none.
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
  double least = Crossing::kNever;
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

/// Where the three numbers part on a map: cells with another verdict than double's.
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
